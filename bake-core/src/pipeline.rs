//! The whole bake of a grid: placement, visibility, and post-processing.

use aogrid_grid_format::{Grid, GridSpec, Source, SpecError};

use crate::far_field;
use crate::fit::{self, NearSurface};
use crate::post::{self, PostError, Refinements};
use crate::{BakeOptions, OptionsError, Placement, PlacementError, RawGrid, TriangleMesh};

/// The version of what a bake computes, with what its readers make of a file. Whatever gives other
/// bytes for the same files and options raises it, so that no cache keeps what an earlier version made.
/// A test pins the bytes of one bake to it (`tests/tests/suite/determinism.rs`).
pub const ALGORITHM_VERSION: u32 = 1;

/// The reason that a grid cannot be baked, besides those of the baker.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PipelineError {
    /// An option is out of range.
    #[error(transparent)]
    Options(#[from] OptionsError),
    /// The grid cannot be placed.
    #[error(transparent)]
    Placement(#[from] PlacementError),
    /// The lattice of the near-surface fit is too large.
    #[error("the near-surface fit's lattice is invalid: lower the resolution, or bake without it")]
    Lattice(#[source] SpecError),
    /// The points of the far field lie too far away.
    #[error("the far field reaches beyond the range of single floats: scale the model down")]
    FarField(#[source] SpecError),
    /// The moments cannot become a grid.
    #[error(transparent)]
    Post(#[from] PostError),
}

/// Bakes the grid of `mesh` at `placement` with `options`, for the record of `source`.
///
/// `visibility` bakes the moments of a grid's cells, by any baker. It is called once, and with the
/// options that need it for a finer lattice around the object (the near-surface fit) and for a coarse
/// one around the box (the far field).
///
/// # Errors
///
/// An option is out of range, the mesh cannot be placed or its moments cannot become a grid, or
/// `visibility` failed.
pub fn bake_grid<E: From<PipelineError>>(
    mesh: &TriangleMesh,
    placement: &Placement,
    options: &BakeOptions,
    source: Source,
    visibility: impl FnMut(GridSpec, &BakeOptions) -> Result<RawGrid, E>,
) -> Result<Grid, E> {
    let spec = placement
        .place(&mesh.bounds())
        .map_err(PipelineError::from)?;
    bake_grid_at(spec, mesh, placement, options, source, visibility)
}

/// Bakes a grid like [`bake_grid`], but with the box of `spec`; `placement` is only recorded.
///
/// # Errors
///
/// The same as those of [`bake_grid`].
pub fn bake_grid_at<E: From<PipelineError>>(
    spec: GridSpec,
    mesh: &TriangleMesh,
    placement: &Placement,
    options: &BakeOptions,
    source: Source,
    mut visibility: impl FnMut(GridSpec, &BakeOptions) -> Result<RawGrid, E>,
) -> Result<Grid, E> {
    options.validate().map_err(PipelineError::from)?;
    let raw = visibility(spec, options)?;
    let mut refinements = Refinements::default();
    if options.fit {
        let lattice = near_surface_lattice(&spec, mesh)?;
        let points = visibility(lattice, &fit::point_options(options))?;
        refinements.near = Some(NearSurface { mesh, points });
    }
    if far_field::has_far_field(options) {
        let lattice = far_field::lattice(&spec).map_err(PipelineError::FarField)?;
        let points = visibility(lattice, &far_field::point_options(options))?;
        refinements.flatness = far_field::flatness(&raw, &points);
    }
    let grid = post::finish(raw, &refinements, placement, options, source);
    Ok(grid.map_err(PipelineError::from)?)
}

/// Returns the finer lattice around `mesh` whose points the near-surface fit of the grid `spec`
/// bakes, as a grid.
///
/// # Errors
///
/// The lattice has more points than a grid may have cells.
pub fn near_surface_lattice(
    spec: &GridSpec,
    mesh: &TriangleMesh,
) -> Result<GridSpec, PipelineError> {
    fit::lattice(spec, &mesh.bounds()).map_err(PipelineError::Lattice)
}
