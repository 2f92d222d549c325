//! Uniformly random directions from a separate random stream for each cell.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// An infinite iterator over the random directions of one cell.
///
/// They depend on the seed and the cell index alone, not on the thread or the order of the cells.
pub(crate) struct CellDirections(ChaCha8Rng);

impl CellDirections {
    pub(crate) fn new(seed: u64, cell_idx: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(cell_idx as u64);
        Self(rng)
    }

    /// Returns a uniform number in −1..1, a multiple of 2⁻⁵².
    fn signed(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

impl Iterator for CellDirections {
    type Item = [f64; 3];

    /// Returns a uniform unit vector by Marsaglia's method (Annals of Mathematical Statistics 43,
    /// 1972). It needs no sine or cosine, whose last bits differ between machines.
    fn next(&mut self) -> Option<[f64; 3]> {
        loop {
            let (x, y) = (self.signed(), self.signed());
            let s = x * x + y * y;
            if s < 1.0 {
                let root = 2.0 * (1.0 - s).sqrt();
                return Some([x * root, y * root, 1.0 - 2.0 * s]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_uniform() {
        let n = 100_000;
        let (mut first, mut second) = ([0.0; 3], [0.0; 3]);
        for d in CellDirections::new(3, 14).take(n) {
            assert!((d.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-12);
            for x in 0..3 {
                first[x] += d[x] / n as f64;
                second[x] += d[x] * d[x] / n as f64;
            }
        }
        // A component has variance 1/3, its square 4/45. The tolerance is four standard deviations
        // of their means.
        for x in 0..3 {
            assert!(first[x].abs() < 4.0 * (1.0 / 3.0 / n as f64).sqrt());
            let off = (second[x] - 1.0 / 3.0).abs();
            assert!(off < 4.0 * (4.0 / 45.0 / n as f64).sqrt());
        }
    }

    #[test]
    fn cells_have_separate_random_streams() {
        let first = |seed, cell| CellDirections::new(seed, cell).next().unwrap();
        assert_eq!(first(1, 2), first(1, 2));
        assert_ne!(first(1, 2), first(1, 3));
        assert_ne!(first(1, 2), first(2, 2));
        // Frozen: the bytes of Monte Carlo grids depend on these values.
        let frozen = [
            0.757_536_321_907_690_7,
            -0.123_474_742_838_644_86,
            0.641_009_133_220_033_2,
        ];
        assert_eq!(first(0, 0), frozen);
    }
}
