use aogrid_tables::{clip, merge};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::PI;

const CASES: usize = 64;
const DIRECTIONS: usize = 40_000;

/// Tolerance in standard errors. By chance one in 16,000 comparisons exceeds four; there are about
/// 250 here, and the seeds are fixed.
const STANDARD_ERRORS: f64 = 4.0;

/// Minimum fraction for a comparison. Below it too few directions hit a region to estimate the
/// variance of its moment.
const MIN_FRACTION: f64 = 0.02;

struct Directions(ChaCha8Rng);

impl Directions {
    fn seeded(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Returns a number uniform in 0..1.
    fn number(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a direction uniform on the sphere, by Archimedes' cylinder.
    fn direction(&mut self) -> [f64; 3] {
        let z = 2.0 * self.number() - 1.0;
        let (sin, cos) = (2.0 * PI * self.number()).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        [radius * cos, radius * sin, z]
    }
}

/// Returns the axis of a cone, `angle` away from z, and the test whether a direction lies inside.
fn cone(a: f64, angle: f64) -> ([f64; 3], impl Fn([f64; 3]) -> bool) {
    let axis = [angle.sin(), 0.0, angle.cos()];
    (axis, move |[x, _, z]| {
        x * axis[0] + z * axis[2] >= 1.0 - 2.0 * a
    })
}

/// Asserts that `hits` of all directions are the fraction `expected` within the statistical error.
#[track_caller]
fn assert_fraction(hits: usize, expected: f64) {
    let fraction = hits as f64 / DIRECTIONS as f64;
    let standard_error = (expected * (1.0 - expected) / DIRECTIONS as f64).sqrt();
    let tolerance = STANDARD_ERRORS * standard_error + f64::EPSILON;
    assert!(
        (fraction - expected).abs() <= tolerance,
        "{fraction} instead of {expected}"
    );
}

#[test]
fn clipped_fraction_and_occlusion_match_random_directions() {
    let mut random = Directions::seeded(0x7ab1e5);
    for _ in 0..CASES {
        let (a, cos_beta) = (random.number(), 2.0 * random.number() - 1.0);
        let (_, inside) = cone(a, cos_beta.acos());
        let (mut hits, mut weighted_hits) = (0, 0);
        for _ in 0..DIRECTIONS {
            let [x, y, z] = random.direction();
            hits += usize::from(z > 0.0 && inside([x, y, z]));
            // Malley's method: points uniform on the disk are cosine-weighted on the hemisphere.
            let (radius, azimuth) = (random.number().sqrt(), 2.0 * PI * random.number());
            let up = (1.0 - radius * radius).sqrt();
            let weighted = [radius * azimuth.cos(), radius * azimuth.sin(), up];
            weighted_hits += usize::from(inside(weighted));
        }
        let clipped = clip::integrate(a, cos_beta);
        assert_fraction(hits, clipped.fraction);
        assert_fraction(weighted_hits, clipped.occlusion);
    }
}

/// f d + (1 − f) n, scaled to the occlusion along n, is the mean of all directions in the region.
#[test]
fn the_clipped_axis_matches_the_mean_of_random_directions() {
    let mut random = Directions::seeded(0xa815);
    let mut compared = 0;
    for _ in 0..CASES {
        let (a, cos_beta) = (random.number(), 2.0 * random.number() - 1.0);
        let clipped = clip::integrate(a, cos_beta);
        if clipped.fraction < MIN_FRACTION {
            continue;
        }
        let (axis, inside) = cone(a, cos_beta.acos());
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..DIRECTIONS {
            let [x, y, z] = random.direction();
            let across = if z > 0.0 && inside([x, y, z]) { x } else { 0.0 };
            sum += across;
            squares += across * across;
        }
        let mean = sum / DIRECTIONS as f64;
        let variance = squares / DIRECTIONS as f64 - mean * mean;
        let f = clipped.axis_weight;
        let expected = 0.25 * clipped.occlusion * f * axis[0] / (f * cos_beta + 1.0 - f);
        let tolerance = STANDARD_ERRORS * (variance / DIRECTIONS as f64).sqrt();
        assert!(
            (mean - expected).abs() <= tolerance,
            "({a}, {cos_beta}): {mean}, not {expected}"
        );
        compared += 1;
    }
    assert!(compared > CASES / 2, "only {compared} comparisons");
}

#[test]
fn the_union_matches_random_directions() {
    let mut random = Directions::seeded(0x9e26e);
    for _ in 0..CASES {
        let (a1, a2, gamma) = (random.number(), random.number(), PI * random.number());
        let ((_, in_first), (_, in_second)) = (cone(a1, 0.0), cone(a2, gamma));
        let covered = |direction| in_first(direction) || in_second(direction);
        let hits = (0..DIRECTIONS)
            .filter(|_| covered(random.direction()))
            .count();
        assert_fraction(hits, merge::integrate(a1, a2, gamma));
    }
}
