//! The division of a grid into work that fits the device's buffers: into bricks of cells, and for
//! each brick and axis into passes over some rows and blocks of texels.

use aogrid_bake_core::sweep::{self, AxisFrame, texel_idx};
use aogrid_grid_format::GridSpec;

use super::gpu_data::{MAX_BATCHES, MAX_ROWS, TABLE_LEN};

/// The number of directions of a block, as shaders count.
pub(super) const LANES: u32 = sweep::LANES as u32;

/// The largest number of cells of a brick along an axis. 16 bits then hold every sum of a row's
/// bytes, and a table has an entry for each k of every row of texels.
const MAX_BRICK_SIDE: u32 = 256;
const _: () =
    assert!(MAX_BRICK_SIDE * 127 < 1 << 15 && MAX_BRICK_SIDE * MAX_ROWS <= TABLE_LEN as u32);

/// The largest number of cells of a brick. One batch of wide counters then takes 128 MiB, which
/// every device offers.
const MAX_BRICK_CELLS: u32 = 1 << 20;

/// The number of directions of a batch, those of −d included.
const BATCH_DIRECTIONS: u32 = 2 * LANES;

/// A box of cells that are baked together, like a grid of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Brick {
    /// The brick's first cell in the grid.
    pub first: [u32; 3],
    pub cells: [u32; 3],
}

impl Brick {
    /// Divides a grid into bricks; most grids are a single brick.
    pub(super) fn all(spec: &GridSpec) -> Vec<Self> {
        let n = spec.resolution();
        let mut parts = n.map(|n| n.div_ceil(MAX_BRICK_SIDE));
        let size =
            |parts: [u32; 3]| -> [u32; 3] { std::array::from_fn(|x| n[x].div_ceil(parts[x])) };
        // Split the longest side until the bricks are small enough.
        while size(parts).iter().product::<u32>() > MAX_BRICK_CELLS {
            let longest = (0..3).max_by_key(|&x| size(parts)[x]).unwrap_or(0);
            parts[longest] += 1;
        }
        let size = size(parts);
        let starts = |x: usize| (0..n[x]).step_by(size[x] as usize);
        let mut bricks = Vec::new();
        for z in starts(2) {
            for y in starts(1) {
                for x in starts(0) {
                    let first = [x, y, z];
                    let cells = std::array::from_fn(|x| size[x].min(n[x] - first[x]));
                    bricks.push(Self { first, cells });
                }
            }
        }
        bricks
    }

    /// Returns the frame of the brick along the axis `w`.
    pub(super) fn frame(&self, spec: &GridSpec, w: usize, size: u32) -> AxisFrame {
        AxisFrame::of_box(spec, self.first, self.cells, w, size)
    }

    pub(super) fn cell_count(&self) -> u32 {
        self.cells.iter().product()
    }
}

/// Some rows and blocks of texels of the faces across one axis, for one brick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pass {
    /// The axis.
    pub w: usize,
    pub first_row: u32,
    pub n_rows: u32,
    pub first_block: u32,
    pub n_blocks: u32,
}

/// The limits and sizes that determine how large a pass may be.
#[derive(Clone, Copy, Debug)]
pub(super) struct MemoryBudget {
    /// The largest number of bytes of a buffer binding.
    pub binding: u64,
    /// The size of a counter in bytes.
    pub counter: u64,
    pub n_vertices: u64,
    pub n_triangles: u64,
}

impl Pass {
    /// Returns all passes over faces of `size`² texels, for one brick.
    pub(super) fn all(brick: &Brick, size: u32, budget: &MemoryBudget) -> Vec<Self> {
        let blocks = size.div_ceil(LANES);
        let batch_bytes = u64::from(brick.cell_count() * BATCH_DIRECTIONS) * budget.counter;
        let batches = (budget.binding / batch_bytes).clamp(1, u64::from(MAX_BATCHES)) as u32;
        let n_blocks = blocks.min(batches);
        // The rows that fit the ranks (four bytes per vertex and row) and the facing intervals
        // (four bytes per triangle and four rows).
        let rows_for_mesh =
            (budget.binding / (4 * budget.n_vertices.max(budget.n_triangles / 4).max(1))).max(1);
        let n_rows = (batches / n_blocks).min(MAX_ROWS).min(size);
        let n_rows = u64::from(n_rows).min(rows_for_mesh) as u32;
        let mut passes = Vec::new();
        for w in 0..3 {
            for first_row in (0..size).step_by(n_rows as usize) {
                for first_block in (0..blocks).step_by(n_blocks as usize) {
                    passes.push(Self {
                        w,
                        first_row,
                        n_rows: n_rows.min(size - first_row),
                        first_block,
                        n_blocks: n_blocks.min(blocks - first_block),
                    });
                }
            }
        }
        passes
    }

    pub(super) fn n_batches(&self) -> u32 {
        self.n_rows * self.n_blocks
    }

    /// Returns the index of the texel of a bit of a batch's mask, or `None` for a lane beyond the
    /// side of the face.
    pub(super) fn texel_idx(&self, size: u32, batch: u32, bit: u32) -> Option<usize> {
        let b = self.first_row + batch / self.n_blocks;
        let block = self.first_block + batch % self.n_blocks;
        texel_idx(size, self.w, b, block as usize, bit as usize)
    }
}

/// Returns the size in bytes of the counters of this many batches of a brick.
pub(super) fn counter_bytes(brick: &Brick, batches: u32, counter: u64) -> u64 {
    u64::from(brick.cell_count()) * u64::from(batches * BATCH_DIRECTIONS) * counter
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(resolution: [u32; 3]) -> GridSpec {
        GridSpec::new(resolution, [0.0; 3], [1.0; 3]).unwrap()
    }

    #[test]
    fn bricks_cover_every_cell_once_and_fit() {
        for resolution in [
            [32; 3],
            [8, 9, 10],
            [128, 24, 40],
            [257, 64, 65],
            [2048, 8, 8],
        ] {
            let spec = spec(resolution);
            let mut seen = vec![0; spec.cell_count()];
            for brick in Brick::all(&spec) {
                assert!(brick.cell_count() <= MAX_BRICK_CELLS);
                assert!(brick.cells.iter().all(|n| *n <= MAX_BRICK_SIDE));
                let [x, y, z]: [_; 3] =
                    std::array::from_fn(|x| brick.first[x]..brick.first[x] + brick.cells[x]);
                for k in z {
                    for j in y.clone() {
                        x.clone().for_each(|i| seen[spec.cell_idx([i, j, k])] += 1);
                    }
                }
            }
            assert!(seen.iter().all(|n| *n == 1), "{resolution:?}");
        }
        assert_eq!(Brick::all(&spec([64; 3])).len(), 1);
        assert_eq!(Brick::all(&spec([512; 3])).len(), 150);
    }

    #[test]
    fn passes_cover_every_batch_once_and_fit_the_smallest_device() {
        let binding = u64::from(1_u32 << 27);
        for (resolution, size, counter) in [
            ([32; 3], 16_u32, 1),
            ([100; 3], 128, 1),
            ([100; 3], 128, 4),
            ([101, 102, 100], 128, 4),
            ([8; 3], 9, 1),
        ] {
            let brick = Brick::all(&spec(resolution))[0];
            for (n_vertices, n_triangles) in [(10, 20), (6_000_000, 12_000_000)] {
                let budget = MemoryBudget {
                    binding,
                    counter,
                    n_vertices,
                    n_triangles,
                };
                let mut seen = vec![0; (3 * size * size.div_ceil(LANES)) as usize];
                for pass in Pass::all(&brick, size, &budget) {
                    assert!(counter_bytes(&brick, pass.n_batches(), counter) <= binding);
                    assert!(pass.n_batches() <= MAX_BATCHES);
                    assert!(u64::from(pass.n_rows) * n_vertices * 4 <= binding);
                    let words = u64::from(pass.n_rows.div_ceil(4));
                    assert!(words * n_triangles * 4 <= binding);
                    for row in pass.first_row..pass.first_row + pass.n_rows {
                        for block in pass.first_block..pass.first_block + pass.n_blocks {
                            let row = pass.w as u32 * size + row;
                            seen[(row * size.div_ceil(LANES) + block) as usize] += 1;
                        }
                    }
                }
                assert!(seen.iter().all(|n| *n == 1), "{resolution:?} {size}");
            }
        }
    }
}
