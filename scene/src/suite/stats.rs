//! The statistics of errors.

use serde::Serialize;

/// The error beyond which a receiver counts as far off.
const FAR_OFF: f64 = 0.1;

/// The errors of AO over some receivers: shaded less true.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorStats {
    /// The number of receivers.
    pub receivers: usize,
    /// The mean of the true AO.
    pub truth: f64,
    /// The root mean square of the truth's standard errors.
    pub truth_error: f64,
    /// The mean error.
    pub bias: f64,
    /// The root mean square error.
    pub rmse: f64,
    /// The absolute error that 95 % of the receivers do not exceed.
    pub p95: f64,
    /// The largest absolute error.
    pub max: f64,
    /// The share of receivers that are off by more than 0.1.
    pub far_off: f64,
}

/// A receiver's shaded and true AO, and the standard error of the latter.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// The shaded AO.
    pub shaded: f64,
    /// The true AO.
    pub truth: f64,
    /// The standard error of the truth.
    pub truth_error: f64,
}

impl ErrorStats {
    /// Returns the statistics; `None` without receivers.
    pub fn of(samples: &[Sample]) -> Option<Self> {
        let n = samples.len();
        let mean = |value: fn(&Sample) -> f64| samples.iter().map(value).sum::<f64>() / n as f64;
        let mut sizes: Vec<f64> = samples.iter().map(|s| (s.shaded - s.truth).abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let max = *sizes.last()?;
        let far_off = sizes.iter().filter(|&&size| size > FAR_OFF).count();
        Some(Self {
            receivers: n,
            truth: mean(|s| s.truth),
            truth_error: mean(|s| s.truth_error.powi(2)).sqrt(),
            bias: mean(|s| s.shaded - s.truth),
            rmse: mean(|s| (s.shaded - s.truth).powi(2)).sqrt(),
            p95: sizes[(0.95 * n as f64).ceil() as usize - 1],
            max,
            far_off: far_off as f64 / n as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_a_few_errors() {
        let samples: Vec<_> = (1..=100)
            .map(|idx| Sample {
                shaded: 0.5 + 0.002 * f64::from(idx) * if idx % 2 == 0 { 1.0 } else { -1.0 },
                truth: 0.5,
                truth_error: 0.001,
            })
            .collect();
        let stats = ErrorStats::of(&samples).unwrap();
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        close(stats.bias, 0.001);
        // The mean of the squares of 1..=100 is 101 · 201 / 6.
        close(stats.rmse, 0.002 * (101.0_f64 * 201.0 / 6.0).sqrt());
        close(stats.p95, 0.19);
        close(stats.max, 0.2);
        close(stats.truth_error, 0.001);
        // The errors 51..=100 exceed 0.1.
        close(stats.far_off, 0.5);
        assert_eq!(ErrorStats::of(&[]), None);
    }
}
