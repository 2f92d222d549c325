//! One axis' view of the region: rows of cells along u, directions (a, b, 1) and their opposites.

use std::ops::Range;

use super::{FACE_SIZE, Region};
use crate::PreparedMesh;

/// Directions that share a row's plane: those through one row of texels, and their opposites.
pub(super) const LANES: usize = 2 * FACE_SIZE as usize;

/// Bits after the point of a slope. With 26 bits of a coordinate and 16 of a slope's whole part a
/// product stays below 2⁶².
const SLOPE_BITS: u32 = 20;

/// The region seen along the axis w. u, v, w follow each other cyclically: right-handed.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    /// The axes u, v and w.
    pub axes: [usize; 3],
    /// The region's cells along them.
    pub cells: [Range<u32>; 3],
    /// Lattice steps per cell are 2 to the power of this.
    pub bits: u32,
    /// Cells along u per cell along w, of each direction (a, b, 1).
    pub column_slopes: [f32; FACE_SIZE as usize],
    /// Cells along v per cell along w of each row of texels, times 2^[`SLOPE_BITS`].
    row_slopes: [i64; FACE_SIZE as usize],
}

impl Frame {
    pub(super) fn new(mesh: &PreparedMesh, region: &Region, w: usize) -> Self {
        let axes = [(w + 1) % 3, (w + 2) % 3, w];
        let size = mesh.spec().cell_size();
        let slope = |across: usize, texel: usize| {
            let side = f64::from(FACE_SIZE);
            (2.0 * texel as f64 + 1.0 - side) / side * size[w] / size[axes[across]]
        };
        let fixed = |slope: f64| (slope * f64::from(1_u32 << SLOPE_BITS)).round() as i64;
        Self {
            axes,
            cells: axes.map(|axis| region.cells[axis].clone()),
            bits: mesh.lattice().bits(),
            column_slopes: std::array::from_fn(|texel| slope(0, texel) as f32),
            row_slopes: std::array::from_fn(|texel| fixed(slope(1, texel))),
        }
    }

    /// A point of the lattice along u, v and w.
    #[inline]
    pub(super) fn project(&self, point: &[i32; 3]) -> [i64; 3] {
        let [u, v, w] = self.axes;
        [point[u].into(), point[v].into(), point[w].into()]
    }
}

/// The planes in which rows lie, for directions of one slope b: V − b·W is the same all over a
/// plane. In exact integers: lattice steps times 2^[`SLOPE_BITS`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Planes {
    slope: i64,
    bits: u32,
}

impl Planes {
    pub(super) fn new(frame: &Frame, texel: usize) -> Self {
        Self {
            slope: frame.row_slopes[texel],
            bits: frame.bits,
        }
    }

    /// V − b·W of a point.
    #[inline]
    pub(super) fn at(self, v: i64, w: i64) -> i64 {
        (v << SLOPE_BITS) - self.slope * w
    }

    /// V − b·W of the row (j, k).
    #[inline]
    pub(super) fn of_row(self, j: i64, k: i64) -> i64 {
        self.at(j << self.bits, k << self.bits)
    }

    /// The j of the first row of layer `k` that lies in the plane `q` or above it: with rows moved
    /// up by ε, the first whose plane is above `q`. In fractions; see [`Planes::whole`].
    #[inline]
    pub(super) fn first_row(self, q: i64, k: i64) -> i64 {
        q + self.slope * (k << self.bits) + ((1 << (self.bits + SLOPE_BITS)) - 1)
    }

    /// The same for the next layer.
    #[inline]
    pub(super) fn next_layer(self, first_row: i64) -> i64 {
        first_row + (self.slope << self.bits)
    }

    /// The whole number of fractions of a row.
    #[inline]
    pub(super) fn whole(self, row: i64) -> i64 {
        row >> (self.bits + SLOPE_BITS)
    }
}

/// An edge in the plane of v and w, which tells on which of its sides a row passes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    from: [i64; 2],
    along: [i64; 2],
    /// The side of a point on the edge's line, which counts as moved by (ε, ε²).
    tie: i64,
}

impl Side {
    #[inline(always)]
    pub(super) fn new(from: [i64; 2], to: [i64; 2]) -> Self {
        let along = [to[0] - from[0], to[1] - from[1]];
        let tie = if along[1] == 0 { along[0] } else { -along[1] };
        Self { from, along, tie }
    }

    /// Above zero for a point to the left of the edge, below zero to the right. Exact, of opposite
    /// sign for the opposite edge, and zero only for an edge without length in this plane.
    #[inline(always)]
    pub(super) fn of(&self, point: [i64; 2]) -> i64 {
        let across = [point[0] - self.from[0], point[1] - self.from[1]];
        match self.along[0] * across[1] - self.along[1] * across[0] {
            0 => self.tie,
            area => area,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_are_broken_as_if_the_point_were_moved() {
        // 16 times as fine: ε is one step, and ε² is less than any.
        let fine = |[v, w]: [i64; 2], [dv, dw]: [i64; 2]| [16 * v + dv, 16 * w + dw];
        let points = (-2..=2).flat_map(|v| (-2..=2).map(move |w| [v, w]));
        let points: Vec<[i64; 2]> = points.collect();
        for &a in &points {
            for &b in &points {
                for &p in &points {
                    let sign = Side::new(a, b).of(p).signum();
                    assert_eq!(sign, -Side::new(b, a).of(p).signum());
                    assert_eq!(sign == 0, a == b);
                    let [a, b, p] = [fine(a, [0; 2]), fine(b, [0; 2]), fine(p, [1, 0])];
                    let area = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
                    // Moved along v alone, it may still lie on an edge along v.
                    assert!(area == 0 || area.signum() == sign, "{a:?} {b:?} {p:?}");
                }
            }
        }
    }
}
