//! Candidates for row hits: the triangles that the line of a row of cells comes close to, found
//! in exact integers. At a row hit a layer moves from above the row to below it.
//!
//! Two edges of a triangle that cross a row's level pass on different sides of the row in two
//! cases: the row's line goes through the triangle, or it passes so close to an edge that a
//! vertex's rounded rank decides. A shader decides from the ranks; the search only has to find
//! every such row. Proof that it does: move each vertex by at most δ in V, such that its rounded
//! rank is exact. A moved edge passes on another side than the original only if the row lies
//! between the edge's ends in W and within δ of its line, hence within δ of the edge. If no edge
//! changes sides, different sides mean that the row's line goes through the moved triangle.
//! Either way the line comes within δ of the triangle.

use std::ops::Range;

use aogrid_bake_core::PreparedMesh;
use rayon::prelude::*;

use super::gpu_data::RowHitCandidate;
use super::plan::Brick;
use super::view::AxisFrame;

/// The side of a row on which an edge passes, see `row_hits.wgsl`.
pub(super) const ABOVE: u32 = 0;
const BELOW: u32 = 1;
pub(super) const ABOVE_IF_UP: u32 = 2;
pub(super) const ABOVE_IF_DOWN: u32 = 3;

/// The smallest margin, in cells, within which a row's line counts as close to a triangle. It
/// exceeds rounding errors; a larger one only costs time.
const MIN_MARGIN: f64 = 1.0 / 1024.0;

/// The relative rounding error of V − b·W, in terms of the largest coordinates: a product and a
/// difference, each half a step of 2⁻²³, doubled for the levels; times eight for safety.
const ROUNDING: f64 = 8.0 / (1 << 22) as f64;

/// The largest number of (row, triangle) pairs that are tested for one buffer of candidates.
const MAX_BATCH_PAIRS: u64 = 1 << 21;

/// The number of triangles that a thread takes at a time.
const TRIANGLE_CHUNK: usize = 4096;

/// A search for candidates among a mesh and the rows of a brick along all three axes.
pub(super) struct RowHitSearch<'a> {
    mesh: &'a PreparedMesh,
    axis_frames: [AxisFrame; 3],
    /// The margin for each axis, in lattice steps.
    margins: [i64; 3],
}

impl<'a> RowHitSearch<'a> {
    /// Creates a search. `max_coordinates` is the largest magnitude of a vertex coordinate along
    /// each axis, in cells.
    pub(super) fn new(
        mesh: &'a PreparedMesh,
        brick: &Brick,
        size: u32,
        max_coordinates: [f64; 3],
    ) -> Self {
        let axis_frames = [0, 1, 2].map(|w| AxisFrame::new(mesh, brick, w, size));
        let steps = f64::from(1_u32 << mesh.lattice().bits());
        let margins = [0, 1, 2].map(|w| {
            let [_, v, _] = axis_frames[w].axes;
            let rounding =
                ROUNDING * (max_coordinates[v] + axis_frames[w].shear[1] * max_coordinates[w]);
            (MIN_MARGIN.max(rounding) * steps).ceil() as i64
        });
        Self {
            mesh,
            axis_frames,
            margins,
        }
    }

    /// Returns ranges of triangles whose candidates fit a buffer; mostly one.
    pub(super) fn batches(&self) -> Vec<Range<usize>> {
        let n = self.mesh.triangles().len();
        let chunk = |i: usize| i * TRIANGLE_CHUNK..((i + 1) * TRIANGLE_CHUNK).min(n);
        let rows: Vec<u64> = (0..n.div_ceil(TRIANGLE_CHUNK))
            .into_par_iter()
            .map(|i| chunk(i).map(|triangle| self.n_rows(triangle)).sum())
            .collect();
        let mut batches = Vec::new();
        let mut last = 0..0;
        let mut in_batch = 0;
        for (i, rows) in rows.into_iter().enumerate() {
            // A chunk that exceeds a batch by itself is split into its triangles.
            let parts: Vec<(Range<usize>, u64)> = match rows > MAX_BATCH_PAIRS {
                false => vec![(chunk(i), rows)],
                true => chunk(i).map(|t| (t..t + 1, self.n_rows(t))).collect(),
            };
            for (triangles, rows) in parts {
                if in_batch + rows > MAX_BATCH_PAIRS {
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

    /// Returns the candidates among a range of triangles, for each axis.
    pub(super) fn find(&self, triangles: Range<usize>) -> [Vec<RowHitCandidate>; 3] {
        let n = triangles.len();
        let parts: Vec<[Vec<RowHitCandidate>; 3]> = (0..n.div_ceil(TRIANGLE_CHUNK))
            .into_par_iter()
            .map(|i| {
                let mut found: [Vec<RowHitCandidate>; 3] = Default::default();
                let start = triangles.start + i * TRIANGLE_CHUNK;
                for triangle in start..(start + TRIANGLE_CHUNK).min(triangles.end) {
                    self.find_in_triangle(triangle, &mut found);
                }
                found
            })
            .collect();
        // Concatenated in the order of the triangles.
        let mut all: [Vec<RowHitCandidate>; 3] = Default::default();
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

    /// Returns the number of rows near the triangle's bounds, along all three axes.
    fn n_rows(&self, triangle: usize) -> u64 {
        let points = self.points(triangle);
        let along_axis = |w: usize| {
            let [j, k] = self.rows(w, &points)?;
            Some(((j.end - j.start) * (k.end - k.start)) as u64)
        };
        (0..3).filter_map(along_axis).sum()
    }

    /// Returns the ranges of j and k of the brick's rows near the bounds of some points. Rows are
    /// numbered by the cells of the grid.
    fn rows(&self, w: usize, points: &[[i32; 3]; 3]) -> Option<[Range<i64>; 2]> {
        let axis_frame = &self.axis_frames[w];
        let bits = self.mesh.lattice().bits();
        let range = |across: usize| {
            let axis = axis_frame.axes[across];
            let [a, b, c] = points.map(|p| p[axis]);
            let low = i64::from(a.min(b).min(c)) - self.margins[w];
            let high = i64::from(a.max(b).max(c)) + self.margins[w];
            let first = i64::from(axis_frame.first[across]);
            let end = first + i64::from(axis_frame.cells[across]);
            let start = ((low + (1 << bits) - 1) >> bits).max(first);
            let range = start..((high >> bits) + 1).min(end);
            (!range.is_empty()).then_some(range)
        };
        Some([range(1)?, range(2)?])
    }

    fn find_in_triangle(&self, triangle: usize, found: &mut [Vec<RowHitCandidate>; 3]) {
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

    /// Returns the position of a row's line in (v, w), in lattice steps.
    fn line(&self, [j, k]: [i64; 2]) -> [i64; 2] {
        let bits = self.mesh.lattice().bits();
        [j << bits, k << bits]
    }

    /// Whether the row's line goes through the triangle or comes within the margin of it.
    fn is_near(&self, w: usize, points: &[[i32; 3]; 3], normal: [i64; 3], row: [i64; 2]) -> bool {
        let [u, v, _] = self.axis_frames[w].axes;
        let [j, k] = self.line(row);
        let across = points.map(|p| [p[v], p[w]].map(i64::from));
        // An edge function per edge: not outside any edge by more than the margin.
        (0..3).all(|i| {
            let [a, b] = [across[i], across[(i + 1) % 3]];
            let edge = [b[0] - a[0], b[1] - a[1]];
            let area = edge[0] * (k - a[1]) - edge[1] * (j - a[0]);
            let inward = if normal[u] < 0 { -area } else { area };
            inward > -self.margins[w] * (edge[0].abs() + edge[1].abs())
        })
    }

    fn candidate(
        &self,
        w: usize,
        triangle: usize,
        normal: [i64; 3],
        row: [i64; 2],
    ) -> RowHitCandidate {
        let axis_frame = &self.axis_frames[w];
        let v = axis_frame.axes[1];
        let corners = self.mesh.triangles()[triangle];
        let points = self.points(triangle);
        let line = self.line(row);
        let mut edges = 0;
        for i in 0..3 {
            let next = (i + 1) % 3;
            // Oriented from the lower to the higher vertex, as in `crossings.wgsl`.
            let is_reversed = corners[i] > corners[next];
            let ends = if is_reversed { [next, i] } else { [i, next] };
            let [start, end] = ends.map(|e| [points[e][v], points[e][w]].map(i64::from));
            edges |= edge_side(start, end, line) << (2 * i) | u32::from(is_reversed) << (6 + i);
        }
        let local = |across: usize| row[across - 1] as u32 - axis_frame.first[across];
        RowHitCandidate {
            corners,
            triangle: triangle as u32,
            row: local(1) | local(2) << 16,
            column: self.column(axis_frame, &points, normal, line),
            edges,
            unused: 0,
        }
    }

    /// Returns the first column whose cells are not to the left of the point where the line meets
    /// the triangle's plane. Double precision suffices: its error is 2⁻⁵² of the triangle's size.
    fn column(
        &self,
        axis_frame: &AxisFrame,
        points: &[[i32; 3]; 3],
        n: [i64; 3],
        line: [i64; 2],
    ) -> u32 {
        let [u, v, w] = axis_frame.axes;
        let offset = |position: i64, axis: usize| (position - i64::from(points[0][axis])) as f64;
        let rise = n[v] as f64 * offset(line[0], v) + n[w] as f64 * offset(line[1], w);
        let points_u = points.map(|p| f64::from(p[u]));
        let low = points_u[0].min(points_u[1]).min(points_u[2]);
        let high = points_u[0].max(points_u[1]).max(points_u[2]);
        let hit_u = match n[u] {
            // The line lies in the triangle's plane, where any point serves.
            0 => (low + high) / 2.0,
            n_u => (points_u[0] - rise / n_u as f64).clamp(low, high),
        };
        let cells = hit_u / f64::from(1_u32 << self.mesh.lattice().bits());
        let column = cells.ceil() - f64::from(axis_frame.first[0]);
        column.clamp(0.0, f64::from(axis_frame.cells[0])) as u32
    }
}

/// Returns the side of a row's line on which an edge passes, in (v, w). The edge runs from its
/// lower vertex `start` to its higher vertex `end`. This is `is_above` of `integers.wgsl` except
/// for `up`, which depends on the ranks.
fn edge_side(start: [i64; 2], end: [i64; 2], line: [i64; 2]) -> u32 {
    let delta = [end[0] - start[0], end[1] - start[1]];
    let to_row = [line[0] - start[0], line[1] - start[1]];
    if to_row[1] < delta[1].min(0) {
        ABOVE
    } else if to_row[1] > delta[1].max(0) {
        BELOW
    } else if delta[0] * to_row[1] >= delta[1] * to_row[0] {
        ABOVE_IF_DOWN
    } else {
        ABOVE_IF_UP
    }
}
