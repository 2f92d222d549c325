//! The model that a grid was baked from, and the classes of the grid's cells.

use std::sync::Arc;

use aogrid_bake_core::{BakeOptions, Classification, TriangleMesh};
use aogrid_baker_cpu::Baker;
use aogrid_grid_format::Grid;

use crate::console::Console;
use crate::interrupt;

/// The model that a grid was baked from, and the class of each cell.
pub(crate) struct BakedModel {
    pub(crate) mesh: Arc<TriangleMesh>,
    pub(crate) cells: Classification,
}

impl BakedModel {
    /// Bakes `mesh` again with the recorded options, since a file holds only the numbers of interior
    /// and doubtful cells.
    pub(crate) fn new(
        grid: &Grid,
        mesh: Arc<TriangleMesh>,
        console: &Console,
    ) -> anyhow::Result<Self> {
        interrupt::listen();
        let record = grid.record();
        let options = BakeOptions {
            sampling: record.sampling,
            max_distance: record.max_distance,
            sample_offset: record.sample_offset,
            interior: record.interior,
            boundary: record.boundary.requested,
            encoding: grid.encoding(),
            format: grid.format(),
            fit: record.fit,
            self_offset: Some(record.self_offset),
        };
        let bar = console.progress("inside");
        let raw = Baker::new(None)
            .prepare(&mesh, *grid.spec(), &options)?
            .bake(&|progress| bar.observe(progress))?;
        Ok(Self {
            cells: Classification::of(&raw),
            mesh,
        })
    }
}
