//! Stratified sampling with pairs of jittered samples, and the estimate of a mean and its variance.

use std::f64::consts::FRAC_PI_4;

use glam::DVec3;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The random stream of one receiver.
pub(super) struct Random(ChaCha8Rng);

impl Random {
    /// Creates the random stream of receiver `idx`.
    pub(super) fn of_receiver(seed: u64, idx: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(idx);
        Self(rng)
    }

    /// Returns a uniform point of the unit square, whose coordinates are multiples of 2⁻³².
    fn square(&mut self) -> [f64; 2] {
        let bits = self.0.next_u64();
        [bits as u32, (bits >> 32) as u32].map(|v| f64::from(v) / 2.0_f64.powi(32))
    }
}

/// A grid of strata over the unit square, with two samples in each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strata {
    side: u32,
}

impl Strata {
    /// Returns the coarsest grid with at least so many samples.
    pub(super) fn of_samples(samples: u32) -> Self {
        let mut side = (f64::from(samples) / 2.0).sqrt().ceil() as u32;
        // Correct a square root that was rounded down.
        side += u32::from(2 * u64::from(side).pow(2) < u64::from(samples));
        Self { side: side.max(1) }
    }

    /// Evaluates `value` at every sample and accumulates the results.
    pub(super) fn accumulate<const N: usize>(
        self,
        random: &mut Random,
        mut value: impl FnMut([f64; 2]) -> [f64; N],
    ) -> Accumulator<N> {
        let mut accumulator = Accumulator {
            sums: [0.0; N],
            squares: [0.0; N],
            strata: u64::from(self.side).pow(2) as f64,
        };
        let step = 1.0 / f64::from(self.side);
        for row in 0..self.side {
            for column in 0..self.side {
                let corner = [column, row].map(f64::from);
                let mut sample = || {
                    let jitter = random.square();
                    value(std::array::from_fn(|x| (corner[x] + jitter[x]) * step))
                };
                let (a, b) = (sample(), sample());
                accumulator.add(a, b);
            }
        }
        accumulator
    }
}

/// Sums over pairs of samples, one pair per stratum.
pub(super) struct Accumulator<const N: usize> {
    sums: [f64; N],
    /// The sums of the squared differences within pairs.
    squares: [f64; N],
    strata: f64,
}

impl<const N: usize> Accumulator<N> {
    fn add(&mut self, a: [f64; N], b: [f64; N]) {
        for x in 0..N {
            self.sums[x] += a[x] + b[x];
            self.squares[x] += (a[x] - b[x]).powi(2);
        }
    }

    /// Returns the mean of each value.
    pub(super) fn means(&self) -> [f64; N] {
        self.sums.map(|sum| sum / (2.0 * self.strata))
    }

    /// Returns the variance of each mean. The mean of a pair has variance σ²/2, and (a − b)² has
    /// mean 2σ².
    pub(super) fn variances(&self) -> [f64; N] {
        self.squares.map(|sum| sum / 4.0 / self.strata.powi(2))
    }
}

/// A right-handed orthonormal frame around a normal.
pub(super) struct TangentFrame {
    tangents: [DVec3; 2],
    pub normal: DVec3,
}

impl TangentFrame {
    /// Creates a frame around a normal of length 1.
    pub(super) fn new(normal: DVec3) -> Self {
        let (u, v) = normal.any_orthonormal_pair();
        Self {
            tangents: [u, v],
            normal,
        }
    }

    /// Maps a point of the unit square to a direction, of length 1. Uniform points give directions
    /// with a density proportional to n·ω, in the cone around the normal whose half-angle has the
    /// sine `sin_half`.
    pub(super) fn cosine_weighted(&self, square: [f64; 2], sin_half: f64) -> DVec3 {
        let [x, y] = disk(square).map(|v| v * sin_half);
        let up = (1.0 - x * x - y * y).max(0.0).sqrt();
        x * self.tangents[0] + y * self.tangents[1] + up * self.normal
    }
}

/// Maps the unit square to the unit disk (Shirley and Chiu). The map preserves relative areas;
/// concentric squares become concentric circles.
fn disk(square: [f64; 2]) -> [f64; 2] {
    let [a, b] = square.map(|v| 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0; 2];
    }
    match a.abs() > b.abs() {
        true => {
            let (sin, cos) = (FRAC_PI_4 * b / a).sin_cos();
            [a * cos, a * sin]
        }
        false => {
            let (sin, cos) = (FRAC_PI_4 * a / b).sin_cos();
            [b * sin, b * cos]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strata_have_at_least_the_requested_samples() {
        for (samples, side) in [(0, 1), (1, 1), (2, 1), (3, 2), (8, 2), (9, 3), (8192, 64)] {
            assert_eq!(Strata::of_samples(samples).side, side, "{samples}");
        }
    }

    /// Checks the moments of the density (n·ω)/π over the hemisphere: E[cos] = 2/3, E[cos²] = ½,
    /// E[u²] = ¼, and zero for u, v and uv.
    #[test]
    fn directions_are_cosine_weighted() {
        let normal = DVec3::new(0.6, -0.48, 0.64);
        let frame = TangentFrame::new(normal);
        let mut random = Random::of_receiver(1, 2);
        let estimates = Strata::of_samples(20_000).accumulate(&mut random, |square| {
            let d = frame.cosine_weighted(square, 1.0);
            assert!((d.length() - 1.0).abs() < 1e-12);
            let up = d.dot(normal);
            let [u, v] = frame.tangents.map(|t| t.dot(d));
            [up, up * up, u, v, u * u, u * v]
        });
        let expected = [2.0 / 3.0, 0.5, 0.0, 0.0, 0.25, 0.0];
        let variances = estimates.variances();
        for (x, mean) in estimates.means().into_iter().enumerate() {
            // The tolerance is five standard errors.
            let off = (mean - expected[x]).abs();
            assert!(off < 5.0 * variances[x].sqrt(), "{x}: {mean}");
            assert!(off < 1e-3, "{x}: {mean}");
        }
    }

    #[test]
    fn receivers_have_separate_random_streams() {
        let first = |seed, idx| Random::of_receiver(seed, idx).square();
        assert_eq!(first(1, 2), first(1, 2));
        assert_ne!(first(1, 2), first(1, 3));
        assert_ne!(first(1, 2), first(2, 2));
    }
}
