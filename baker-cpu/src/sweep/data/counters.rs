//! Layer counters: differences, along a row of cells, of the number of surface layers ahead.

use std::ops::Range;

use aogrid_bake_core::sweep::{AxisFrame, LANES};

/// The sides of a row: above and below.
pub(in crate::sweep) const SIDES: usize = 2;

/// The counters of one column: [`SIDES`] × [`LANES`], contiguous.
pub(in crate::sweep) const COLUMN: usize = SIDES * LANES;

/// The target size of a group, in one-byte counters: small enough to stay in the L1 cache.
const GROUP_COUNTERS: usize = 1 << 15;

/// The maximum number of counters in a group: those of the longest row. A delta addresses its
/// counter with 16 bits.
pub(in crate::sweep) const MAX_GROUP_COUNTERS: usize = 1 << 16;

/// The maximum number of groups in a tile; each has its own delta buffer.
const MAX_TILE_GROUPS: usize = 128;

/// The maximum number of k values in a tile: the rank of a level is found among as many fractions.
pub(in crate::sweep) const MAX_TILE_DEPTH: u32 = 32;

/// A block of rows of cells: all (j, k) of two ranges, each row with all its cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::sweep) struct Tile {
    pub j: Range<u32>,
    pub k: Range<u32>,
}

impl Tile {
    /// Returns tiles that cover every row of the grid once.
    pub(in crate::sweep) fn all(frame: &AxisFrame) -> Vec<Self> {
        let [_, n_v, n_w] = frame.cells;
        let layout = Layout::new(frame);
        let max_rows = ((MAX_TILE_GROUPS << layout.shift) as u32 / layout.blocks).max(1);
        // Whole layers of rows first; if not even one fits, part of a layer.
        let layers = (max_rows / n_v).clamp(1, MAX_TILE_DEPTH.min(n_w));
        let width = max_rows.clamp(1, n_v);
        let ranges = |n: u32, step: u32| {
            let starts = (0..n).step_by(step as usize);
            starts.map(move |start| start..(start + step).min(n))
        };
        ranges(n_w, layers)
            .flat_map(|k| ranges(n_v, width).map(move |j| Self { j, k: k.clone() }))
            .collect()
    }

    pub(in crate::sweep) fn rows(&self) -> usize {
        self.j.len() * self.k.len()
    }

    /// Returns the row's index in the tile, or `None` if the row is outside.
    #[inline(always)]
    pub(in crate::sweep) fn row(&self, j: u32, k: u32) -> Option<u32> {
        let (j, k) = (j.wrapping_sub(self.j.start), k.wrapping_sub(self.k.start));
        let inside = j < self.j.len() as u32 && k < self.k.len() as u32;
        inside.then(|| k * self.j.len() as u32 + j)
    }
}

/// The memory layout of the counters. A *strip* has the counters of one row and one block of
/// directions, column by column. 2^shift strips form a *group*; one group is counted at a time.
#[derive(Clone, Copy, Debug)]
pub(in crate::sweep) struct Layout {
    pub n_u: u32,
    pub blocks: u32,
    pub shift: u32,
}

impl Layout {
    pub(in crate::sweep) fn new(frame: &AxisFrame) -> Self {
        let n_u = frame.cells[0];
        let strips = (GROUP_COUNTERS / (n_u as usize * COLUMN)).max(1);
        Self {
            n_u,
            blocks: frame.blocks() as u32,
            shift: strips.ilog2(),
        }
    }

    /// Returns the number of counters in a strip.
    pub(in crate::sweep) fn strip(self) -> usize {
        self.n_u as usize * COLUMN
    }

    /// Returns the number of counters in a group.
    pub(in crate::sweep) fn group(self) -> usize {
        self.strip() << self.shift
    }

    pub(in crate::sweep) fn groups(self, tile: &Tile) -> usize {
        self.strips(tile).div_ceil(1 << self.shift)
    }

    pub(in crate::sweep) fn strips(self, tile: &Tile) -> usize {
        tile.rows() * self.blocks as usize
    }

    /// Returns the group of a row's block, and the slot of its first counter in the group.
    #[inline(always)]
    pub(in crate::sweep) fn first_slot(self, row: u32, block: u32) -> (usize, u32) {
        let strip = row * self.blocks + block;
        let within = strip & ((1 << self.shift) - 1);
        let first = within * self.n_u * COLUMN as u32;
        ((strip >> self.shift) as usize, first)
    }
}

/// An integer type that counts layers.
pub(in crate::sweep) trait Counter: Copy + Default + Eq + Into<i32> {
    /// Adds `delta`; returns whether the result overflowed.
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
    /// Adds without overflow: each edge adds two at most, and a mesh that fits in memory has
    /// fewer than 2³⁰ edges.
    #[inline(always)]
    fn add(&mut self, delta: i8) -> bool {
        *self += i32::from(delta);
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(n: [u32; 3], size: u32) -> AxisFrame {
        AxisFrame {
            axes: [0, 1, 2],
            first: [0; 3],
            cells: n,
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
            ([8, 2048, 9], 128),
        ] {
            let frame = frame(n, size);
            let tiles = Tile::all(&frame);
            let mut seen = vec![0; (n[1] * n[2]) as usize];
            for tile in &tiles {
                assert!(tile.k.len() <= 32);
                assert!(Layout::new(&frame).groups(tile) <= MAX_TILE_GROUPS);
                for k in tile.k.clone() {
                    for j in tile.j.clone() {
                        seen[(k * n[1] + j) as usize] += 1;
                        let row = tile.row(j, k);
                        assert!(row.is_some_and(|row| row < tile.rows() as u32));
                    }
                }
                assert_eq!(tile.row(tile.j.end, tile.k.start), None);
            }
            assert!(seen.iter().all(|n| *n == 1), "{n:?}");
        }
    }

    #[test]
    fn counters_of_a_group_have_distinct_slots() {
        for (n, size) in [([32; 3], 16), ([8, 9, 10], 72), ([2048, 2, 2], 40)] {
            let layout = Layout::new(&frame(n, size));
            assert!(layout.group() <= MAX_GROUP_COUNTERS, "{n:?}");
            let mut slots = Vec::new();
            for row in 0..n[1] * n[2] {
                slots.extend((0..layout.blocks).map(|block| layout.first_slot(row, block)));
            }
            let strips = 1 << layout.shift;
            for (strip, (group, first)) in slots.into_iter().enumerate() {
                assert_eq!(group, strip / strips);
                assert_eq!(first as usize, strip % strips * layout.strip());
            }
        }
    }
}
