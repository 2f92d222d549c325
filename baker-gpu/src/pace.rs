//! How much work a submission may hold.
//!
//! Operating systems reset a GPU that is busy for about two seconds, and a screen that it also
//! drives stutters long before. How fast a device is nobody knows beforehand, so a bake starts
//! with little and measures.

use std::time::Duration;

/// How long a submission should take.
const TARGET: Duration = Duration::from_millis(40);

/// Shorter than this says more about the way to the device than about the device.
const MEASURABLE: Duration = Duration::from_millis(4);

/// The first submission, in units: little even for a slow device.
const START: f64 = 2e6;

/// How much faster at most a device is believed to be than at the last submission.
const MOST_GROWTH: f64 = 4.0;

/// Work in units of an invocation's short loop, about: kernels estimate their own.
pub(crate) struct Pace {
    /// Units a submission.
    budget: f64,
}

impl Default for Pace {
    fn default() -> Self {
        Self { budget: START }
    }
}

impl Pace {
    pub(crate) fn budget(&self) -> f64 {
        self.budget
    }

    /// Learns from a submission of so many units.
    pub(crate) fn learn(&mut self, units: f64, took: Duration) {
        let per_target = units * TARGET.as_secs_f64() / took.max(MEASURABLE).as_secs_f64();
        // What was small and quick says nothing about how slow the device could be.
        let slower = took > TARGET;
        if slower || per_target > self.budget {
            self.budget = per_target.clamp(START / 64.0, MOST_GROWTH * self.budget);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn submissions_approach_the_target_from_below() {
        // Units a second of a slow device, a fast one, and one that is busy elsewhere.
        for speed in [1e5, 1e8, 1e11] {
            let mut pace = Pace::default();
            for _ in 0..20 {
                let units = pace.budget();
                pace.learn(units, Duration::from_secs_f64(units / speed));
            }
            let took = pace.budget() / speed;
            let least = START / 64.0 / speed;
            assert!(
                took <= (1.01 * TARGET.as_secs_f64()).max(least),
                "{speed}: {took}"
            );
            assert!(took >= 0.9 * MEASURABLE.as_secs_f64(), "{speed}: {took}");
        }
    }

    #[test]
    fn small_submissions_do_not_slow_it_down() {
        let mut pace = Pace::default();
        for _ in 0..10 {
            pace.learn(10.0, Duration::from_millis(5));
        }
        assert_eq!(pace.budget(), START);
    }
}
