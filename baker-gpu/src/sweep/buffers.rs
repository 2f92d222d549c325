//! The buffers of a brick.

use wgpu::{Buffer, Device};

use super::plan::{Brick, MemoryBudget, Pass, counter_bytes};
use crate::store::BufferPool;

/// The numbers per cell that are read back: the count, a, and the three components of m.
pub(super) const NUMBERS_PER_CELL: u64 = 5;

/// The buffers of a brick.
pub(super) struct Buffers {
    pub counters: Buffer,
    pub overflowed: Buffer,
    pub facing_intervals: Buffer,
    pub ranks: Buffer,
    pub masks: Buffer,
    pub sums: Buffer,
}

impl Buffers {
    /// Returns buffers large enough for each of the passes over a brick.
    pub(super) fn new(
        device: &Device,
        pool: &mut BufferPool,
        brick: &Brick,
        passes: &[Pass],
        budget: &MemoryBudget,
    ) -> Self {
        let batches = passes.iter().map(Pass::n_batches).max().unwrap_or(1);
        let rows = passes.iter().map(|p| p.n_rows).max().unwrap_or(1);
        let cells = u64::from(brick.cell_count());
        let mut storage = |name, bytes: u64| pool.storage(device, name, bytes);
        Self {
            counters: storage("counters", counter_bytes(brick, batches, budget.counter)),
            overflowed: storage("overflowed", 4),
            facing_intervals: storage(
                "facing intervals",
                budget.n_triangles * u64::from(rows.div_ceil(4)) * 4,
            ),
            ranks: storage("ranks", budget.n_vertices * u64::from(rows) * 4),
            masks: storage("masks", cells * u64::from(batches) * 4),
            sums: storage("sums", cells * NUMBERS_PER_CELL * 4),
        }
    }
}
