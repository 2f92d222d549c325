//! Which cells of a grid lie inside its model: what the bake found, found again.

use aogrid_bake_core::post::Classification;
use aogrid_bake_core::{BakeOptions, TriangleMesh};
use aogrid_baker_cpu::Baker;
use aogrid_grid_format::Grid;

use crate::console::Console;
use crate::interrupt;

/// Classifies the cells of `grid` by baking `mesh` once more, as its metadata says. A file holds
/// how many cells are inside, but not which.
pub(super) fn classify(
    grid: &Grid,
    mesh: &TriangleMesh,
    console: &Console,
) -> anyhow::Result<Classification> {
    interrupt::listen();
    let record = grid.record();
    let options = BakeOptions {
        method: record.method,
        max_distance: record.max_distance,
        sample_offset: record.sample_offset,
        interior: record.interior,
        boundary: record.boundary.requested,
        encoding: grid.encoding(),
        format: grid.format(),
    };
    let bar = console.progress("inside");
    let raw = Baker::new(None)
        .prepare(mesh, *grid.spec(), &options)?
        .bake(&|progress| bar.observe(progress))?;
    Ok(Classification::of(&raw))
}
