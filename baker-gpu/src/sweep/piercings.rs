//! Where the line of a row of cells comes near a triangle, found in exact integers: there a
//! layer may change from above the row to below it.
//!
//! Two edges of a triangle that cross a row's level pass on different sides of the row where
//! the row's line goes through the triangle, or so close to an edge that a vertex' rounded rank
//! decides. Which of the two it is, a shader finds from ranks; here it is enough to leave none
//! out. Let rounding move a vertex by δ in V until its rank is exact. An edge passes on another
//! side than its moved self only if the row lies between the edge's ends in W and within δ of
//! its line, hence within δ of the edge; and if no edge does, different sides mean that the
//! row's line goes through the moved triangle. Either way it comes within δ of the triangle.

use std::ops::Range;

use aogrid_bake_core::PreparedMesh;
use rayon::prelude::*;

use super::gpu_data::Piercing;
use super::plan::Brick;
use super::view::View;

/// Where an edge passes, see `piercings.wgsl`.
pub(super) const ABOVE: u32 = 0;
const BELOW: u32 = 1;
pub(super) const ABOVE_IF_UP: u32 = 2;
pub(super) const ABOVE_IF_DOWN: u32 = 3;

/// How near, in cells, a row's line must at least come to a triangle: more than rounding can
/// do; more costs time.
const NEAR: f64 = 1.0 / 1024.0;

/// What rounding does to V − b·W, over the largest coordinates: a product and a difference,
/// half a step of 2⁻²³ each, and as much again for the levels; eight times for safety.
const ROUNDING: f64 = 8.0 / (1 << 22) as f64;

/// Rows and triangles that are looked at for one buffer of candidates, at most.
const MOST_AT_ONCE: u64 = 1 << 21;

/// Triangles that a thread takes at a time.
const CHUNK: usize = 4096;

/// The lines of a brick's rows along all three axes, and a mesh.
pub(super) struct Search<'a> {
    mesh: &'a PreparedMesh,
    views: [View; 3],
    /// Of each axis, in lattice steps.
    margins: [i64; 3],
}

impl<'a> Search<'a> {
    /// `reach` is the largest coordinate of a vertex along each axis, in cells.
    pub(super) fn new(mesh: &'a PreparedMesh, brick: &Brick, size: u32, reach: [f64; 3]) -> Self {
        let views = [0, 1, 2].map(|w| View::new(mesh, brick, w, size));
        let steps = f64::from(1_u32 << mesh.lattice().bits());
        let margins = [0, 1, 2].map(|w| {
            let [_, v, _] = views[w].axes;
            let rounding = ROUNDING * (reach[v] + views[w].shear[1] * reach[w]);
            (NEAR.max(rounding) * steps).ceil() as i64
        });
        Self {
            mesh,
            views,
            margins,
        }
    }

    /// Ranges of triangles whose candidates fit a buffer; mostly one.
    pub(super) fn batches(&self) -> Vec<Range<usize>> {
        let n = self.mesh.triangles().len();
        let chunk = |i: usize| i * CHUNK..((i + 1) * CHUNK).min(n);
        let rows: Vec<u64> = (0..n.div_ceil(CHUNK))
            .into_par_iter()
            .map(|i| chunk(i).map(|triangle| self.n_rows(triangle)).sum())
            .collect();
        let mut batches = Vec::new();
        let mut last = 0..0;
        let mut in_batch = 0;
        for (i, rows) in rows.into_iter().enumerate() {
            let parts: Vec<(Range<usize>, u64)> = match rows > MOST_AT_ONCE {
                false => vec![(chunk(i), rows)],
                true => chunk(i).map(|t| (t..t + 1, self.n_rows(t))).collect(),
            };
            for (triangles, rows) in parts {
                if in_batch + rows > MOST_AT_ONCE {
                    batches.push(last);
                    last = triangles.start..triangles.start;
                    in_batch = 0;
                }
                in_batch += rows;
                last.end = triangles.end;
            }
        }
        batches.push(last);
        batches
    }

    /// The candidates among a range of triangles, for each axis.
    pub(super) fn find(&self, triangles: Range<usize>) -> [Vec<Piercing>; 3] {
        let n = triangles.len();
        let parts: Vec<[Vec<Piercing>; 3]> = (0..n.div_ceil(CHUNK))
            .into_par_iter()
            .map(|i| {
                let mut found: [Vec<Piercing>; 3] = Default::default();
                let start = triangles.start + i * CHUNK;
                for triangle in start..(start + CHUNK).min(triangles.end) {
                    self.triangle(triangle, &mut found);
                }
                found
            })
            .collect();
        let mut all: [Vec<Piercing>; 3] = Default::default();
        for part in parts {
            for (all, part) in all.iter_mut().zip(part) {
                all.extend(part);
            }
        }
        all
    }

    fn points(&self, triangle: usize) -> [[i32; 3]; 3] {
        let corners = self.mesh.triangles()[triangle];
        corners.map(|v| self.mesh.vertices()[v as usize])
    }

    /// Rows near the triangle's bounds, of all three axes.
    fn n_rows(&self, triangle: usize) -> u64 {
        let points = self.points(triangle);
        let of_axis = |w: usize| {
            let [j, k] = self.rows(w, &points)?;
            Some(((j.end - j.start) * (k.end - k.start)) as u64)
        };
        (0..3).filter_map(of_axis).sum()
    }

    /// The rows (j, k) of the brick, in cells of the grid, that come near the bounds.
    fn rows(&self, w: usize, points: &[[i32; 3]; 3]) -> Option<[Range<i64>; 2]> {
        let view = &self.views[w];
        let bits = self.mesh.lattice().bits();
        let range = |across: usize| {
            let axis = view.axes[across];
            let [a, b, c] = points.map(|p| p[axis]);
            let low = i64::from(a.min(b).min(c)) - self.margins[w];
            let high = i64::from(a.max(b).max(c)) + self.margins[w];
            let first = i64::from(view.first[across]);
            let end = first + i64::from(view.cells[across]);
            let start = ((low + (1 << bits) - 1) >> bits).max(first);
            let range = start..((high >> bits) + 1).min(end);
            (!range.is_empty()).then_some(range)
        };
        Some([range(1)?, range(2)?])
    }

    fn triangle(&self, triangle: usize, found: &mut [Vec<Piercing>; 3]) {
        let points = self.points(triangle);
        for (w, found) in found.iter_mut().enumerate() {
            let Some([j_range, k_range]) = self.rows(w, &points) else {
                continue;
            };
            let normal = self.mesh.normal(self.mesh.triangles()[triangle]);
            for k in k_range {
                for j in j_range.clone() {
                    if self.is_near(w, &points, normal, [j, k]) {
                        found.push(self.candidate(w, triangle, normal, [j, k]));
                    }
                }
            }
        }
    }

    /// A row's line in (v, w), in lattice steps.
    fn line(&self, [j, k]: [i64; 2]) -> [i64; 2] {
        let bits = self.mesh.lattice().bits();
        [j << bits, k << bits]
    }

    /// Whether the line is within the margin of the triangle, or goes through it.
    fn is_near(&self, w: usize, points: &[[i32; 3]; 3], normal: [i64; 3], row: [i64; 2]) -> bool {
        let [u, v, _] = self.views[w].axes;
        let [j, k] = self.line(row);
        let across = points.map(|p| [p[v], p[w]].map(i64::from));
        (0..3).all(|i| {
            let [a, b] = [across[i], across[(i + 1) % 3]];
            let along = [b[0] - a[0], b[1] - a[1]];
            let area = along[0] * (k - a[1]) - along[1] * (j - a[0]);
            let inward = if normal[u] < 0 { -area } else { area };
            inward > -self.margins[w] * (along[0].abs() + along[1].abs())
        })
    }

    fn candidate(&self, w: usize, triangle: usize, normal: [i64; 3], row: [i64; 2]) -> Piercing {
        let view = &self.views[w];
        let v = view.axes[1];
        let corners = self.mesh.triangles()[triangle];
        let points = self.points(triangle);
        let line = self.line(row);
        let mut edges = 0;
        for i in 0..3 {
            let next = (i + 1) % 3;
            let is_reversed = corners[i] > corners[next];
            let ends = if is_reversed { [next, i] } else { [i, next] };
            let [start, end] = ends.map(|e| [points[e][v], points[e][w]].map(i64::from));
            edges |= passes(start, end, line) << (2 * i) | u32::from(is_reversed) << (6 + i);
        }
        let local = |across: usize| row[across - 1] as u32 - view.first[across];
        Piercing {
            corners,
            triangle: triangle as u32,
            row: local(1) | local(2) << 16,
            column: self.column(view, &points, normal, line),
            edges,
            unused: 0,
        }
    }

    /// The first column whose cells are not to the left of the point where the line meets the
    /// triangle's plane. In double precision: 2⁻⁵² of the triangle's size is nothing.
    fn column(&self, view: &View, points: &[[i32; 3]; 3], n: [i64; 3], line: [i64; 2]) -> u32 {
        let [u, v, w] = view.axes;
        let from = |at: i64, axis: usize| (at - i64::from(points[0][axis])) as f64;
        let rise = n[v] as f64 * from(line[0], v) + n[w] as f64 * from(line[1], w);
        let at_u = points.map(|p| f64::from(p[u]));
        let low = at_u[0].min(at_u[1]).min(at_u[2]);
        let high = at_u[0].max(at_u[1]).max(at_u[2]);
        let at = match n[u] {
            // The line lies in the triangle's plane, where any point is as good as another.
            0 => (low + high) / 2.0,
            n_u => (at_u[0] - rise / n_u as f64).clamp(low, high),
        };
        let cells = at / f64::from(1_u32 << self.mesh.lattice().bits());
        let column = cells.ceil() - f64::from(view.first[0]);
        column.clamp(0.0, f64::from(view.cells[0])) as u32
    }
}

/// Where an edge, from its lower vertex to its higher in (v, w), passes the line of a row:
/// `is_above` of `integers.wgsl`, up to what only ranks know.
fn passes(start: [i64; 2], end: [i64; 2], line: [i64; 2]) -> u32 {
    let along = [end[0] - start[0], end[1] - start[1]];
    let to_row = [line[0] - start[0], line[1] - start[1]];
    if to_row[1] < along[1].min(0) {
        ABOVE
    } else if to_row[1] > along[1].max(0) {
        BELOW
    } else if along[0] * to_row[1] >= along[1] * to_row[0] {
        ABOVE_IF_DOWN
    } else {
        ABOVE_IF_UP
    }
}
