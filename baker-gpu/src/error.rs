//! Why a bake on the GPU gave nothing.

use aogrid_bake_core::{OptionsError, WhyRays};

/// Whoever can bake on the CPU instead may do so after any of these
/// but a wrong option and cancellation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// An option out of its range.
    #[error(transparent)]
    Options(#[from] OptionsError),
    /// The observer broke it off.
    #[error("the bake was cancelled")]
    Cancelled,
    /// The sweep was asked for, and only rays can do it.
    #[error("the sweep cannot bake this: {0}")]
    NoSweep(WhyRays),
    /// One piece of data is larger than the device lets a shader see.
    #[error("{what} take {bytes} bytes, and a shader of this GPU sees {limit}: bake on the CPU")]
    TooLarge {
        /// What it is.
        what: &'static str,
        /// Its size.
        bytes: u64,
        /// The device's limit.
        limit: u64,
    },
    /// The device has less memory than the bake needs.
    #[error("the GPU is out of memory: bake on the CPU")]
    OutOfMemory,
    /// The device was reset, unplugged or destroyed.
    #[error("the GPU was lost: {0}")]
    Lost(String),
    /// A dispatch that should take milliseconds did not end.
    #[error("the GPU did not answer for {0} seconds")]
    Hung(u64),
    /// The driver refused what should be valid.
    #[error("the GPU refused: {0}")]
    Refused(String),
}
