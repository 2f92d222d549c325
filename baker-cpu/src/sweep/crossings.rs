//! Crossings: where edges pass through the plane of a row, and the cells from which on that
//! matters.

use super::counters::{Counter, Counters};
use super::frame::{Frame, LANES};
use super::levels::{Levels, Ranked, RowLevel};
use super::silhouettes::Facing;

/// An end of an edge as one batch sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    pub ranked: Ranked,
    /// In cells.
    pub u: f32,
    /// In cells.
    pub w: f32,
}

/// An edge, from its first end to its second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    from: End,
    per_level: [f32; 2],
}

impl Line {
    /// The ends have different ranks, so that they differ in q.
    #[inline(always)]
    pub(super) fn new(from: End, to: End) -> Self {
        let inverse = 1.0 / (to.ranked.q - from.ranked.q);
        Self {
            from,
            per_level: [(to.u - from.u) * inverse, (to.w - from.w) * inverse],
        }
    }

    /// Where it crosses a level: u, and the height above the row, both in cells.
    ///
    /// Whoever asks on which side of the row an edge passes asks the sign of this height, of
    /// the edge from its lower vertex to its higher: the one expression, so that all agree.
    #[inline(always)]
    pub(super) fn at(&self, level: &RowLevel) -> [f32; 2] {
        let t = level.value - self.from.ranked.q;
        let [u, w] = self.per_level;
        [self.from.u + t * u, (self.from.w + t * w) - level.k as f32]
    }
}

/// 0: above the row, 1: below. Upon the row is below.
#[inline(always)]
pub(super) fn side(height: f32) -> usize {
    usize::from(height <= 0.0)
}

/// What an edge adds from its crossing on, for each lane of each block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deltas {
    /// Signed, as bytes, which are looked at as one number.
    pub lanes: [u8; LANES],
    /// Around all that are not zero.
    pub first: usize,
    pub last: usize,
}

impl Deltas {
    /// For the directions of a block: minus the sum of the signs of the edge's triangles, of
    /// which each is one layer more to the right of its left edge and one fewer to the right
    /// of its right edge. Seen along d, a triangle with n·d > 0 has its edges that go up (in
    /// V − b·W) at its right.
    #[inline(always)]
    pub(super) fn new(sides: &[Facing], up: bool, frame: &Frame, block: usize) -> Self {
        let start = (block * LANES) as u8;
        let mut lanes = [0_u8; LANES];
        for facing in sides {
            let facing = if up { *facing } else { facing.reversed() };
            for (lane, delta) in (0_u8..).zip(&mut lanes) {
                *delta = delta.wrapping_sub(facing.sign(start + lane).cast_unsigned());
            }
        }
        let n = (frame.size as usize - block * LANES).min(LANES);
        if n < LANES {
            lanes[n..].fill(0);
        }
        // All lanes as one number, of which zeros at either end are quickly counted.
        let all = u128::from_le_bytes(lanes);
        let first = all.trailing_zeros() as usize / 8;
        let last = LANES - all.leading_zeros() as usize / 8;
        Self { lanes, first, last }
    }
}

/// 2²³: adding it to a float in 0..2²² leaves the nearest whole number in the lowest bits.
const WHOLE: f32 = (1 << 23) as f32;
const MANTISSA: u32 = (1 << 23) - 1;

/// The first column that a step at `u`, `height` above the row, changes, for each direction:
/// the least whole number not below u − height·slope, from 0 to `n_u`, which is nowhere.
#[inline(always)]
pub(super) fn columns(u: f32, height: f32, slopes: &[f32; LANES], n_u: f32) -> [u32; LANES] {
    let mut columns = [0; LANES];
    for (column, slope) in columns.iter_mut().zip(slopes) {
        let at = (u - height * slope).max(0.0).min(n_u);
        let nearest = at + WHOLE;
        let below = nearest - WHOLE < at;
        *column = (nearest.to_bits() & MANTISSA) + u32::from(below);
    }
    columns
}

/// What a batch counts with.
pub(super) struct Batch<'a> {
    pub frame: &'a Frame,
    pub levels: &'a Levels,
    /// Of each block.
    pub slopes: &'a [[f32; LANES]],
}

impl Batch<'_> {
    /// Counts an edge of one or two triangles at every row that it crosses.
    #[inline(always)]
    pub(super) fn count<C: Counter>(
        &self,
        ends: [End; 2],
        sides: &[Facing],
        counters: &mut Counters<'_, C>,
    ) {
        let [from, to] = ends.map(|end| end.ranked.rank);
        let line = Line::new(ends[0], ends[1]);
        let n_u = counters.layout.n_u as f32;
        for (block, slopes) in self.slopes.iter().enumerate() {
            let deltas = Deltas::new(sides, from < to, self.frame, block);
            if deltas.first >= deltas.last {
                continue;
            }
            for level in self.levels.between(from.min(to), from.max(to)) {
                let Some(row) = counters.tile.row(level.j, level.k) else {
                    continue;
                };
                let [u, height] = line.at(&level);
                let columns = columns(u, height, slopes, n_u);
                let lanes = deltas.first..deltas.last;
                counters.step(row, block, side(height), lanes, &columns, &deltas.lanes);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_rounded_up_and_kept_in_the_grid() {
        let slopes: [f32; LANES] = std::array::from_fn(|z| z as f32 / 16.0 - 0.4);
        for (u, height) in [
            (3.25, 0.0),
            (-7.0, 2.0),
            (40.0, 1.0),
            (5.0, -20.5),
            (31.0, 1e-6),
        ] {
            let found = columns(u, height, &slopes, 32.0);
            for (column, slope) in found.into_iter().zip(slopes) {
                let expected = (u - height * slope).ceil().clamp(0.0, 32.0);
                assert_eq!(column, expected as u32, "{u} {height} {slope}");
            }
        }
    }
}
