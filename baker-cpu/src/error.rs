//! The errors of a bake on the CPU.

use aogrid_bake_core::surface::SurfaceOptionsError;
use aogrid_bake_core::{PipelineError, PlanError};

/// The reason that a bake failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The bake was refused before it began.
    #[error(transparent)]
    Plan(PlanError),
    /// The grid cannot be placed, or its moments cannot become a grid.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
    /// The options of a surface bake are invalid.
    #[error(transparent)]
    SurfaceOptions(#[from] SurfaceOptionsError),
    /// The z-buffer is asked for directions that differ from point to point.
    #[error("the z-buffer needs directions that all points share: choose them, or rays")]
    NotShared,
    /// The observer cancelled the bake.
    #[error("the bake was cancelled")]
    Cancelled,
}

impl From<PlanError> for BakeError {
    fn from(error: PlanError) -> Self {
        match error {
            PlanError::Cancelled => Self::Cancelled,
            refused => Self::Plan(refused),
        }
    }
}
