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
use aogrid_bake_core::sweep::{AxisFrame, RowClass, RowSearch};
use rayon::prelude::*;

use super::gpu_data::RowHitCandidate;
use super::plan::Brick;

/// The side of a row on which an edge passes, see `row_hits.wgsl`.
pub(super) const ABOVE: u32 = 0;
const BELOW: u32 = 1;
pub(super) const ABOVE_IF_UP: u32 = 2;
pub(super) const ABOVE_IF_DOWN: u32 = 3;

/// The largest number of (row, triangle) pairs that are tested for one buffer of candidates.
const MAX_BATCH_PAIRS: u64 = 1 << 21;

/// The number of triangles that a thread takes at a time.
const TRIANGLE_CHUNK: usize = 4096;

/// A search for candidates among a mesh and the rows of a brick along all three axes.
pub(super) struct RowHitSearch<'a> {
    mesh: &'a PreparedMesh,
    axis_frames: [AxisFrame; 3],
}

impl<'a> RowHitSearch<'a> {
    pub(super) fn new(mesh: &'a PreparedMesh, brick: &Brick, size: u32) -> Self {
        Self {
            mesh,
            axis_frames: [0, 1, 2].map(|w| brick.frame(mesh.spec(), w, size)),
        }
    }

    /// Returns the searches along each axis.
    fn searches(&self) -> [RowSearch<'_>; 3] {
        self.axis_frames
            .each_ref()
            .map(|frame| RowSearch::new(self.mesh, frame))
    }

    /// Returns ranges of triangles whose candidates fit a buffer; mostly one.
    pub(super) fn batches(&self) -> Vec<Range<usize>> {
        let n = self.mesh.triangles().len();
        let searches = self.searches();
        let chunk = |i: usize| i * TRIANGLE_CHUNK..((i + 1) * TRIANGLE_CHUNK).min(n);
        let rows: Vec<u64> = (0..n.div_ceil(TRIANGLE_CHUNK))
            .into_par_iter()
            .map(|i| {
                chunk(i)
                    .map(|triangle| self.n_rows(&searches, triangle))
                    .sum()
            })
            .collect();
        let mut batches = Vec::new();
        let mut last = 0..0;
        let mut in_batch = 0;
        for (i, rows) in rows.into_iter().enumerate() {
            // A chunk that exceeds a batch by itself is split into its triangles.
            let parts: Vec<(Range<usize>, u64)> = match rows > MAX_BATCH_PAIRS {
                false => vec![(chunk(i), rows)],
                true => chunk(i)
                    .map(|t| (t..t + 1, self.n_rows(&searches, t)))
                    .collect(),
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
        let searches = self.searches();
        let parts: Vec<[Vec<RowHitCandidate>; 3]> = (0..n.div_ceil(TRIANGLE_CHUNK))
            .into_par_iter()
            .map(|i| {
                let mut found: [Vec<RowHitCandidate>; 3] = Default::default();
                let start = triangles.start + i * TRIANGLE_CHUNK;
                for triangle in start..(start + TRIANGLE_CHUNK).min(triangles.end) {
                    self.find_in_triangle(&searches, triangle, &mut found);
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
    fn n_rows(&self, searches: &[RowSearch<'_>; 3], triangle: usize) -> u64 {
        let points = self.points(triangle);
        let along_axis = |search: &RowSearch<'_>| {
            let [j, k] = [1, 2].map(|across| search.rows(&points, across).len() as u64);
            j * k
        };
        searches.iter().map(along_axis).sum()
    }

    fn find_in_triangle(
        &self,
        searches: &[RowSearch<'_>; 3],
        triangle: usize,
        found: &mut [Vec<RowHitCandidate>; 3],
    ) {
        let points = self.points(triangle);
        for (search, found) in searches.iter().zip(found) {
            let [j_range, k_range] = [1, 2].map(|across| search.rows(&points, across));
            if j_range.is_empty() || k_range.is_empty() {
                continue;
            }
            let normal = self.mesh.normal(self.mesh.triangles()[triangle]);
            for k in k_range {
                for j in j_range.clone() {
                    let class = search.classify(&points, normal, search.line([j, k]));
                    if class != RowClass::Outside {
                        found.push(self.candidate(search, triangle, normal, [j, k]));
                    }
                }
            }
        }
    }

    fn candidate(
        &self,
        search: &RowSearch<'_>,
        triangle: usize,
        normal: [i64; 3],
        row: [i32; 2],
    ) -> RowHitCandidate {
        let frame = search.frame();
        let [_, v, w] = frame.axes;
        let corners = self.mesh.triangles()[triangle];
        let points = self.points(triangle);
        let line = search.line(row);
        let mut edges = 0;
        for i in 0..3 {
            let next = (i + 1) % 3;
            // Oriented from the lower to the higher vertex, as in `crossings.wgsl`.
            let is_reversed = corners[i] > corners[next];
            let ends = if is_reversed { [next, i] } else { [i, next] };
            let [start, end] = ends.map(|e| [points[e][v], points[e][w]].map(i64::from));
            edges |= edge_side(start, end, line) << (2 * i) | u32::from(is_reversed) << (6 + i);
        }
        let local = |across: usize| row[across - 1] as u32 - frame.first[across];
        RowHitCandidate {
            corners,
            triangle: triangle as u32,
            row: local(1) | local(2) << 16,
            column: search.column(&points, normal, line),
            edges,
            unused: 0,
        }
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
