//! Pseudo-random numbers for the unit tests: a linear congruential generator with the constants of
//! Knuth's MMIX.

/// Returns a generator of 64 bits, of which the high ones are the most random.
pub(crate) fn random_bits(seed: u64) -> impl FnMut() -> u64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        state
    }
}
