use crate::sweeps::{angles, cosines, fractions};
use aogrid_tables::{Clip, ClipTable, MergeTable, clip, merge};

/// The documented agreement between integration and closed form in f64. Both round about a hundred
/// terms of order one, so 1e-13 would suffice.
const AGREEMENT: f64 = 1e-12;

/// Rounding of f, to be divided by sin β. f follows from the rings that cross the rim, an interval
/// no narrower than sin β over most of its range, between two kinks that are each rounded at 4e-16
/// (half the spacing of f64 at π).
const KINK_ROUNDING: f64 = 1e-15;

/// Rounding of the closed forms in f32: eight times the spacing of f32 at 1, for about five
/// roundings of values up to π.
const F32_ROUNDING: f64 = 8.0 * f32::EPSILON as f64;

#[test]
fn clip_integration_agrees_with_the_closed_form() {
    for a in fractions(48) {
        for cos_beta in cosines(48, a) {
            let integrated = clip::integrate(a, cos_beta);
            let closed = clip::closed_form(a, cos_beta);
            let sin_beta = ((1.0 - cos_beta) * (1.0 + cos_beta)).sqrt();
            let rounding = if sin_beta > 0.0 {
                KINK_ROUNDING / sin_beta
            } else {
                0.0
            };
            let near = |x: f64, y: f64, tolerance: f64| (x - y).abs() <= tolerance;
            assert!(
                near(integrated.occlusion, closed.occlusion, AGREEMENT)
                    && near(integrated.fraction, closed.fraction, AGREEMENT)
                    && near(
                        integrated.axis_weight,
                        closed.axis_weight,
                        AGREEMENT + rounding
                    ),
                "a {a:e}, cos β {cos_beta:e}: {integrated:?} but {closed:?}"
            );
        }
    }
}

#[test]
fn merge_integration_agrees_with_the_closed_form() {
    for a1 in fractions(12) {
        for a2 in fractions(12).into_iter().filter(|&a2| a2 <= a1) {
            for gamma in angles(12, a1, a2) {
                let integrated = merge::integrate(a1, a2, gamma);
                let closed = merge::closed_form(a1, a2, gamma);
                let error = (integrated - closed).abs();
                assert!(
                    error <= AGREEMENT,
                    "({a1:e}, {a2:e}, {gamma:e}): off by {error:e}"
                );
            }
        }
    }
}

#[test]
fn clip_in_f32_is_accurate_to_rounding() {
    for a in fractions(200).into_iter().map(|a| a as f32) {
        for cos_beta in cosines(200, a.into()).into_iter().map(|c| c as f32) {
            let narrow = clip::closed_form(a, cos_beta);
            let wide = clip::closed_form(f64::from(a), f64::from(cos_beta));
            let near = |x: f32, y: f64| (f64::from(x) - y).abs() <= F32_ROUNDING;
            assert!(
                near(narrow.occlusion, wide.occlusion)
                    && near(narrow.fraction, wide.fraction)
                    && near(narrow.axis_weight, wide.axis_weight),
                "a {a:e}, cos β {cos_beta:e}: {narrow:?} but {wide:?}"
            );
        }
    }
}

#[test]
fn merge_in_f32_is_accurate_to_rounding() {
    for a1 in fractions(24).into_iter().map(|a| a as f32) {
        for a2 in fractions(24).into_iter().map(|a| a as f32) {
            for gamma in angles(24, a1.into(), a2.into())
                .into_iter()
                .map(|g| g as f32)
            {
                let narrow = merge::closed_form(a1, a2, gamma);
                let wide = merge::closed_form(f64::from(a1), f64::from(a2), f64::from(gamma));
                let error = (f64::from(narrow) - wide).abs();
                assert!(
                    error <= F32_ROUNDING,
                    "({a1:e}, {a2:e}, {gamma:e}): off by {error:e}"
                );
            }
        }
    }
}

/// π as an `f32` is larger than π, so its sine is negative: the printed code then finds that
/// opposite caps do not intersect, however large they are.
#[test]
fn opposite_caps_in_f32_intersect_in_the_excess_over_the_sphere() {
    let gamma = std::f32::consts::PI;
    for (a1, a2) in [(0.75_f32, 0.75), (0.9, 0.3), (1.0, 0.5), (0.6, 0.5)] {
        let shared = merge::intersection(a1, a2, gamma);
        assert!(f64::from((shared - (a1 + a2 - 1.0)).abs()) <= F32_ROUNDING);
        assert_eq!(merge::closed_form(a1, a2, gamma), 1.0);
    }
}

/// The printed integral starts at θ = γ − α_B and divides zero by zero if γ = α_B.
#[test]
fn an_axis_on_the_other_rim_is_not_singular_in_f32() {
    for (a1, a2) in [(0.75_f32, 0.25_f32), (0.5, 0.25), (0.3, 0.2), (0.25, 0.25)] {
        let gamma = (1.0 - 2.0 * a2).acos();
        let wide = merge::closed_form(f64::from(a1), f64::from(a2), f64::from(gamma));
        let narrow = merge::closed_form(a1, a2, gamma);
        assert!((f64::from(narrow) - wide).abs() <= F32_ROUNDING);
        let beside = merge::closed_form(a1, a2, gamma + 1e-3);
        assert!((beside - narrow).abs() < 1e-3, "{narrow} jumps to {beside}");
    }
}

/// Tests inputs that NaN normals, half-precision axes or mistakes in a shader can cause.
#[test]
fn no_input_causes_a_nan() {
    let values = [
        f32::NAN,
        f32::NEG_INFINITY,
        -4.0,
        -1.0000001,
        -1.0,
        -1e-3,
        -1e-30,
        -0.0,
        0.0,
    ]
    .into_iter()
    .chain([
        1e-45,
        f32::MIN_POSITIVE,
        1e-20,
        1e-7,
        1e-3,
        0.5,
        0.99999994,
        1.0,
        1.0000001,
    ])
    .chain([1.5, std::f32::consts::PI, 3.5, f32::MAX, f32::INFINITY]);
    let values: Vec<f32> = values.collect();
    let (clip_table, merge_table) = (ClipTable::committed(), MergeTable::committed());
    for &x in &values {
        for &y in &values {
            let (wide_x, wide_y) = (f64::from(x), f64::from(y));
            assert_in_range(clip::closed_form(x, y).into_f64(), (x, y));
            assert_in_range(clip_table.sample(x, y).into_f64(), (x, y));
            assert_in_range(clip::closed_form(wide_x, wide_y), (x, y));
            assert_in_range(clip::integrate(wide_x, wide_y), (x, y));
            for &z in &values {
                let wide_z = f64::from(z);
                let unions = [
                    merge::closed_form(x, y, z).into(),
                    merge_table.sample(x, y, z).into(),
                    merge::closed_form(wide_x, wide_y, wide_z),
                    merge::integrate(wide_x, wide_y, wide_z),
                    f64::from(merge::intersection(x, y, z)),
                ];
                assert!(
                    unions.iter().all(|u| (0.0..=1.0).contains(u)),
                    "{:?}",
                    (x, y, z)
                );
            }
        }
    }
}

fn assert_in_range(clip: Clip<f64>, at: (f32, f32)) {
    let ranges = [
        (clip.occlusion, 1.0),
        (clip.fraction, 0.5),
        (clip.axis_weight, 1.0),
    ];
    let in_range = ranges
        .iter()
        .all(|&(value, max)| (0.0..=max).contains(&value));
    assert!(in_range, "{at:?}: {clip:?}");
}

trait IntoF64 {
    fn into_f64(self) -> Clip<f64>;
}

impl IntoF64 for Clip<f32> {
    fn into_f64(self) -> Clip<f64> {
        Clip {
            occlusion: self.occlusion.into(),
            fraction: self.fraction.into(),
            axis_weight: self.axis_weight.into(),
        }
    }
}
