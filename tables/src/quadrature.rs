//! Tanh-sinh quadrature: the double-exponential rule of Takahasi and Mori (1974).
//!
//! The integrands of both tables are analytic inside each piece between their kinks, with at
//! worst a square root at an end. This rule concentrates its samples at the ends, so that neither
//! such an end nor a kink just outside a piece costs accuracy.

use std::sync::LazyLock;

/// Distance between samples in the substituted variable t. Halving it changes no integral of this
/// crate by more than rounding (see the tests).
const STEP: f64 = 1.0 / 16.0;

/// Number of samples on either side of the middle. At t = 57/16 the weight has fallen to 1e-22.
const SAMPLES_PER_SIDE: usize = 57;

/// The samples on one side of the middle; the other side is the mirror image.
static RULE: LazyLock<Vec<Sample>> = LazyLock::new(|| {
    (1..=SAMPLES_PER_SIDE)
        .map(|k| Sample::at(STEP * k as f64))
        .collect()
});

/// A sample on the unit interval.
struct Sample {
    /// Distance from the nearer end. A position could not distinguish 1 − 1e-20 from 1.
    to_end: f64,
    weight: f64,
}

impl Sample {
    /// Returns the sample at x(t) = (1 + tanh(π/2 sinh t))/2, with the weight dx/dt.
    fn at(t: f64) -> Self {
        let decay = (-std::f64::consts::PI * t.sinh()).exp();
        let to_end = decay / (1.0 + decay);
        let weight = STEP * std::f64::consts::PI * t.cosh() * to_end / (1.0 + decay);
        Self { to_end, weight }
    }
}

/// Integrates over an interval of the given width; returns zero if the width is not positive.
///
/// The integrand's arguments are the distances of a sample from the start and from the end of the
/// interval, both to full relative precision.
pub(crate) fn integrate<const C: usize>(
    width: f64,
    integrand: impl Fn(f64, f64) -> [f64; C],
) -> [f64; C] {
    if width.is_nan() || width <= 0.0 {
        return [0.0; C];
    }
    let middle = Sample::at(0.0).weight;
    let mut sum = integrand(0.5 * width, 0.5 * width).map(|value| middle * value);
    for Sample { to_end, weight } in RULE.iter() {
        let near = width * to_end;
        let far = width - near;
        let (left, right) = (integrand(near, far), integrand(far, near));
        for channel in 0..C {
            sum[channel] += weight * (left[channel] + right[channel]);
        }
    }
    sum.map(|value| value * width)
}

#[cfg(test)]
mod tests {
    use super::integrate;

    /// Rounding of about a hundred terms of order one.
    const ROUNDING: f64 = 1e-14;

    fn integrate_one(width: f64, integrand: impl Fn(f64) -> f64) -> f64 {
        integrate(width, |from_start, _| [integrand(from_start)])[0]
    }

    #[test]
    fn smooth_integrands_are_exact() {
        assert!((integrate_one(1.0, |_| 1.0) - 1.0).abs() < ROUNDING);
        assert!((integrate_one(2.0, |x| x * x) - 8.0 / 3.0).abs() < ROUNDING);
        assert!((integrate_one(1.0, f64::exp) - (1f64.exp() - 1.0)).abs() < ROUNDING);
    }

    #[test]
    fn square_roots_at_the_ends_cost_no_accuracy() {
        let half_disk = integrate(2.0, |from_start, to_end| [(from_start * to_end).sqrt()])[0];
        assert!((half_disk - std::f64::consts::FRAC_PI_2).abs() < ROUNDING);
    }

    #[test]
    fn a_kink_just_outside_costs_no_accuracy() {
        for gap in [1e-12_f64, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2, 0.1] {
            let exact = ((1.0 + gap) * (1.0 + gap).sqrt() - gap * gap.sqrt()) / 1.5;
            let sum = integrate_one(1.0, |x| (x + gap).sqrt());
            assert!(
                (sum - exact).abs() < ROUNDING,
                "gap {gap}: off by {}",
                sum - exact
            );
        }
    }

    #[test]
    fn the_integral_over_an_empty_interval_is_zero() {
        for width in [0.0, -1.0, f64::NAN] {
            assert_eq!(integrate_one(width, |_| 1.0), 0.0);
        }
    }
}
