//! Edges as lines, and the points where they cross the level of a row.

use aogrid_bake_core::sweep::LANES;

use super::levels::{Levels, RowLevel};

/// An end of an edge as seen by one batch.
#[derive(Clone, Copy, Debug)]
pub(in crate::sweep) struct End {
    pub rank: i32,
    /// The position, in cells.
    pub u: f32,
    pub v: f32,
    pub w: f32,
}

/// An edge, from its first end to its second.
#[derive(Clone, Copy, Debug)]
pub(in crate::sweep) struct Line {
    u: f32,
    w: f32,
    q: f32,
    per_level: [f32; 2],
}

impl Line {
    /// Returns the line through two ends of different rank, which therefore differ in q.
    #[inline(always)]
    pub(in crate::sweep) fn new(from: End, to: End, levels: &Levels) -> Self {
        let q = levels.q(from.v, from.w);
        let inverse = 1.0 / (levels.q(to.v, to.w) - q);
        Self {
            u: from.u,
            w: from.w,
            q,
            per_level: [(to.u - from.u) * inverse, (to.w - from.w) * inverse],
        }
    }

    /// Returns the error bound of a column in cells: nearer than this to a whole number, the column
    /// is computed again in double precision. `rounding` is the error of a level; the error of the
    /// crossing point grows by as much as u and w change with the level.
    #[inline(always)]
    pub(in crate::sweep) fn column_error(&self, rounding: f32) -> f32 {
        let [u, w] = self.per_level;
        (rounding * (1.0 + (u.abs() + w.abs()))).min(MAX_COLUMN_ERROR)
    }

    /// Returns the point where the line crosses a level: u, and the height above the row, both in
    /// cells.
    ///
    /// All side tests use the sign of this height, with the edge oriented from its lower to its
    /// higher vertex index.
    #[inline(always)]
    pub(in crate::sweep) fn at(&self, level: &RowLevel) -> [f32; 2] {
        let t = level.value - self.q;
        let [u, w] = self.per_level;
        [self.u + t * u, (self.w + t * w) - level.k]
    }
}

/// Returns 0 above the row and 1 below. A height of zero counts as below.
#[inline(always)]
pub(in crate::sweep) fn row_side(height: f32) -> usize {
    usize::from(height <= 0.0)
}

/// 2²³: added to a float in 0..2²², it leaves the nearest whole number in the lowest bits.
const ROUNDING_BIAS: f32 = (1 << 23) as f32;
const MANTISSA: u32 = (1 << 23) - 1;

/// Returns, for each direction, the first column that a delta at `u`, `height` above the row,
/// changes: ⌈u − height·slope⌉, clamped to 0..=`n_u`, where `n_u` is past the last cell.
#[inline(always)]
pub(in crate::sweep) fn first_columns(
    u: f32,
    height: f32,
    slopes: &[f32; LANES],
    n_u: f32,
) -> [u32; LANES] {
    let mut columns = [0; LANES];
    for (column, slope) in columns.iter_mut().zip(slopes) {
        let at = (u - height * slope).max(0.0).min(n_u);
        let nearest = at + ROUNDING_BIAS;
        let below = nearest - ROUNDING_BIAS < at;
        *column = (nearest.to_bits() & MANTISSA) + u32::from(below);
    }
    columns
}

/// The upper bound of the column error, in cells: larger than any column, yet small enough that
/// floats are still rounded to whole numbers exactly.
pub(in crate::sweep) const MAX_COLUMN_ERROR: f32 = (1 << 20) as f32;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_rounded_up_and_clamped_to_the_grid() {
        let slopes: [f32; LANES] = std::array::from_fn(|z| z as f32 / 16.0 - 0.4);
        for (u, height) in [
            (3.25, 0.0),
            (-7.0, 2.0),
            (40.0, 1.0),
            (5.0, -20.5),
            (31.0, 1e-6),
        ] {
            let found = first_columns(u, height, &slopes, 32.0);
            for (column, slope) in found.into_iter().zip(slopes) {
                let expected = (u - height * slope).ceil().clamp(0.0, 32.0);
                assert_eq!(column, expected as u32, "{u} {height} {slope}");
            }
        }
    }
}
