//! Classification of a grid's cells as interior or doubtful, by repeating the bake.

use aogrid_bake_core::Classification;
use aogrid_bake_core::{BakeOptions, TriangleMesh};
use aogrid_baker_cpu::Baker;
use aogrid_grid_format::Grid;

use crate::console::Console;
use crate::interrupt;

/// Classifies the cells of `grid` by baking `mesh` again with the recorded options, since a file
/// holds only the number of interior cells.
pub(super) fn classify(
    grid: &Grid,
    mesh: &TriangleMesh,
    console: &Console,
) -> anyhow::Result<Classification> {
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
        .prepare(mesh, *grid.spec(), &options)?
        .bake(&|progress| bar.observe(progress))?;
    Ok(Classification::of(&raw))
}
