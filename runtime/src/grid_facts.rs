//! The facts of a grid that an occluder's shader data depend on.

use aogrid_grid_format::{Encoding, Grid, GridSpec, TexelFormat};

/// The facts of a grid besides its texels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GridFacts {
    pub(crate) spec: GridSpec,
    pub(crate) encoding: Encoding,
    pub(crate) format: TexelFormat,
    /// The largest a of the outer cells, which the far field continues.
    pub(crate) border_fraction: f32,
    /// The distance along its normal, in cells, at which a receiver on the object itself looks up
    /// the grid.
    pub(crate) self_offset: f32,
}

impl GridFacts {
    pub(crate) fn of(grid: &Grid) -> Self {
        Self {
            spec: *grid.spec(),
            encoding: grid.encoding(),
            format: grid.format(),
            border_fraction: grid.border_fraction(),
            self_offset: grid.record().self_offset,
        }
    }
}
