//! How many layers of surface lie ahead: counters that are differences along a row of cells.

use std::ops::Range;

use super::frame::{Frame, LANES};

/// Above and below the row.
pub(super) const SIDES: usize = 2;

/// The counters of one column: [`SIDES`] × [`LANES`] next to each other.
pub(super) const COLUMN: usize = SIDES * LANES;

/// Counters of a group, as bytes: small enough to stay in a core's first cache.
const GROUP: usize = 1 << 15;

/// The most counters of a group: those of the longest row. A step names one in 16 bits.
pub(super) const MOST_PLACES: usize = 1 << 16;

/// The most groups of a tile, each of which has a buffer of steps.
const MOST_GROUPS: usize = 128;

/// The most values of k in a tile: ranks of levels are found among so many.
pub(super) const MOST_LAYERS: u32 = 32;

/// Some rows of cells: all (j, k) of two ranges, each with all its cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Tile {
    pub j: Range<u32>,
    pub k: Range<u32>,
}

impl Tile {
    /// Divides the rows of a grid.
    pub(super) fn all(frame: &Frame) -> Vec<Self> {
        let [_, n_v, n_w] = frame.n;
        let layout = Layout::new(frame);
        let most_rows = ((MOST_GROUPS << layout.shift) as u32 / layout.blocks).max(1);
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
    pub(super) fn row(&self, j: u32, k: u32) -> Option<u32> {
        let (j, k) = (j.wrapping_sub(self.j.start), k.wrapping_sub(self.k.start));
        let inside = j < self.j.len() as u32 && k < self.k.len() as u32;
        inside.then(|| k * self.j.len() as u32 + j)
    }
}

/// Where a counter is. A *strip* has the counters of one row and one block of directions,
/// column by column. 2^shift strips are a *group*, of which one at a time is counted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub n_u: u32,
    pub blocks: u32,
    pub shift: u32,
}

impl Layout {
    pub(super) fn new(frame: &Frame) -> Self {
        let n_u = frame.n[0];
        let strips = (GROUP / (n_u as usize * COLUMN)).max(1);
        Self {
            n_u,
            blocks: frame.blocks() as u32,
            shift: strips.ilog2(),
        }
    }

    /// Counters of a strip.
    pub(super) fn strip(self) -> usize {
        self.n_u as usize * COLUMN
    }

    /// Counters of a group.
    pub(super) fn group(self) -> usize {
        self.strip() << self.shift
    }

    pub(super) fn groups(self, tile: &Tile) -> usize {
        self.strips(tile).div_ceil(1 << self.shift)
    }

    pub(super) fn strips(self, tile: &Tile) -> usize {
        tile.rows() * self.blocks as usize
    }

    /// The group of a row's block, and the first of its places there.
    #[inline(always)]
    pub(super) fn place(self, row: u32, block: u32) -> (usize, u32) {
        let strip = row * self.blocks + block;
        let within = strip & ((1 << self.shift) - 1);
        let first = within * self.n_u * COLUMN as u32;
        ((strip >> self.shift) as usize, first)
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
            ([8, 2048, 9], 128),
        ] {
            let frame = frame(n, size);
            let tiles = Tile::all(&frame);
            let mut seen = vec![0; (n[1] * n[2]) as usize];
            for tile in &tiles {
                assert!(tile.k.len() <= 32);
                assert!(Layout::new(&frame).groups(tile) <= MOST_GROUPS);
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
    fn every_counter_of_a_group_has_a_place_of_its_own() {
        for (n, size) in [([32; 3], 16), ([8, 9, 10], 72), ([2048, 2, 2], 40)] {
            let layout = Layout::new(&frame(n, size));
            assert!(layout.group() <= MOST_PLACES, "{n:?}");
            let mut places = Vec::new();
            for row in 0..n[1] * n[2] {
                places.extend((0..layout.blocks).map(|block| layout.place(row, block)));
            }
            let strips = 1 << layout.shift;
            for (strip, (group, first)) in places.into_iter().enumerate() {
                assert_eq!(group, strip / strips);
                assert_eq!(first as usize, strip % strips * layout.strip());
            }
        }
    }
}
