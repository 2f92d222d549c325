//! Piercings: where the line of a row itself passes through a triangle, whose layer is above
//! the row on one side of that point and below on the other.

use aogrid_bake_core::PreparedMesh;
use rayon::prelude::*;

use super::counters::{Counter, Counters};
use super::crossings::{Batch, Deltas, End, Line, columns, side};
use super::frame::{Frame, LANES};
use super::silhouettes::Facing;

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

impl Piercings {
    pub(super) fn new(mesh: &PreparedMesh, frame: &Frame) -> Self {
        let search = Search::new(mesh, frame);
        let add = |mut found: Self, triangle: u32| {
            search.triangle(triangle, &mut found);
            found
        };
        let merge = |mut one: Self, other: Self| {
            one.clear.extend(other.clear);
            one.tight.extend(other.tight);
            one
        };
        let n = mesh.triangles().len() as u32;
        let mut all = (0..n)
            .into_par_iter()
            .with_min_len(4096)
            .fold(Self::default, add)
            .reduce(Self::default, merge);
        all.clear.sort_unstable();
        all.tight.sort_unstable();
        all
    }

    /// Moves each layer from one side of its row to the other.
    pub(super) fn count<C: Counter>(
        &self,
        batch: &Batch<'_>,
        facing: impl Fn(u32) -> Facing,
        corners: impl Fn(u32) -> [(u32, End); 3],
        counters: &mut Counters<'_, C>,
    ) {
        let tile = counters.tile;
        let of_tile = |k: u32| tile.k.contains(&k);
        let start = self.clear.partition_point(|p| p.k < tile.k.start);
        for p in self.clear[start..].iter().take_while(|p| of_tile(p.k)) {
            if let Some(row) = tile.row(p.j, p.k) {
                // Going around a triangle with its normal to the right, the edge above the
                // row goes down: its step is the facing itself.
                let facing = [facing(p.triangle)];
                shift(row, p.column, &facing, p.left, batch, counters);
            }
        }
        let start = self.tight.partition_point(|p| p.k < tile.k.start);
        for p in self.tight[start..].iter().take_while(|p| of_tile(p.k)) {
            if let Some(row) = tile.row(p.j, p.k) {
                tight(
                    p,
                    row,
                    batch,
                    facing(p.triangle),
                    corners(p.triangle),
                    counters,
                );
            }
        }
    }
}

/// From `column` on takes from above the row what the edge above it added, and from below what
/// the edge below it added, which is the opposite. `up` is the direction of the edge above.
fn shift<C: Counter>(
    row: usize,
    column: u32,
    facing: &[Facing],
    up: bool,
    batch: &Batch<'_>,
    counters: &mut Counters<'_, C>,
) {
    for block in 0..batch.slopes.len() {
        for side in [0, 1] {
            let taken = Deltas::new(facing, up == (side == 1), batch.frame, block);
            let lanes = taken.first..taken.last;
            counters.step(row, block, side, lanes, &[column; LANES], &taken.lanes);
        }
    }
}

/// Asks what the edges' crossings were counted as: on different sides of the row or not.
fn tight<C: Counter>(
    at: &Tight,
    row: usize,
    batch: &Batch<'_>,
    facing: Facing,
    corners: [(u32, End); 3],
    counters: &mut Counters<'_, C>,
) {
    let (level, number) = batch.levels.of_row(at.j, at.k);
    // On each side of the row: u and height of the crossing, and whether its edge goes up.
    let mut crossings: [Option<([f32; 2], bool)>; 2] = [None; 2];
    for i in 0..3 {
        let ((a, from), (b, to)) = (corners[i], corners[(i + 1) % 3]);
        let up = from.ranked.rank < to.ranked.rank;
        let [low, high] = match up {
            true => [from.ranked.rank, to.ranked.rank],
            false => [to.ranked.rank, from.ranked.rank],
        };
        if number < low || number >= high {
            continue;
        }
        let line = if a < b {
            Line::new(from, to)
        } else {
            Line::new(to, from)
        };
        let crossing = line.at(&level);
        crossings[side(crossing[1])] = Some((crossing, up));
    }
    if let [Some(([above_u, above], up)), Some(([below_u, below], _))] = crossings {
        let u = above_u + (below_u - above_u) * (above / (above - below));
        let n_u = counters.layout.n_u as f32;
        let [column, ..] = columns(u, 0.0, &[0.0; LANES], n_u);
        shift(row, column, &[facing], up, batch, counters);
    }
}

/// The lines of an axis' rows against triangles, in exact integers.
struct Search<'a> {
    mesh: &'a PreparedMesh,
    frame: &'a Frame,
    bits: u32,
    /// In steps of the lattice.
    margin: i64,
}

/// The distance from an edge, in cells, beyond which no rounding in any batch can make the
/// line of a row pass on the edge's other side.
fn margin(mesh: &PreparedMesh, frame: &Frame) -> f64 {
    let reach = |axis: usize| {
        let most = mesh.triangles().par_iter().flatten_iter();
        let most = most.map(|&v| mesh.vertices()[v as usize][axis].unsigned_abs());
        f64::from(most.max().unwrap_or(0)) / f64::from(1_u32 << mesh.lattice().bits())
    };
    NEAR.max(ROUNDING * (reach(frame.v) + frame.shear[1] * reach(frame.w)))
}

impl<'a> Search<'a> {
    fn new(mesh: &'a PreparedMesh, frame: &'a Frame) -> Self {
        let bits = mesh.lattice().bits();
        let margin = (margin(mesh, frame) * f64::from(1_u32 << bits)).ceil() as i64;
        Self {
            mesh,
            frame,
            bits,
            margin,
        }
    }

    fn triangle(&self, triangle: u32, found: &mut Piercings) {
        let corners = self.mesh.triangles()[triangle as usize];
        let points = corners.map(|v| self.mesh.vertices()[v as usize]);
        let Some([j_range, k_range]) = self.rows(&points) else {
            return;
        };
        let normal = self.mesh.normal(corners);
        for k in k_range[0]..=k_range[1] {
            for j in j_range[0]..=j_range[1] {
                let at = [i64::from(j) << self.bits, i64::from(k) << self.bits];
                match self.distance(&points, normal[self.frame.u], at) {
                    d if d <= -1 => {}
                    0 => found.tight.push(Tight { k, j, triangle }),
                    _ => found.clear.push(Clear {
                        k,
                        j,
                        triangle,
                        column: self.column(&points, normal, at),
                        left: normal[self.frame.u] < 0,
                    }),
                }
            }
        }
    }

    /// The rows whose lines come near the triangle's bounds.
    fn rows(&self, points: &[[i32; 3]; 3]) -> Option<[[u32; 2]; 2]> {
        let range = |axis: usize, n: u32| {
            let at = points.map(|p| i64::from(p[axis]));
            let low = at[0].min(at[1]).min(at[2]) - self.margin;
            let high = at[0].max(at[1]).max(at[2]) + self.margin;
            let step = 1_i64 << self.bits;
            let first = ((low + step - 1) >> self.bits).max(0);
            let last = (high >> self.bits).min(i64::from(n) - 1);
            (first <= last).then_some([first as u32, last as u32])
        };
        let [_, n_v, n_w] = self.frame.n;
        Some([range(self.frame.v, n_v)?, range(self.frame.w, n_w)?])
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
            let margin = self.margin * (along[0].abs() + along[1].abs());
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
