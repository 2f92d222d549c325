//! Piercings: where the line of a row itself passes through a triangle, whose layer is above
//! the row on one side of that point and below on the other.

use std::ops::Range;

use aogrid_bake_core::PreparedMesh;
use rayon::prelude::*;

use super::counters::Tile;
use super::crossings::{Batch, End, Line, first_columns, side};
use super::frame::{Frame, LANES};
use super::silhouettes::Facing;
use super::steps::{Lanes, Steps};

/// How near, in cells, a row's line must come to an edge for batches to be asked one by one.
/// It has to exceed what rounding can do to a vertex's rank, see [`margin`]; more costs time.
const NEAR: f64 = 1.0 / 1024.0;

/// What rounding does to V − b·W, over the largest coordinates: a product and a difference,
/// half a step of 2⁻²³ each, and as much again for the levels; eight times for safety.
const ROUNDING: f64 = 8.0 / (1 << 22) as f64;

/// A triangle and a row whose line it meets, clear of its edges: so in every batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Clear {
    k: u32,
    j: u32,
    triangle: u32,
    /// The first cell to the right of the point.
    column: u32,
    /// Whether the normal points to the left, against u.
    left: bool,
}

/// A triangle and a row whose line passes one of its edges so closely that rounding in a
/// batch may put it on either side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Tight {
    k: u32,
    j: u32,
    triangle: u32,
}

/// All piercings along one axis, ordered by k.
#[derive(Debug, Default)]
pub(super) struct Piercings {
    clear: Vec<Clear>,
    tight: Vec<Tight>,
}

/// Triangles that a thread looks at in one piece.
const AT_ONCE: usize = 1 << 13;

impl Piercings {
    /// Those along each axis, of which there is a frame.
    pub(super) fn all(mesh: &PreparedMesh, frames: &[Frame; 3]) -> [Self; 3] {
        let searches = [0, 1, 2].map(|w| Search::new(mesh, &frames[w]));
        let search = |(piece, triangles): (usize, &[[u32; 3]])| {
            let mut found = <[Self; 3]>::default();
            for (triangle, &corners) in ((piece * AT_ONCE) as u32..).zip(triangles) {
                find(mesh, triangle, corners, &searches, &mut found);
            }
            found
        };
        let pieces: Vec<_> = mesh
            .triangles()
            .par_chunks(AT_ONCE)
            .enumerate()
            .map(search)
            .collect();
        let mut all = <[Self; 3]>::default();
        for piece in pieces {
            for (all, found) in all.iter_mut().zip(piece) {
                all.clear.extend(found.clear);
                all.tight.extend(found.tight);
            }
        }
        for all in &mut all {
            all.clear.sort_unstable();
            all.tight.sort_unstable();
        }
        all
    }

    /// Moves each layer from one side of its row to the other.
    #[inline(always)]
    pub(super) fn count(
        &self,
        batch: &Batch<'_>,
        tile: &Tile,
        facing: impl Fn(u32) -> Facing,
        corners: impl Fn(u32) -> [(u32, End); 3],
        steps: &mut Steps,
    ) {
        let of_tile = |k: u32| tile.k.contains(&k);
        let start = self.clear.partition_point(|p| p.k < tile.k.start);
        for p in self.clear[start..].iter().take_while(|p| of_tile(p.k)) {
            if let Some(row) = tile.row(p.j, p.k) {
                // Going around a triangle with its normal to the right, the edge above the
                // row goes down: its step is the facing itself.
                shift(row, p.column, facing(p.triangle), p.left, batch, steps);
            }
        }
        let start = self.tight.partition_point(|p| p.k < tile.k.start);
        for p in self.tight[start..].iter().take_while(|p| of_tile(p.k)) {
            if let Some(row) = tile.row(p.j, p.k) {
                tight(row, batch, facing(p.triangle), corners(p.triangle), steps);
            }
        }
    }
}

/// From `column` on takes from above the row what the edge above it added, and from below what
/// the edge below it added, which is the opposite. `up` is the direction of the edge above.
#[inline(always)]
fn shift(row: u32, column: u32, facing: Facing, up: bool, batch: &Batch<'_>, steps: &mut Steps) {
    for block in 0..batch.slopes.len() {
        for side in [0, 1] {
            let taken = Lanes::new([facing; 2], up == (side == 1), batch.frame, block);
            steps.add_all((row, block as u32), side, column, taken);
        }
    }
}

/// Asks what the edges' crossings were counted as: on different sides of the row or not.
fn tight(row: u32, batch: &Batch<'_>, facing: Facing, corners: [(u32, End); 3], steps: &mut Steps) {
    let (level, number) = batch.levels.of_row(row);
    // On each side of the row: u and height of the crossing, and whether its edge goes up.
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
        crossings[side(crossing[1])] = Some((crossing, up));
    }
    if let [Some(([above_u, above], up)), Some(([below_u, below], _))] = crossings {
        let u = above_u + (below_u - above_u) * (above / (above - below));
        let n_u = steps.layout.n_u as f32;
        let [column, ..] = first_columns(u, 0.0, &[0.0; LANES], n_u);
        shift(row, column, facing, up, batch, steps);
    }
}

/// Finds a triangle's piercings along all axes: none, for most triangles of a fine mesh.
#[inline]
fn find(
    mesh: &PreparedMesh,
    triangle: u32,
    corners: [u32; 3],
    searches: &[Search<'_>; 3],
    found: &mut [Piercings; 3],
) {
    let vertex = |corner: usize| mesh.vertices()[corners[corner] as usize];
    let points = [vertex(0), vertex(1), vertex(2)];
    for w in 0..3 {
        let search = &searches[w];
        let [j, k] = [search.rows(&points, 1), search.rows(&points, 2)];
        if !j.is_empty() && !k.is_empty() {
            search.triangle(triangle, &points, [j, k], &mut found[w]);
        }
    }
}

/// The lines of an axis' rows against triangles, in exact integers.
struct Search<'a> {
    mesh: &'a PreparedMesh,
    frame: &'a Frame,
    bits: u32,
    /// In steps of the lattice.
    margin: i32,
}

/// The distance from an edge, in cells, beyond which no rounding in any batch can make the
/// line of a row pass on the edge's other side.
fn margin(mesh: &PreparedMesh, frame: &Frame) -> f64 {
    let reach = mesh.lattice().reach();
    NEAR.max(ROUNDING * (reach + frame.shear[1] * reach))
}

impl<'a> Search<'a> {
    fn new(mesh: &'a PreparedMesh, frame: &'a Frame) -> Self {
        let bits = mesh.lattice().bits();
        let margin = (margin(mesh, frame) * f64::from(1_u32 << bits)).ceil() as i32;
        Self {
            mesh,
            frame,
            bits,
            margin,
        }
    }

    fn triangle(
        &self,
        triangle: u32,
        points: &[[i32; 3]; 3],
        [j_range, k_range]: [Range<i32>; 2],
        found: &mut Piercings,
    ) {
        let normal = self.mesh.normal(self.mesh.triangles()[triangle as usize]);
        for k in k_range {
            for j in j_range.clone() {
                let at = [i64::from(j) << self.bits, i64::from(k) << self.bits];
                let distance = self.distance(points, normal[self.frame.u], at);
                let [j, k] = [j as u32, k as u32];
                match distance {
                    d if d <= -1 => {}
                    0 => found.tight.push(Tight { k, j, triangle }),
                    _ => found.clear.push(Clear {
                        k,
                        j,
                        triangle,
                        column: self.column(points, normal, at),
                        left: normal[self.frame.u] < 0,
                    }),
                }
            }
        }
    }

    /// The rows, along v (1) or w (2), whose lines come near the triangle's bounds.
    #[inline(always)]
    fn rows(&self, points: &[[i32; 3]; 3], across: usize) -> Range<i32> {
        let axis = [self.frame.u, self.frame.v, self.frame.w][across];
        let at = [points[0][axis], points[1][axis], points[2][axis]];
        let low = at[0].min(at[1]).min(at[2]) - self.margin;
        let high = at[0].max(at[1]).max(at[2]) + self.margin;
        let first = (low + ((1 << self.bits) - 1)) >> self.bits;
        let last = high >> self.bits;
        first.max(0)..last.saturating_add(1).min(self.frame.n[across] as i32)
    }

    /// 1: within the triangle by the margin; −1: outside by the margin; 0: neither.
    fn distance(&self, points: &[[i32; 3]; 3], n_u: i64, [j, k]: [i64; 2]) -> i32 {
        let mut least = 1;
        for i in 0..3 {
            let [a, b] = [points[i], points[(i + 1) % 3]]
                .map(|p| [p[self.frame.v], p[self.frame.w]].map(i64::from));
            let along = [b[0] - a[0], b[1] - a[1]];
            let area = along[0] * (k - a[1]) - along[1] * (j - a[0]);
            let inward = if n_u < 0 { -area } else { area };
            let margin = i64::from(self.margin) * (along[0].abs() + along[1].abs());
            let class = i32::from(inward >= margin) - i32::from(inward <= -margin);
            least = least.min(class);
        }
        // Without an area across there is no inside.
        if n_u == 0 { least.min(0) } else { least }
    }

    /// The first column whose cells are not to the left of the point where the line meets the
    /// triangle's plane. In double precision: 2⁻⁵² of the triangle's size is nothing.
    fn column(&self, points: &[[i32; 3]; 3], normal: [i64; 3], [j, k]: [i64; 2]) -> u32 {
        let Frame { u, v, w, .. } = *self.frame;
        let [n_u, n_v, n_w] = [u, v, w].map(|axis| normal[axis] as f64);
        let from = |at: i64, axis: usize| (at - i64::from(points[0][axis])) as f64;
        let rise = (n_v * from(j, v) + n_w * from(k, w)) / n_u;
        let at = (f64::from(points[0][u]) - rise) / f64::from(1_u32 << self.bits);
        at.ceil().clamp(0.0, f64::from(self.frame.n[0])) as u32
    }
}
