//! Arguments in regular steps, and those at and next to degenerate cases.

use std::f64::consts::PI;

/// Distances from a degenerate argument: zero, its rounding error, and larger ones.
const NEAR: [f64; 6] = [0.0, 2e-16, 1e-12, 1e-9, 1e-6, 1e-3];

/// Returns the half-angle of a cone by the textbook formula.
pub fn half_angle(a: f64) -> f64 {
    (1.0 - 2.0 * a).acos()
}

/// Returns fractions 0..=1 in `steps` steps, and those around 0, ½ and 1.
pub fn fractions(steps: u32) -> Vec<f64> {
    with_neighbors(steps, [0.0, 1.0], &[0.0, 0.5, 1.0])
}

/// Returns cosines −1..=1 in `steps` steps, those around ±1 and 0, and those at which the plane
/// touches the rim.
pub fn cosines(steps: u32, a: f64) -> Vec<f64> {
    let touching = half_angle(a).sin();
    with_neighbors(steps, [-1.0, 1.0], &[-1.0, -touching, 0.0, touching, 1.0])
}

/// Returns angles 0..=π in `steps` steps, those around the ends, around each half-angle, and around
/// all angles at which the rims touch.
pub fn angles(steps: u32, a1: f64, a2: f64) -> Vec<f64> {
    let (alpha1, alpha2) = (half_angle(a1), half_angle(a2));
    let touching = [
        alpha1 + alpha2,
        (alpha1 - alpha2).abs(),
        2.0 * PI - alpha1 - alpha2,
    ];
    let special = [[0.0, PI].as_slice(), &[alpha1, alpha2], &touching].concat();
    with_neighbors(steps, [0.0, PI], &special)
}

fn with_neighbors(steps: u32, [low, high]: [f64; 2], special: &[f64]) -> Vec<f64> {
    let regular = (0..=steps).map(|i| low + (high - low) * f64::from(i) / f64::from(steps));
    let around = |&at: &f64| NEAR.into_iter().flat_map(move |gap| [at - gap, at + gap]);
    let mut all: Vec<f64> = regular.chain(special.iter().flat_map(around)).collect();
    all.retain(|x| (low..=high).contains(x));
    all
}
