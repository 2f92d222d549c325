//! Pseudo-random numbers for tests.

/// A linear congruential generator with the constants of Numerical Recipes: the same numbers on
/// every machine.
#[derive(Clone, Debug)]
pub struct Random {
    state: u32,
}

impl Random {
    /// Starts a sequence.
    pub fn new(seed: u32) -> Self {
        Self { state: seed }
    }

    /// Returns the next number in −1..1, of 24 bits.
    pub fn signed(&mut self) -> f32 {
        self.state = self
            .state
            .wrapping_mul(1_664_525)
            .wrapping_add(1_013_904_223);
        (self.state >> 8) as f32 / (1 << 23) as f32 - 1.0
    }
}
