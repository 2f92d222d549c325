//! The same code for wider registers.
//!
//! There is one source for all machines: loops over sixteen directions, which a compiler turns
//! into one instruction each if it may assume that the machine has it. Here a piece of work is
//! compiled once for each set of instructions, and the best that the machine has is chosen at
//! run time. No operation is left to the compiler's taste (Rust neither fuses nor reorders
//! floats), so that all give the same bits; a test compares them.

/// A set of instructions that this machine has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Instructions(Set);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Set {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// What is compiled for each set. Implementations and all that they call in their inner loops
/// are marked `inline(always)`: what is not inlined is not compiled again.
pub(super) trait Work {
    type Output;
    fn run(self) -> Self::Output;
}

impl Instructions {
    /// All that this machine has, the best first; the portable ones are always there.
    pub(super) fn available() -> Vec<Self> {
        let mut sets = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl")
            {
                sets.push(Self(Set::Avx512));
            }
            if is_x86_feature_detected!("avx2") {
                sets.push(Self(Set::Avx2));
            }
        }
        sets.push(Self(Set::Portable));
        sets
    }

    /// Runs `work`, compiled for this set.
    #[allow(
        unsafe_code,
        reason = "only the caller of a function for certain instructions knows that they exist"
    )]
    pub(super) fn run<W: Work>(self, work: W) -> W::Output {
        match self.0 {
            Set::Portable => work.run(),
            // SAFETY: `available` is the only maker of this value, and has asked the machine
            // for the features of `avx2`.
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => unsafe { avx2(work) },
            // SAFETY: likewise for the features of `avx512`.
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => unsafe { avx512(work) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2<W: Work>(work: W) -> W::Output {
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn avx512<W: Work>(work: W) -> W::Output {
    work.run()
}
