//! The errors of a bake on the GPU.

use aogrid_bake_core::PlanError;

/// An error of a bake on the GPU. After any of these except a refused plan and cancellation, the
/// caller may bake on the CPU instead.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The bake was refused before it began, for a reason that does not depend on the device.
    #[error(transparent)]
    Plan(PlanError),
    /// The observer cancelled the bake.
    #[error("the bake was cancelled")]
    Cancelled,
    /// A buffer would exceed the device's limit on storage buffer bindings.
    #[error(
        "{what} take {bytes} bytes, and this GPU binds at most {limit} bytes to a shader: bake on \
         the CPU"
    )]
    TooLarge {
        /// A plural noun phrase for the data.
        what: &'static str,
        /// The size of the data in bytes.
        bytes: u64,
        /// The device's limit in bytes.
        limit: u64,
    },
    /// The device has less memory than the bake needs.
    #[error("the GPU is out of memory: bake on the CPU")]
    OutOfMemory,
    /// The device was reset, unplugged or destroyed.
    #[error("the GPU was lost: {0}")]
    Lost(String),
    /// A submission that should take milliseconds did not finish; holds the seconds waited.
    #[error("the GPU did not respond for {0} seconds")]
    Hung(u64),
    /// The driver rejected a call that should be valid.
    #[error("the GPU rejected a call: {0}")]
    Refused(String),
}

impl From<PlanError> for BakeError {
    fn from(error: PlanError) -> Self {
        match error {
            PlanError::Cancelled => Self::Cancelled,
            refused => Self::Plan(refused),
        }
    }
}
