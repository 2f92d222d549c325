//! Levels: the planes in which the rows of cells lie, as a direction's slope sees them.

use super::counters::Tile;
use super::frame::Frame;

/// The rows of a tile, seen along directions of slope b in the (v, w) plane. Row (j, k) lies in
/// the plane V − b·W = j − k·b. Levels are numbered in order of that value: number
/// f·K + s, where s is the rank of the value's fraction among the K fractions there are.
pub(super) struct Levels {
    pub slope: f32,
    /// Sorted by fraction, one for each k of the tile.
    sorted: Vec<Level>,
    /// For each 256th of a cell, how many fractions lie before it.
    before: [u8; BUCKETS],
    /// The lowest level that can be of the tile, and one above the highest.
    range: [i32; 2],
}

/// The rows of one k.
#[derive(Clone, Copy, Debug)]
struct Level {
    /// Of −k·b, 0..1.
    fraction: f32,
    /// The whole part of −k·b.
    whole: i32,
    k: u32,
}

/// A vertex as one batch sees it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ranked {
    /// How many levels lie below: an edge crosses exactly the levels from the lower rank of
    /// its ends to the one before the higher. The one question on which everything else
    /// hangs; it is asked once for each vertex.
    pub rank: i32,
    /// V − b·W, in cells.
    pub q: f32,
}

/// A level that an edge crosses.
#[derive(Clone, Copy, Debug)]
pub(super) struct RowLevel {
    /// V − b·W of the row's plane.
    pub value: f32,
    pub j: u32,
    pub k: u32,
}

const BUCKETS: usize = 256;

/// Adding it to a float of magnitude below 2²² leaves no room for a fraction.
const NO_FRACTION: f32 = 1.5 * (1 << 23) as f32;

/// The whole part, towards minus infinity, of |x| < 2²², without the call to a library that
/// `floor` is on machines without an instruction for it.
#[inline(always)]
pub(super) fn floor(x: f32) -> f32 {
    let nearest = (x + NO_FRACTION) - NO_FRACTION;
    if nearest > x { nearest - 1.0 } else { nearest }
}

impl Levels {
    pub(super) fn new(frame: &Frame, tile: &Tile, b: u32) -> Self {
        let slope = frame.row_slope(b);
        let level = |k: u32| {
            let value = -(k as f32) * slope;
            let whole = floor(value);
            Level {
                fraction: value - whole,
                whole: whole as i32,
                k,
            }
        };
        let mut sorted: Vec<Level> = tile.k.clone().map(level).collect();
        sorted.sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
        let before = std::array::from_fn(|bucket| {
            let start = bucket as f32 / BUCKETS as f32;
            sorted.partition_point(|level| level.fraction < start) as u8
        });
        let n = sorted.len() as i32;
        let first = |whole: i32| tile.j.start as i32 + whole;
        let last = |whole: i32| tile.j.end as i32 + whole;
        let wholes = || sorted.iter().map(|level| level.whole);
        // Row (j, k) is level (j + whole of −k·b, rank of its fraction).
        let low = wholes().map(first).min().unwrap_or(0) * n;
        let high = wholes().map(last).max().unwrap_or(0) * n;
        Self {
            slope,
            sorted,
            before,
            range: [low, high],
        }
    }

    /// The vertex at (V, W), in cells.
    #[inline(always)]
    pub(super) fn rank(&self, v: f32, w: f32) -> Ranked {
        let q = v - self.slope * w;
        let whole = floor(q);
        let fraction = q - whole;
        let mut rank = usize::from(self.before[(fraction * BUCKETS as f32) as usize & 255]);
        if fraction >= 1.0 {
            // A tiny negative q rounds up to the next whole: above all fractions.
            rank = self.sorted.len();
        }
        while rank < self.sorted.len() && self.sorted[rank].fraction < fraction {
            rank += 1;
        }
        Ranked {
            rank: whole as i32 * self.sorted.len() as i32 + rank as i32,
            q,
        }
    }

    /// The rows between two ranks, in order.
    #[inline(always)]
    pub(super) fn between(&self, low: i32, high: i32) -> Between<'_> {
        let (low, high) = (low.max(self.range[0]), high.min(self.range[1]));
        let n = self.sorted.len() as i32;
        Between {
            sorted: &self.sorted,
            whole: low.div_euclid(n),
            s: low.rem_euclid(n) as usize,
            left: high - low,
        }
    }

    /// The level of row (j, k), and its number.
    pub(super) fn of_row(&self, j: u32, k: u32) -> (RowLevel, i32) {
        let s = self.sorted.iter().position(|level| level.k == k);
        let s = s.expect("the row is of the tile");
        let whole = j as i32 + self.sorted[s].whole;
        let value = whole as f32 + self.sorted[s].fraction;
        let number = whole * self.sorted.len() as i32 + s as i32;
        (RowLevel { value, j, k }, number)
    }
}

/// See [`Levels::between`].
pub(super) struct Between<'a> {
    sorted: &'a [Level],
    whole: i32,
    s: usize,
    left: i32,
}

impl Iterator for Between<'_> {
    type Item = RowLevel;

    #[inline(always)]
    fn next(&mut self) -> Option<RowLevel> {
        if self.left <= 0 {
            return None;
        }
        self.left -= 1;
        let level = &self.sorted[self.s];
        let whole = self.whole;
        self.s += 1;
        if self.s == self.sorted.len() {
            self.s = 0;
            self.whole += 1;
        }
        Some(RowLevel {
            value: whole as f32 + level.fraction,
            j: (whole - level.whole) as u32,
            k: level.k,
        })
    }
}
