//! How many layers of surface lie ahead: counters that are differences along a row of cells.

use std::ops::Range;

use super::frame::{Frame, LANES};

/// Counters of one tile, small enough to stay in a core's own cache: what 32³ cells with
/// faces of 16² need.
const TILE_BYTES: usize = 3 << 19;

/// A tile may be larger where the mesh is: ranking its vertices once a tile must not take
/// longer than counting in it.
const TILE_BYTES_PER_VERTEX: usize = 64;
const MOST_TILE_BYTES: usize = 1 << 26;

/// The most values of k in a tile: ranks of levels are found among so many.
const MOST_LAYERS: u32 = 32;

/// Above and below the row.
pub(super) const SIDES: usize = 2;

/// The counters of one column: [`SIDES`] × [`LANES`] next to each other.
pub(super) const COLUMN: usize = SIDES * LANES;

/// Some rows of cells: all (j, k) of two ranges, each with all its cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Tile {
    pub j: Range<u32>,
    pub k: Range<u32>,
}

impl Tile {
    /// Divides the rows of a grid.
    pub(super) fn all(frame: &Frame, n_vertices: usize) -> Vec<Self> {
        let [_, n_v, n_w] = frame.n;
        let for_vertices = (TILE_BYTES_PER_VERTEX * n_vertices).min(MOST_TILE_BYTES);
        let bytes = TILE_BYTES.max(for_vertices);
        let most_rows = (bytes / Layout::new(frame).row).max(1) as u32;
        let layers = (most_rows / n_v).clamp(1, MOST_LAYERS.min(n_w));
        let width = most_rows.clamp(1, n_v);
        let ranges = |n: u32, step: u32| {
            let starts = (0..n).step_by(step as usize);
            starts.map(move |start| start..(start + step).min(n))
        };
        ranges(n_w, layers)
            .flat_map(|k| ranges(n_v, width).map(move |j| Self { j, k: k.clone() }))
            .collect()
    }

    pub(super) fn rows(&self) -> usize {
        self.j.len() * self.k.len()
    }

    /// The row's number in the tile; none if it is outside.
    #[inline(always)]
    pub(super) fn row(&self, j: u32, k: u32) -> Option<usize> {
        let (j, k) = (j.wrapping_sub(self.j.start), k.wrapping_sub(self.k.start));
        let inside = j < self.j.len() as u32 && k < self.k.len() as u32;
        inside.then(|| k as usize * self.j.len() + j as usize)
    }
}

/// Where a counter is: rows, in them blocks of directions, in them columns. One more column
/// than there are cells takes what happens to the right of the grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub n_u: usize,
    /// Counters of a row.
    pub row: usize,
    /// Counters of a row's block.
    pub block: usize,
}

impl Layout {
    pub(super) fn new(frame: &Frame) -> Self {
        let n_u = frame.n[0] as usize;
        let block = (n_u + 1) * COLUMN;
        Self {
            n_u,
            row: frame.blocks() * block,
            block,
        }
    }
}

/// What counts layers.
pub(super) trait Counter: Copy + Default + Eq + Into<i32> {
    /// Adds; whether the result did not fit.
    fn add(&mut self, delta: i8) -> bool;
}

impl Counter for i8 {
    #[inline(always)]
    fn add(&mut self, delta: i8) -> bool {
        let (sum, wrapped) = self.overflowing_add(delta);
        *self = sum;
        wrapped
    }
}

impl Counter for i32 {
    /// Two for each edge at most, and there are fewer than 2³⁰ in a mesh that fits a machine.
    #[inline(always)]
    fn add(&mut self, delta: i8) -> bool {
        *self += i32::from(delta);
        false
    }
}

/// The counters of a tile for one batch of directions.
pub(super) struct Counters<'a, C> {
    pub layout: Layout,
    pub tile: &'a Tile,
    /// All zero before and after a batch.
    pub values: &'a mut [C],
    /// Rows with counters that are not zero.
    pub dirty: &'a mut [bool],
    /// Whether a counter was too small for what it counted.
    pub wrapped: bool,
}

impl<C: Counter> Counters<'_, C> {
    /// From `columns` on, as many layers more as `deltas` says, for the lanes of a range. The
    /// column past the last cell is nowhere.
    #[inline(always)]
    pub(super) fn step(
        &mut self,
        row: usize,
        block: usize,
        side: usize,
        lanes: Range<usize>,
        columns: &[u32; LANES],
        deltas: &[u8; LANES],
    ) {
        let start = row * self.layout.row + block * self.layout.block + side * LANES;
        let end = start - side * LANES + self.layout.block;
        let n_u = self.layout.n_u as u32;
        self.dirty[row] = true;
        let values = &mut self.values[start..end];
        let mut wrapped = false;
        for lane in lanes {
            let column = columns[lane];
            let delta = if column < n_u { deltas[lane] } else { 0 }.cast_signed();
            wrapped |= values[column as usize * COLUMN + lane].add(delta);
        }
        self.wrapped |= wrapped;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(n: [u32; 3], size: u32) -> Frame {
        Frame {
            u: 0,
            v: 1,
            w: 2,
            n,
            size,
            shear: [1.0; 2],
        }
    }

    #[test]
    fn tiles_cover_every_row_once() {
        for (n, size) in [
            ([32, 32, 32], 16),
            ([8, 9, 10], 8),
            ([64, 50, 70], 24),
            ([2048, 2048, 8], 128),
        ] {
            let frame = frame(n, size);
            let tiles = Tile::all(&frame, 1000);
            let mut seen = vec![0; (n[1] * n[2]) as usize];
            for tile in &tiles {
                assert!(tile.k.len() <= 32);
                for k in tile.k.clone() {
                    for j in tile.j.clone() {
                        seen[(k * n[1] + j) as usize] += 1;
                        assert!(tile.row(j, k).is_some_and(|row| row < tile.rows()));
                    }
                }
                assert_eq!(tile.row(tile.j.end, tile.k.start), None);
            }
            assert!(seen.iter().all(|n| *n == 1), "{n:?}");
        }
    }
}
