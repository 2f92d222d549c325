use crate::sweeps::half_angle;
use aogrid_tables::{Clip, ClipTable, MergeTable, clip, merge};
use std::f64::consts::{FRAC_PI_2, PI};

/// Rounding of a few terms of order one.
const ROUNDING: f64 = 1e-12;

/// Error of linear filtering for a look-up between nodes; see `errors`.
const FILTERING: f64 = 6.4e-3;

/// Both implementations of `T_clip`, and both of `T_merge`.
const CLIPS: [fn(f64, f64) -> Clip<f64>; 2] = [clip::integrate, clip::closed_form];
const MERGES: [fn(f64, f64, f64) -> f64; 2] = [merge::integrate, merge::closed_form];

fn steps(n: u32) -> impl Iterator<Item = f64> + Clone {
    (0..=n).map(move |i| f64::from(i) / f64::from(n))
}

/// Cones with cos β ≥ 0 that do not reach the plane.
fn unclipped_cones() -> impl Iterator<Item = (f64, f64)> {
    let all = steps(40).flat_map(|a| steps(40).map(move |cos_beta| (a, cos_beta)));
    all.filter(|&(a, cos_beta)| half_angle(a) + cos_beta.acos() < FRAC_PI_2 - 1e-9)
}

#[track_caller]
fn assert_near(value: f64, expected: f64, tolerance: f64) {
    assert!(
        (value - expected).abs() <= tolerance,
        "{value} instead of {expected}"
    );
}

/// f weights the cone's axis, not the normal.
#[test]
fn an_unclipped_cone_keeps_its_axis() {
    for t_clip in CLIPS {
        for (a, cos_beta) in unclipped_cones() {
            assert_near(t_clip(a, cos_beta).axis_weight, 1.0, ROUNDING);
            assert_near(t_clip(a, cos_beta).fraction, a, ROUNDING);
        }
    }
    let look_up = ClipTable::committed().sample(0.1, 0.9);
    assert_near(look_up.axis_weight.into(), 1.0, FILTERING);
}

/// An unclipped cone has AO = sin²α cos β; its solid angle would give 2a.
#[test]
fn occlusion_is_cosine_weighted() {
    for t_clip in CLIPS {
        for (a, cos_beta) in unclipped_cones() {
            assert_near(
                t_clip(a, cos_beta).occlusion,
                4.0 * a * (1.0 - a) * cos_beta,
                ROUNDING,
            );
        }
    }
    let look_up = ClipTable::committed().sample(0.25, 1.0);
    assert_near(look_up.occlusion.into(), 0.75, FILTERING);
}

/// Two half-spaces intersect in a wedge, with its axis halfway between d and n.
#[test]
fn a_hemisphere_is_clipped_to_a_wedge() {
    for t_clip in CLIPS {
        for cos_beta in steps(64).map(|x| 2.0 * x - 1.0) {
            let wedge = t_clip(0.5, cos_beta);
            assert_near(wedge.occlusion, 0.5 + 0.5 * cos_beta, ROUNDING);
            assert_near(wedge.fraction, 0.5 - cos_beta.acos() / (2.0 * PI), ROUNDING);
            if cos_beta.abs() < 1.0 {
                assert_near(wedge.axis_weight, 0.5, ROUNDING);
            }
        }
    }
}

/// A hemisphere around the receiver's normal hides everything.
#[test]
fn the_receivers_own_hemisphere_occludes_everything() {
    for t_clip in CLIPS {
        let all = t_clip(0.5, 1.0);
        assert_near(all.occlusion, 1.0, ROUNDING);
        assert_near(all.fraction, 0.5, ROUNDING);
        assert_near(all.axis_weight, 1.0, ROUNDING);
    }
}

/// The axis of a cone below the plane has its limit, the direction in the plane nearest to it.
#[test]
fn a_cone_below_the_plane_occludes_nothing() {
    for t_clip in CLIPS {
        for (a, cos_beta) in unclipped_cones().map(|(a, cos_beta)| (a, -cos_beta)) {
            let clipped = t_clip(a, cos_beta);
            assert_eq!((clipped.occlusion, clipped.fraction), (0.0, 0.0));
            let f = clipped.axis_weight;
            assert_near(f * cos_beta + (1.0 - f), 0.0, ROUNDING);
        }
    }
}

#[test]
fn fraction_zero_occludes_nothing_and_fraction_one_everything() {
    for t_clip in CLIPS {
        for cos_beta in steps(64).map(|x| 2.0 * x - 1.0) {
            assert_eq!(t_clip(0.0, cos_beta).occlusion, 0.0);
            assert_near(t_clip(1.0, cos_beta).occlusion, 1.0, ROUNDING);
            assert_near(t_clip(1.0, cos_beta).axis_weight, 0.0, ROUNDING);
        }
    }
    for t_merge in MERGES {
        for (a, gamma) in steps(16).flat_map(|a| steps(16).map(move |x| (a, PI * x))) {
            assert_near(t_merge(a, 0.0, gamma), a, ROUNDING);
            assert_near(t_merge(a, 1.0, gamma), 1.0, ROUNDING);
        }
    }
}

/// Two hemispheres cover ½ + γ/2π: linear in the angle between them, not in its cosine.
#[test]
fn merging_hemispheres_is_linear_in_the_angle() {
    let table = MergeTable::committed();
    for gamma in steps(64).map(|x| PI * x) {
        let expected = 0.5 + gamma / (2.0 * PI);
        for t_merge in MERGES {
            assert_near(t_merge(0.5, 0.5, gamma), expected, ROUNDING);
        }
        assert_near(
            table.sample(0.5, 0.5, gamma as f32).into(),
            expected,
            FILTERING,
        );
    }
}

#[test]
fn caps_of_one_axis_are_nested_and_opposite_caps_add_up() {
    for t_merge in MERGES {
        for (a1, a2) in steps(24).flat_map(|a1| steps(24).map(move |a2| (a1, a2))) {
            assert_near(t_merge(a1, a2, 0.0), a1.max(a2), ROUNDING);
            assert_near(t_merge(a1, a2, PI), (a1 + a2).min(1.0), ROUNDING);
        }
    }
}

/// The rims pass through each other's axes: the triangles have sides of 60° and corners of
/// acos(1/3).
#[test]
fn caps_through_each_others_axes_intersect_in_a_lens() {
    let corner = (1.0_f64 / 3.0).acos();
    let excess = 3.0 * corner - PI;
    let shared = 2.0 * (0.25 * corner) / PI - excess / (2.0 * PI);
    for t_merge in MERGES {
        assert_near(t_merge(0.25, 0.25, PI / 3.0), 0.5 - shared, ROUNDING);
    }
}
