use crate::sweeps::{angles, cosines, fractions};
use aogrid_tables::{Clip, clip, merge};
use std::f64::consts::PI;

/// Rounding of a few terms of order one; the relations themselves are exact.
const ROUNDING: f64 = 1e-12;

/// Both implementations of `T_clip`, and both of `T_merge`.
const CLIPS: [fn(f64, f64) -> Clip<f64>; 2] = [clip::integrate, clip::closed_form];
const MERGES: [fn(f64, f64, f64) -> f64; 2] = [merge::integrate, merge::closed_form];

fn for_each_clip(check: impl Fn(&dyn Fn(f64, f64) -> Clip<f64>, f64, f64) -> f64) {
    for t_clip in CLIPS {
        for a in fractions(24) {
            for cos_beta in cosines(24, a) {
                let error = check(&t_clip, a, cos_beta).abs();
                assert!(
                    error <= ROUNDING,
                    "a {a:e}, cos β {cos_beta:e}: off by {error:e}"
                );
            }
        }
    }
}

fn for_each_merge(check: impl Fn(&dyn Fn(f64, f64, f64) -> f64, f64, f64, f64) -> f64) {
    for t_merge in MERGES {
        for a1 in fractions(6) {
            for a2 in fractions(6) {
                for gamma in angles(6, a1, a2) {
                    let error = check(&t_merge, a1, a2, gamma).abs();
                    assert!(
                        error <= ROUNDING,
                        "({a1:e}, {a2:e}, {gamma:e}): off by {error:e}"
                    );
                }
            }
        }
    }
}

/// The complement of a cone is a cone around −d.
#[test]
fn a_cone_and_its_complement_occlude_everything() {
    for_each_clip(|t_clip, a, cos_beta| {
        t_clip(a, cos_beta).occlusion + t_clip(1.0 - a, -cos_beta).occlusion - 1.0
    });
}

/// The parts above and below the plane add up to the whole cone, whose moment is 4π a (1 − a) d.
#[test]
fn both_sides_of_the_plane_have_the_whole_cones_moment() {
    for_each_clip(|t_clip, a, cos_beta| {
        let difference = t_clip(a, cos_beta).occlusion - t_clip(a, -cos_beta).occlusion;
        difference - 4.0 * a * (1.0 - a) * cos_beta
    });
}

#[test]
fn both_sides_of_the_plane_have_the_whole_cones_solid_angle() {
    for_each_clip(|t_clip, a, cos_beta| {
        t_clip(a, cos_beta).fraction + t_clip(a, -cos_beta).fraction - a
    });
}

/// The half-space above the plane is a cone, too: a′ = a + ½ − `T_merge`(a, ½, β).
#[test]
fn clipping_is_merging_with_a_hemisphere() {
    for (t_clip, t_merge) in CLIPS.into_iter().zip(MERGES) {
        for a in fractions(48) {
            for cos_beta in cosines(48, a) {
                let beta = 2.0 * (1.0 - cos_beta).sqrt().atan2((1.0 + cos_beta).sqrt());
                let expected = a + 0.5 - t_merge(a, 0.5, beta);
                let error = (t_clip(a, cos_beta).fraction - expected).abs();
                assert!(
                    error <= ROUNDING,
                    "a {a:e}, cos β {cos_beta:e}: off by {error:e}"
                );
            }
        }
    }
}

/// The intersections of a cone with another cone and with that cone's complement add up to it.
#[test]
fn intersections_with_a_cone_and_its_complement_add_up() {
    for_each_merge(|t_merge, a1, a2, gamma| {
        let shared = a1 + a2 - t_merge(a1, a2, gamma);
        let shared_with_rest = a1 + (1.0 - a2) - t_merge(a1, 1.0 - a2, PI - gamma);
        shared + shared_with_rest - a1
    });
}

#[test]
fn merging_is_symmetric() {
    for_each_merge(|t_merge, a1, a2, gamma| t_merge(a1, a2, gamma) - t_merge(a2, a1, gamma));
}

#[test]
fn a_union_is_no_smaller_than_a_part_and_no_larger_than_the_sum() {
    for_each_merge(|t_merge, a1, a2, gamma| {
        let union = t_merge(a1, a2, gamma);
        union - union.clamp(a1.max(a2), (a1 + a2).min(1.0))
    });
}

#[test]
fn union_and_intersection_add_up_to_the_sum_of_the_fractions() {
    for_each_merge(|t_merge, a1, a2, gamma| {
        a1 + a2 - t_merge(a1, a2, gamma) - merge::intersection(a1, a2, gamma)
    });
}
