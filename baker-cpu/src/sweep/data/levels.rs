//! Levels: the planes of the rows of cells, ordered along a batch's slope.

use aogrid_bake_core::sweep::AxisFrame;

use super::counters::{MAX_TILE_DEPTH, Tile};

/// The maximum number of levels from one whole number to the next: bits 0–4 of a level's number.
pub(in crate::sweep) const FRACTIONS: usize = MAX_TILE_DEPTH as usize;
pub(in crate::sweep) const FRACTION_BITS: u32 = FRACTIONS.ilog2();

/// The rows of a tile, seen along directions of slope b in the (v, w) plane. Row (j, k) lies in the
/// plane V − b·W = j − k·b. Levels are numbered in the order of that value: bits from
/// [`FRACTION_BITS`] up hold its whole part, the bits below hold the rank of its fraction among the
/// fractions of the tile, one for each k. All other numbers are unused.
#[derive(Clone, Debug)]
pub(in crate::sweep) struct Levels {
    /// Cells along v per cell along w.
    pub slope: f32,
    /// The number of fractions: the values of k in the tile.
    pub n: usize,
    /// The fractions of −k·b, in 0..1 and sorted; infinite past the last.
    pub fractions: [f32; FRACTIONS],
    /// The k of each fraction.
    pub k: [f32; FRACTIONS],
    /// The offset from a level's whole part to the row's index in the tile, valid if j is in the
    /// tile.
    pub first_row: [i32; FRACTIONS],
    /// The offset from a level's whole part to j, counted from the tile's first.
    pub first_j: [i32; FRACTIONS],
    /// The number of j values in the tile.
    pub width: u32,
    /// The lowest level number that the tile can have, and one above the highest.
    pub range: [i32; 2],
    /// The number of fractions below each 256th of a cell.
    fractions_before: [u8; BUCKETS],
}

/// A level that an edge crosses.
#[derive(Clone, Copy, Debug)]
pub(in crate::sweep) struct RowLevel {
    /// V − b·W of the row's plane.
    pub value: f32,
    pub k: f32,
    /// The row's index in the tile.
    pub row: u32,
}

const BUCKETS: usize = 256;

/// 1.5 · 2²³: added to a float of magnitude below 2²², it rounds off the fraction.
const ROUNDING_BIAS: f32 = 1.5 * (1 << 23) as f32;

/// Returns ⌊x⌋ for |x| < 2²². On machines without an instruction for it, `f32::floor` would be a
/// library call.
#[inline(always)]
fn floor(x: f32) -> f32 {
    let nearest = (x + ROUNDING_BIAS) - ROUNDING_BIAS;
    if nearest > x { nearest - 1.0 } else { nearest }
}

impl Levels {
    pub(in crate::sweep) fn new(frame: &AxisFrame, tile: &Tile, b: u32) -> Self {
        let slope = frame.row_slope(b) as f32;
        let level = |k: u32| {
            let value = -(k as f32) * slope;
            let whole = floor(value);
            (value - whole, whole as i32, k)
        };
        let mut sorted: Vec<_> = tile.k.clone().map(level).collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let width = tile.j.len() as u32;
        let mut levels = Self {
            slope,
            n: sorted.len(),
            fractions: [f32::INFINITY; FRACTIONS],
            k: [0.0; FRACTIONS],
            first_row: [0; FRACTIONS],
            first_j: [0; FRACTIONS],
            width,
            range: [i32::MAX, i32::MIN],
            fractions_before: [0; BUCKETS],
        };
        for (s, &(fraction, whole, k)) in sorted.iter().enumerate() {
            // Row (j, k) is the level with whole part j + that of −k·b.
            let first_j = -whole - tile.j.start as i32;
            levels.fractions[s] = fraction;
            levels.k[s] = k as f32;
            levels.first_j[s] = first_j;
            levels.first_row[s] = first_j + ((k - tile.k.start) * width) as i32;
            let [low, high] =
                [tile.j.start, tile.j.end].map(|j| (j as i32 + whole) << FRACTION_BITS);
            levels.range = [levels.range[0].min(low), levels.range[1].max(high)];
        }
        // A table of 256 buckets replaces most of the search in `rank`.
        levels.fractions_before = std::array::from_fn(|bucket| {
            let start = bucket as f32 / BUCKETS as f32;
            sorted.partition_point(|level| level.0 < start) as u8
        });
        levels
    }

    /// Returns V − b·W in cells. All code evaluates this one expression, so that results agree.
    #[inline(always)]
    pub(in crate::sweep) fn q(&self, v: f32, w: f32) -> f32 {
        v - self.slope * w
    }

    /// Returns the lowest level number that is not below the vertex at (V, W), in cells. An edge
    /// crosses exactly the levels from the lower rank of its ends up to, and not including, the
    /// higher. The correctness of the sweep rests on this comparison: it is made once for each
    /// vertex.
    #[inline(always)]
    pub(in crate::sweep) fn rank(&self, v: f32, w: f32) -> i32 {
        let q = self.q(v, w);
        let whole = floor(q);
        let fraction = q - whole;
        let mut s = usize::from(
            self.fractions_before[(fraction * BUCKETS as f32) as usize & (BUCKETS - 1)],
        );
        if fraction >= 1.0 {
            // A tiny negative q rounds up to the next whole: above all fractions.
            s = self.n;
        }
        while s < self.n && self.fractions[s] < fraction {
            s += 1;
        }
        self.number(whole as i32, s)
    }

    /// Returns the number of the s-th level from a whole part on; s = n gives the first level of
    /// the next whole part.
    #[inline(always)]
    fn number(&self, whole: i32, s: usize) -> i32 {
        let s = if s == self.n { FRACTIONS } else { s };
        (whole << FRACTION_BITS) + s as i32
    }

    /// Returns the rows between two ranks, in order.
    #[inline(always)]
    pub(in crate::sweep) fn between(&self, low: i32, high: i32) -> Between<'_> {
        Between {
            levels: self,
            next: low.max(self.range[0]),
            end: high.min(self.range[1]),
        }
    }

    /// Returns the level of a row of the tile, and its number.
    pub(in crate::sweep) fn level_of_row(&self, row: u32) -> (RowLevel, i32) {
        let j_in_tile = |s: &usize| (row as i32 - self.first_row[*s] + self.first_j[*s]) as u32;
        let s = (0..self.n).find(|s| j_in_tile(s) < self.width);
        let s = s.expect("the tile contains the row");
        let whole = row as i32 - self.first_row[s];
        let value = whole as f32 + self.fractions[s];
        let (k, number) = (self.k[s], self.number(whole, s));
        (RowLevel { value, k, row }, number)
    }
}

/// The iterator of [`Levels::between`].
pub(in crate::sweep) struct Between<'a> {
    levels: &'a Levels,
    next: i32,
    end: i32,
}

impl Iterator for Between<'_> {
    type Item = RowLevel;

    #[inline(always)]
    fn next(&mut self) -> Option<RowLevel> {
        let levels = self.levels;
        while self.next < self.end {
            let (whole, s) = (self.next >> FRACTION_BITS, self.next as usize % FRACTIONS);
            self.next = levels.number(whole, s + 1);
            let j = (whole + levels.first_j[s]) as u32;
            if j < levels.width {
                return Some(RowLevel {
                    value: whole as f32 + levels.fractions[s],
                    k: levels.k[s],
                    row: (whole + levels.first_row[s]) as u32,
                });
            }
        }
        None
    }
}
