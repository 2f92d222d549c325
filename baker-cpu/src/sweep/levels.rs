//! Levels: the planes in which the rows of cells lie, as a direction's slope sees them.

use super::counters::{MOST_LAYERS, Tile};
use super::frame::Frame;

/// Levels between one whole number and the next, at the most: bits 0–4 of a level's number.
pub(super) const FRACTIONS: usize = MOST_LAYERS as usize;
pub(super) const FRACTION_BITS: u32 = FRACTIONS.ilog2();

/// The rows of a tile, seen along directions of slope b in the (v, w) plane. Row (j, k) lies in
/// the plane V − b·W = j − k·b. Levels are numbered in order of that value: the number has the
/// value's whole part above [`FRACTION_BITS`], and below them the rank of its fraction among
/// those that there are, of which each k has one. Other numbers are no level's.
#[derive(Clone, Debug)]
pub(super) struct Levels {
    /// Cells along v per cell along w.
    pub slope: f32,
    /// How many fractions there are: the values of k in the tile.
    pub n: usize,
    /// Of −k·b, 0..1, sorted; infinite where there is none.
    pub fractions: [f32; FRACTIONS],
    /// The k of each fraction.
    pub k: [f32; FRACTIONS],
    /// Added to a level's whole part: the row's number in the tile, if j is one of the tile's.
    pub first_row: [i32; FRACTIONS],
    /// Added to a level's whole part: its j, from the tile's first.
    pub first_j: [i32; FRACTIONS],
    /// Values of j in the tile.
    pub width: u32,
    /// The lowest number that can be of the tile, and one above the highest.
    pub range: [i32; 2],
    /// For each 256th of a cell, how many fractions lie before it.
    before: [u8; BUCKETS],
}

/// A level that an edge crosses.
#[derive(Clone, Copy, Debug)]
pub(super) struct RowLevel {
    /// V − b·W of the row's plane.
    pub value: f32,
    pub k: f32,
    /// The row's number in the tile.
    pub row: u32,
}

const BUCKETS: usize = 256;

/// Adding it to a float of magnitude below 2²² leaves no room for a fraction.
const NO_FRACTION: f32 = 1.5 * (1 << 23) as f32;

/// The whole part, towards minus infinity, of |x| < 2²², without the call to a library that
/// `floor` is on machines without an instruction for it.
#[inline(always)]
fn floor(x: f32) -> f32 {
    let nearest = (x + NO_FRACTION) - NO_FRACTION;
    if nearest > x { nearest - 1.0 } else { nearest }
}

impl Levels {
    pub(super) fn new(frame: &Frame, tile: &Tile, b: u32) -> Self {
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
            before: [0; BUCKETS],
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
        levels.before = std::array::from_fn(|bucket| {
            let start = bucket as f32 / BUCKETS as f32;
            sorted.partition_point(|level| level.0 < start) as u8
        });
        levels
    }

    /// V − b·W, in cells: the one expression of it.
    #[inline(always)]
    pub(super) fn q(&self, v: f32, w: f32) -> f32 {
        v - self.slope * w
    }

    /// The lowest level's number that is not below the vertex at (V, W), in cells: an edge
    /// crosses exactly the levels from the lower rank of its ends on, to the one before the
    /// higher. The one question on which everything else hangs: it is asked once for each
    /// vertex.
    #[inline(always)]
    pub(super) fn rank(&self, v: f32, w: f32) -> i32 {
        let q = self.q(v, w);
        let whole = floor(q);
        let fraction = q - whole;
        let mut s = usize::from(self.before[(fraction * BUCKETS as f32) as usize & (BUCKETS - 1)]);
        if fraction >= 1.0 {
            // A tiny negative q rounds up to the next whole: above all fractions.
            s = self.n;
        }
        while s < self.n && self.fractions[s] < fraction {
            s += 1;
        }
        self.number(whole as i32, s)
    }

    /// The number of the s-th level from a whole part on; the n-th is the next one's first.
    #[inline(always)]
    fn number(&self, whole: i32, s: usize) -> i32 {
        let s = if s == self.n { FRACTIONS } else { s };
        (whole << FRACTION_BITS) + s as i32
    }

    /// The rows between two ranks, in order.
    #[inline(always)]
    pub(super) fn between(&self, low: i32, high: i32) -> Between<'_> {
        Between {
            levels: self,
            next: low.max(self.range[0]),
            end: high.min(self.range[1]),
        }
    }

    /// The level of the row (j, k) in cells, and its number.
    pub(super) fn of_row(&self, row: u32) -> (RowLevel, i32) {
        let of_row = |s: &usize| (row as i32 - self.first_row[*s] + self.first_j[*s]) as u32;
        let s = (0..self.n).find(|s| of_row(s) < self.width);
        let s = s.expect("the row is of the tile");
        let whole = row as i32 - self.first_row[s];
        let value = whole as f32 + self.fractions[s];
        let (k, number) = (self.k[s], self.number(whole, s));
        (RowLevel { value, k, row }, number)
    }
}

/// See [`Levels::between`].
pub(super) struct Between<'a> {
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
