//! Quasi-random points of the unit cube.

/// The sequence R of Roberts (*The Unreasonable Effectiveness of Quasirandom Sequences*, 2018) in
/// `N` dimensions, from a start that depends on a seed.
pub(super) struct Quasi<const N: usize> {
    start: [f64; N],
    steps: [f64; N],
}

impl<const N: usize> Quasi<N> {
    pub(super) fn new(seed: u64) -> Self {
        // The steps are powers of 1/x, where x is the root above 1 of x^(N + 1) = x + 1. The
        // iteration contracts by 1/(N + 1) and ends after some thirty steps.
        let mut root = 1.5_f64;
        for _ in 0..64 {
            root = (1.0 + root).powf(1.0 / (N as f64 + 1.0));
        }
        let steps = std::array::from_fn(|x| root.powi(-(x as i32 + 1)));
        let start = std::array::from_fn(|x| unit(seed.wrapping_add((x as u64 + 1) << 32)));
        Self { start, steps }
    }

    /// Returns point `idx`, each coordinate in 0..1.
    pub(super) fn point(&self, idx: usize) -> [f64; N] {
        std::array::from_fn(|x| (self.start[x] + self.steps[x] * idx as f64).fract())
    }
}

/// Returns a number in 0..1 by the finalizer of SplitMix64.
fn unit(seed: u64) -> f64 {
    let mut bits = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((bits ^ (bits >> 31)) >> 11) as f64 / 2.0_f64.powi(53)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_even() {
        const BINS: usize = 64;
        let (quasi, n) = (Quasi::<3>::new(7), 4096);
        for axis in 0..3 {
            let mut counts = [0_i32; BINS];
            for idx in 0..n {
                counts[(BINS as f64 * quasi.point(idx)[axis]) as usize] += 1;
            }
            // Random points would deviate by up to some 20, their standard deviation being 8.
            let even = (n / BINS) as i32;
            assert!(counts.iter().all(|c| (c - even).abs() <= 4), "{counts:?}");
        }
        assert_ne!(Quasi::<3>::new(8).point(0), quasi.point(0));
    }
}
