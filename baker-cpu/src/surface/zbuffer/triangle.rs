//! The test of a triangle against points, with the bounds of its rounding errors.
//!
//! With B and C the edges from the first corner, X the vector from it to a point, and det = B × C > 0
//! in the plane: v = X × C, w = B × X, u = det − v − w are det times the barycentric coordinates, and
//! D = v B_z + w C_z − X_z det is det times the depth of the triangle ahead of the point.
//!
//! Bounds, with E = 2⁻²⁴, m the largest extent of the triangle across the direction, r that of X, and
//! m_z along it. Coordinates are wrong by E (`frame.rs`), differences by E (2 + their size):
//!
//! - v, w: 2 (r E (2 + m) + m E (2 + r)) from the differences, 4 E r m from roundings: E (4r + 4m + 8rm);
//!   det: E (8m + 8m²).
//! - u: the three together and E (4m² + 6rm) from its roundings: at most E (8r + 16m + 34rm) for m ≤ r,
//!   *b*, which bounds all three.
//! - D of a point within the triangle, where v, w ≤ V = det + 2b: 2 b m_z + E V (6 + 8 m_z) and, for each
//!   unit of |X_z|, b + 3 E det.

use std::ops::Range;

use super::bins::{Bins, Grid, PADDING, Vertex};
use super::{DOUBT, OCCLUDED};

/// Half a step of single floats below 2.
const E: f32 = 1.0 / 16_777_216.0;

/// The factor of all bounds for their own rounding and for products of errors.
const SLACK: f32 = 1.1;

/// The triangles of a direction.
pub(super) struct Projected<'a> {
    pub vertices: &'a [Vertex],
    pub triangles: &'a [[u32; 3]],
    /// The maximum distance, infinite for none.
    pub reach: f32,
    /// Whether triangles occlude from their front alone.
    pub fronts_alone: bool,
}

impl Projected<'_> {
    /// Tests all triangles against all points.
    #[inline(always)]
    pub(super) fn test<L: Level>(&self, level: L, bins: &mut Bins) {
        if bins.is_empty() {
            return;
        }
        for &[a, b, c] in self.triangles {
            let corner = |vertex: u32| self.vertices[vertex as usize];
            self.triangle(level, [corner(a), corner(b), corner(c)], bins);
        }
    }

    #[inline(always)]
    fn triangle<L: Level>(&self, level: L, [a, b, c]: [Vertex; 3], bins: &mut Bins) {
        let corners = [a.position, b.position, c.position];
        let [lo, hi] = extent(&corners);
        if !bins.grid.meets(lo, hi) {
            return;
        }
        let first = |x: usize| usize::from(a.first[x].min(b.first[x]).min(c.first[x]));
        let last = |x: usize| usize::from(a.last[x].max(b.last[x]).max(c.last[x]));
        let (columns, rows) = ([first(0), last(0)], [first(1), last(1)]);
        let max_z = [hi[2] + PADDING, PADDING - lo[2]];
        let test = Test::new(corners, [lo, hi], bins.grid.size, self.reach);
        let is_tall = rows[1] > rows[0] + 1;
        for row in rows[0]..=rows[1] {
            let mut cells = columns;
            if is_tall {
                match row_span(&corners, &bins.grid, row) {
                    Some([first, last]) => {
                        cells = [cells[0].max(first), cells[1].min(last)];
                    }
                    None => continue,
                }
            }
            for (is_opposite, max_z) in [(false, max_z[0]), (true, max_z[1])] {
                if self.fronts_alone && !test.is_sliver && test.faces_along != is_opposite {
                    continue;
                }
                let points = bins.row_points(row, cells, is_opposite, max_z);
                if points.is_empty() {
                    continue;
                }
                let side = test.side(is_opposite);
                match (test.is_sliver, self.reach.is_finite()) {
                    (false, false) => level.points::<false, false>(&test, side, points, bins),
                    (false, true) => level.points::<false, true>(&test, side, points, bins),
                    (true, _) => level.points::<true, false>(&test, side, points, bins),
                }
            }
        }
    }
}

/// Returns the smallest and the largest coordinates.
#[inline(always)]
fn extent([a, b, c]: &[[f32; 3]; 3]) -> [[f32; 3]; 2] {
    let (mut lo, mut hi) = (*a, *a);
    for x in 0..3 {
        lo[x] = min(min(a[x], b[x]), c[x]);
        hi[x] = max(max(a[x], b[x]), c[x]);
    }
    [lo, hi]
}

/// Returns the first and the last cell that a triangle covers in a row, if it covers any.
#[inline(always)]
fn row_span(corners: &[[f32; 3]; 3], grid: &Grid, row: usize) -> Option<[usize; 2]> {
    let [bottom, top] = grid.row(row);
    let [bottom, top] = [bottom - PADDING, top + PADDING];
    let [mut lo, mut hi] = [f32::INFINITY, f32::NEG_INFINITY];
    for edge in 0..3 {
        let [p, q] = [corners[edge], corners[(edge + 1) % 3]];
        let [p, q] = if p[1] <= q[1] { [p, q] } else { [q, p] };
        if q[1] < bottom || p[1] > top {
            continue;
        }
        let slope = (q[0] - p[0]) / (q[1] - p[1]);
        for (end, is_cut, y) in [(p, p[1] < bottom, bottom), (q, q[1] > top, top)] {
            let x = match is_cut {
                // Rounding must not leave the edge; an edge that is cut is not horizontal.
                true => max(
                    min(p[0] + (y - p[1]) * slope, max(p[0], q[0])),
                    min(p[0], q[0]),
                ),
                false => end[0],
            };
            lo = min(lo, x);
            hi = max(hi, x);
        }
    }
    // The slope multiplies the rounding of y by up to 2/PADDING only where the edge is within the
    // padding of one row: there both its ends count, uncut.
    let padding = PADDING * 8.0 + (hi - lo) * PADDING;
    match lo <= hi {
        true => grid.range(0, lo - padding, hi + padding),
        false => None,
    }
}

/// The test of points at a SIMD level. All levels have the same results.
pub(super) trait Level: Copy {
    /// Tests the points of a side. `SLIVER` is [`Test::is_sliver`], `BOUNDED` whether the maximum
    /// distance is finite.
    fn points<const SLIVER: bool, const BOUNDED: bool>(
        self,
        test: &Test,
        side: Side,
        points: Range<usize>,
        bins: &mut Bins,
    );
}

/// A triangle that is ready to test points.
pub(super) struct Test {
    pub a: [f32; 3],
    pub b: [f32; 3],
    pub c: [f32; 3],
    pub det: f32,
    /// The bound of u, v and w.
    pub edge_bound: f32,
    /// The bound of D at X_z = 0, and its growth with |X_z|.
    pub depth_bound: [f32; 2],
    /// The maximum distance times det, and its bound.
    pub reach: [f32; 2],
    /// Whether det is too small for its sign to be certain.
    is_sliver: bool,
    /// Whether the triangle faces along the direction, so that points see its back; certain unless it is a
    /// sliver.
    faces_along: bool,
}

/// The depths of a triangle with the sign of a side.
#[derive(Clone, Copy)]
pub(super) struct Side {
    pub a: f32,
    pub b: f32,
    pub c: f32,
}

impl Test {
    #[inline(always)]
    fn new([a, b, c]: [[f32; 3]; 3], [lo, hi]: [[f32; 3]; 2], cell: f32, reach: f32) -> Self {
        let minus = |p: [f32; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
        let [mut b, mut c] = [minus(b), minus(c)];
        let mut det = b[0] * c[1] - b[1] * c[0];
        let faces_along = det >= 0.0;
        if !faces_along {
            (b, c, det) = (c, b, -det);
        }
        let m = max(hi[0] - lo[0], hi[1] - lo[1]) + PADDING;
        // Points lie in cells that the triangle's box meets.
        let r = m + 1.01 * cell;
        let mz = hi[2] - lo[2] + PADDING;
        let edge_bound = SLACK * E * (8.0 * r + 16.0 * m + 34.0 * r * m);
        let v = det + 2.0 * edge_bound;
        let depth_bound = [
            SLACK * (2.0 * edge_bound * mz + E * v * (6.0 + 8.0 * mz)),
            SLACK * (edge_bound + 3.0 * E * det),
        ];
        Self {
            a,
            b,
            c,
            det,
            edge_bound,
            depth_bound,
            reach: [reach * det, SLACK * reach * (edge_bound + 3.0 * E * det)],
            is_sliver: det <= 4.0 * edge_bound,
            faces_along,
        }
    }

    #[inline(always)]
    fn side(&self, is_opposite: bool) -> Side {
        let [a, b, c] = [self.a[2], self.b[2], self.c[2]];
        match is_opposite {
            true => Side {
                a: -a,
                b: -b,
                c: -c,
            },
            false => Side { a, b, c },
        }
    }

    /// Tests a point.
    #[inline(always)]
    pub(super) fn point<const SLIVER: bool, const BOUNDED: bool>(
        &self,
        side: Side,
        p: [f32; 3],
    ) -> u32 {
        let (x, y, z) = (p[0] - self.a[0], p[1] - self.a[1], p[2] - side.a);
        let v = x * self.c[1] - y * self.c[0];
        let w = self.b[0] * y - self.b[1] * x;
        let u = self.det - v - w;
        let smallest = min(min(u, v), w);
        if SLIVER {
            // Outside if two of them differ in sign; nothing else is certain.
            let largest = max(max(u, v), w);
            let is_outside = (smallest < -self.edge_bound) & (largest > self.edge_bound);
            return if is_outside { 0 } else { DOUBT };
        }
        let depth = v * side.b + w * side.c - z * self.det;
        let bound = self.depth_bound[0] + self.depth_bound[1] * z.abs();
        let mut is_miss = (smallest < -self.edge_bound) | (depth < -bound);
        let mut is_hit = (smallest > self.edge_bound) & (depth > bound);
        if BOUNDED {
            let [reach, reach_bound] = self.reach;
            is_miss |= depth > reach + (bound + reach_bound);
            is_hit &= depth < reach - (bound + reach_bound);
        }
        let unless_hit = if is_miss { 0 } else { DOUBT };
        if is_hit { OCCLUDED } else { unless_hit }
    }
}

/// Returns the smaller number. Neither is NaN, which `f32::min` would take extra steps for.
#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Returns the larger number. Neither is NaN.
#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
