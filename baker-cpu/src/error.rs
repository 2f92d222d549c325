//! The errors of a bake on the CPU.

use aogrid_bake_core::{PipelineError, PlanError};

/// The reason that a bake failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The bake was refused before it began.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The grid cannot be placed, or its moments cannot become a grid.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
    /// The observer cancelled the bake.
    #[error("the bake was cancelled")]
    Cancelled,
}
