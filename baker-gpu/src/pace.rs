//! The amount of work per submission.
//!
//! Operating systems reset a GPU that is busy for about two seconds, and a display that it also
//! drives stutters long before. Device speed is unknown, so the first submissions are small and
//! later ones are sized from measured times.

use std::time::Duration;

/// The time that a submission should take.
const TARGET: Duration = Duration::from_millis(40);

/// The shortest time that measures the device; below it, submission overhead dominates.
const MIN_MEASURABLE: Duration = Duration::from_millis(4);

/// The budget of the first submission in work units: small even for a slow device.
const INITIAL_BUDGET: f64 = 2e6;

/// The largest factor by which the budget grows from one submission to the next.
const MAX_GROWTH: f64 = 4.0;

/// Sizes submissions from measured times. Work is measured in units of roughly one iteration of
/// an invocation's short loop; each kernel estimates its own.
pub(crate) struct SubmissionPacer {
    /// Work units per submission.
    budget: f64,
}

impl Default for SubmissionPacer {
    fn default() -> Self {
        Self {
            budget: INITIAL_BUDGET,
        }
    }
}

impl SubmissionPacer {
    pub(crate) fn budget(&self) -> f64 {
        self.budget
    }

    /// Adapts the budget to the measured time of a submission of this many work units.
    pub(crate) fn record(&mut self, units: f64, elapsed: Duration) {
        let per_target = units * TARGET.as_secs_f64() / elapsed.max(MIN_MEASURABLE).as_secs_f64();
        // A short submission is no evidence that the device is slow: it may just be small.
        let too_slow = elapsed > TARGET;
        if too_slow || per_target > self.budget {
            self.budget = per_target.clamp(INITIAL_BUDGET / 64.0, MAX_GROWTH * self.budget);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn submissions_approach_the_target_from_below() {
        // Work units per second of a slow, a fast and a very fast device.
        for speed in [1e5, 1e8, 1e11] {
            let mut pacer = SubmissionPacer::default();
            for _ in 0..20 {
                let units = pacer.budget();
                pacer.record(units, Duration::from_secs_f64(units / speed));
            }
            let elapsed = pacer.budget() / speed;
            let shortest = INITIAL_BUDGET / 64.0 / speed;
            assert!(
                elapsed <= (1.01 * TARGET.as_secs_f64()).max(shortest),
                "{speed}: {elapsed}"
            );
            assert!(
                elapsed >= 0.9 * MIN_MEASURABLE.as_secs_f64(),
                "{speed}: {elapsed}"
            );
        }
    }

    #[test]
    fn small_submissions_do_not_lower_the_budget() {
        let mut pacer = SubmissionPacer::default();
        for _ in 0..10 {
            pacer.record(10.0, Duration::from_millis(5));
        }
        assert_eq!(pacer.budget(), INITIAL_BUDGET);
    }
}
