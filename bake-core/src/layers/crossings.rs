//! Crossings: where the rays of a row pass an unbalanced edge.

use std::ops::Range;

use super::FACE_SIZE;
use super::frame::{Frame, Planes, Side};
use super::unbalanced::UnbalancedEdge;
use crate::PreparedMesh;

/// Directions (a, b, 1) of a row of texels. As many are their opposites.
const HALF: usize = FACE_SIZE as usize;

/// An unbalanced edge seen along an axis.
pub(super) struct Edge {
    from: [i64; 3],
    to: [i64; 3],
    net: i32,
}

impl Edge {
    pub(super) fn new(mesh: &PreparedMesh, frame: &Frame, edge: &UnbalancedEdge) -> Self {
        let end = |idx: usize| frame.project(&mesh.vertices()[edge.vertices[idx] as usize]);
        Self {
            from: end(0),
            to: end(1),
            net: edge.net,
        }
    }
}

/// A row whose plane an edge crosses.
pub(super) struct Crossing {
    pub j: u32,
    pub k: u32,
    /// The first of the directions for which it lies ahead: 0 for all (a, b, 1), else their
    /// opposites.
    pub first_lane: usize,
    /// For each of those, the first of the region's columns from which on the layers ahead change.
    pub columns: [u32; HALF],
    pub delta: i32,
}

/// Calls with each crossing of `edge` with a row of the layers `k`.
#[inline(always)]
pub(super) fn crossings(
    frame: &Frame,
    planes: Planes,
    edge: &Edge,
    layers: Range<u32>,
    mut found: impl FnMut(&Crossing),
) {
    let Edge { from, to, .. } = edge;
    let q = [planes.at(from[1], from[2]), planes.at(to[1], to[2])];
    // Above each end: the first row of layer k, in fractions of a row.
    let mut ends = q.map(|q| planes.first_row(q, layers.start.into()));
    for k in layers {
        let [from, to] = ends.map(|end| planes.whole(end));
        // Short edges, which are the most, lie between the rows of most layers.
        if from != to {
            let rows = from.min(to)..from.max(to);
            crossings_in_layer(frame, planes, edge, q, k, rows, &mut found);
        }
        ends = ends.map(|end| planes.next_layer(end));
    }
}

/// Calls with each crossing of `edge` with some rows of the layer `k`.
#[inline(always)]
fn crossings_in_layer(
    frame: &Frame,
    planes: Planes,
    edge: &Edge,
    q: [i64; 2],
    k: u32,
    rows: Range<i64>,
    found: &mut impl FnMut(&Crossing),
) {
    let first = rows.start.max(frame.cells[1].start.into());
    let end = rows.end.min(frame.cells[1].end.into());
    if first >= end {
        return;
    }
    let goes_up = q[0] < q[1];
    let up = if goes_up { edge.net } else { -edge.net };
    let line = Line::new(frame, edge, q);
    let side = Side::new([edge.from[1], edge.from[2]], [edge.to[1], edge.to[2]]);
    for j in first..end {
        // Seen along d, a triangle that faces d has its right edge going up: there a layer
        // ends. One that faces the row has its left edge going up: there −1 begins.
        let is_left = side.of([j << frame.bits, i64::from(k) << frame.bits]) > 0;
        let above = is_left != goes_up;
        found(&Crossing {
            j: j as u32,
            k,
            first_lane: if above { 0 } else { HALF },
            columns: line.columns(frame, planes.of_row(j, k.into()), k),
            delta: if above { -up } else { up },
        });
    }
}

/// An edge as a function of V − b·W, in cells.
struct Line {
    /// At `q`.
    u: f64,
    w: f64,
    q: i64,
    per_q: [f64; 2],
}

/// 2²³: adding it to a float in 0..2²² leaves the nearest whole number in the lowest bits.
const WHOLE: f32 = (1 << 23) as f32;
const MANTISSA: u32 = (1 << 23) - 1;

impl Line {
    #[inline(always)]
    fn new(frame: &Frame, edge: &Edge, q: [i64; 2]) -> Self {
        let cell = 1.0 / f64::from(1_u32 << frame.bits);
        let per_q = cell / (q[1] - q[0]) as f64;
        let along = |x: usize| (edge.to[x] - edge.from[x]) as f64 * per_q;
        Self {
            // Columns count from the region's first.
            u: edge.from[0] as f64 * cell - f64::from(frame.cells[0].start),
            w: edge.from[2] as f64 * cell,
            q: q[0],
            per_q: [along(0), along(2)],
        }
    }

    /// The first columns beyond the edge, in which rays from the plane `q` of layer `k` pass it.
    #[inline(always)]
    fn columns(&self, frame: &Frame, q: i64, k: u32) -> [u32; HALF] {
        let t = (q - self.q) as f64;
        let u = (self.u + t * self.per_q[0]) as f32;
        let height = (self.w + t * self.per_q[1] - f64::from(k)) as f32;
        let n_u = frame.cells[0].len() as f32;
        let mut columns = [0; HALF];
        for (column, slope) in columns.iter_mut().zip(&frame.column_slopes) {
            let at = (u - height * slope).max(0.0).min(n_u);
            let nearest = at + WHOLE;
            let below = nearest - WHOLE < at;
            *column = (nearest.to_bits() & MANTISSA) + u32::from(below);
        }
        columns
    }
}
