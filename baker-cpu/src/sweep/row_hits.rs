//! Row hits: the points where the line of a row meets a triangle. There the triangle's layer
//! changes from above the row to below it, or back.

use std::ops::Range;

use aogrid_bake_core::PreparedMesh;
use aogrid_bake_core::sweep::{AxisFrame, LANES, RowClass, RowSearch};
use rayon::prelude::*;

use super::data::{
    Batch, DeltaBuffer, End, FacingInterval, LaneDeltas, Line, Tile, first_columns, row_side,
};

/// A triangle and a row whose line meets it well away from its edges, and so in every batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct CertainHit {
    k: u32,
    j: u32,
    triangle: u32,
    /// The first cell to the right of the point.
    column: u32,
    /// Whether the normal points to the left, against u.
    left: bool,
}

/// A triangle and a row whose line passes one of its edges so closely that rounding in a batch may
/// put it on either side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct NearEdgeHit {
    k: u32,
    j: u32,
    triangle: u32,
}

/// All row hits along one axis, ordered by k.
#[derive(Debug, Default)]
pub(super) struct RowHits {
    certain: Vec<CertainHit>,
    near_edge: Vec<NearEdgeHit>,
}

/// The number of triangles in one unit of a thread's work.
const TRIANGLE_CHUNK: usize = 1 << 13;

impl RowHits {
    /// Finds the row hits along each axis.
    pub(super) fn all(mesh: &PreparedMesh, frames: &[AxisFrame; 3]) -> [Self; 3] {
        let searches = [0, 1, 2].map(|w| RowSearch::new(mesh, &frames[w]));
        let search = |(chunk, triangles): (usize, &[[u32; 3]])| {
            let mut found = <[Self; 3]>::default();
            for (triangle, &corners) in ((chunk * TRIANGLE_CHUNK) as u32..).zip(triangles) {
                find_hits(mesh, triangle, corners, &searches, &mut found);
            }
            found
        };
        let chunks: Vec<_> = mesh
            .triangles()
            .par_chunks(TRIANGLE_CHUNK)
            .enumerate()
            .map(search)
            .collect();
        let mut all = <[Self; 3]>::default();
        for chunk in chunks {
            for (all, found) in all.iter_mut().zip(chunk) {
                all.certain.extend(found.certain);
                all.near_edge.extend(found.near_edge);
            }
        }
        for all in &mut all {
            // Sorted by k, so that each tile finds its own hits by bisection.
            all.certain.sort_unstable();
            all.near_edge.sort_unstable();
        }
        all
    }

    /// Moves the layer of each hit triangle from one side of the row to the other.
    #[inline(always)]
    pub(super) fn accumulate(
        &self,
        batch: &Batch<'_>,
        tile: &Tile,
        facing: impl Fn(u32) -> FacingInterval,
        corners: impl Fn(u32) -> [(u32, End); 3],
        deltas: &mut DeltaBuffer,
    ) {
        let in_tile = |k: u32| tile.k.contains(&k);
        let start = self.certain.partition_point(|p| p.k < tile.k.start);
        for p in self.certain[start..].iter().take_while(|p| in_tile(p.k)) {
            if let Some(row) = tile.row(p.j, p.k) {
                // Going around a triangle with its normal to the right, the edge above the row goes
                // down: its delta is the facing itself.
                move_layer(row, p.column, facing(p.triangle), p.left, batch, deltas);
            }
        }
        let start = self.near_edge.partition_point(|p| p.k < tile.k.start);
        for p in self.near_edge[start..].iter().take_while(|p| in_tile(p.k)) {
            if let Some(row) = tile.row(p.j, p.k) {
                accumulate_near_edge(row, batch, facing(p.triangle), corners(p.triangle), deltas);
            }
        }
    }
}

/// Undoes, from `column` on, what the edge above the row added above it and what the edge below
/// added below it, which is the opposite. `up` is the direction of the edge above.
#[inline(always)]
fn move_layer(
    row: u32,
    column: u32,
    facing: FacingInterval,
    up: bool,
    batch: &Batch<'_>,
    deltas: &mut DeltaBuffer,
) {
    for block in 0..batch.slopes.len() {
        for side in [0, 1] {
            let lanes = LaneDeltas::new([facing; 2], up == (side == 1), batch.frame, block);
            deltas.push_at_column((row, block as u32), side, column, lanes);
        }
    }
}

/// Moves the layer if the crossings counted the triangle's edges on different sides of the row. It
/// evaluates the same expression as they do.
fn accumulate_near_edge(
    row: u32,
    batch: &Batch<'_>,
    facing: FacingInterval,
    corners: [(u32, End); 3],
    deltas: &mut DeltaBuffer,
) {
    let (level, number) = batch.levels.level_of_row(row);
    // For each side of the row: u and height of the crossing, and whether its edge goes up.
    let mut crossings: [Option<([f32; 2], bool)>; 2] = [None; 2];
    for i in 0..3 {
        let ((a, from), (b, to)) = (corners[i], corners[(i + 1) % 3]);
        let up = from.rank < to.rank;
        let [low, high] = [from.rank.min(to.rank), from.rank.max(to.rank)];
        if number < low || number >= high {
            continue;
        }
        let [from, to] = if a < b { [from, to] } else { [to, from] };
        let crossing = Line::new(from, to, batch.levels).at(&level);
        crossings[row_side(crossing[1])] = Some((crossing, up));
    }
    if let [Some(([above_u, above], up)), Some(([below_u, below], _))] = crossings {
        // The line meets the triangle between the crossings above and below it.
        let u = above_u + (below_u - above_u) * (above / (above - below));
        let n_u = deltas.layout.n_u as f32;
        let [column, ..] = first_columns(u, 0.0, &[0.0; LANES], n_u);
        move_layer(row, column, facing, up, batch, deltas);
    }
}

/// Finds a triangle's row hits along all axes. Most triangles of a fine mesh have none.
#[inline]
fn find_hits(
    mesh: &PreparedMesh,
    triangle: u32,
    corners: [u32; 3],
    searches: &[RowSearch<'_>; 3],
    found: &mut [RowHits; 3],
) {
    let vertex = |corner: usize| mesh.vertices()[corners[corner] as usize];
    let points = [vertex(0), vertex(1), vertex(2)];
    for w in 0..3 {
        let search = &searches[w];
        let [j, k] = [search.rows(&points, 1), search.rows(&points, 2)];
        if !j.is_empty() && !k.is_empty() {
            let normal = mesh.normal(corners);
            find_in_triangle(search, triangle, &points, normal, [j, k], &mut found[w]);
        }
    }
}

/// Finds the hits of a triangle among the rows of two ranges.
fn find_in_triangle(
    search: &RowSearch<'_>,
    triangle: u32,
    points: &[[i32; 3]; 3],
    normal: [i64; 3],
    [j_range, k_range]: [Range<i32>; 2],
    found: &mut RowHits,
) {
    for k in k_range {
        for j in j_range.clone() {
            let line = search.line([j, k]);
            let class = search.classify(points, normal, line);
            let [j, k] = [j as u32, k as u32];
            match class {
                RowClass::Outside => {}
                RowClass::NearEdge => found.near_edge.push(NearEdgeHit { k, j, triangle }),
                RowClass::Inside => found.certain.push(CertainHit {
                    k,
                    j,
                    triangle,
                    column: search.column(points, normal, line),
                    left: normal[search.frame().axes[0]] < 0,
                }),
            }
        }
    }
}
