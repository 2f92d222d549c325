//! Crossings: where edges pass through the plane of a row, and the cells from which on that
//! matters.

use aogrid_bake_core::PreparedMesh;

use super::counters::Tile;
use super::frame::{Frame, LANES};
use super::levels::{Levels, RowLevel};
use super::silhouettes::{Facing, List, Sides};
use super::steps::{Lanes, Steps};

/// An end of an edge as one batch sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    pub rank: i32,
    /// In cells.
    pub u: f32,
    pub v: f32,
    pub w: f32,
}

/// An edge, from its first end to its second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    u: f32,
    w: f32,
    q: f32,
    per_level: [f32; 2],
}

impl Line {
    /// The ends have different ranks, so that they differ in q.
    #[inline(always)]
    pub(super) fn new(from: End, to: End, levels: &Levels) -> Self {
        let q = levels.q(from.v, from.w);
        let inverse = 1.0 / (levels.q(to.v, to.w) - q);
        Self {
            u: from.u,
            w: from.w,
            q,
            per_level: [(to.u - from.u) * inverse, (to.w - from.w) * inverse],
        }
    }

    /// How near a whole number a column must be to be found again in double precision:
    /// `rounding` is that of a level, and of the place where the edge crosses it as many times more
    /// as it changes with the level.
    #[inline(always)]
    pub(super) fn near(&self, rounding: f32) -> f32 {
        let [u, w] = self.per_level;
        (rounding * (1.0 + (u.abs() + w.abs()))).min(FARTHEST)
    }

    /// Where it crosses a level: u, and the height above the row, both in cells.
    ///
    /// Whoever asks on which side of the row an edge passes asks the sign of this height, of
    /// the edge from its lower vertex to its higher: the one expression, so that all agree.
    #[inline(always)]
    pub(super) fn at(&self, level: &RowLevel) -> [f32; 2] {
        let t = level.value - self.q;
        let [u, w] = self.per_level;
        [self.u + t * u, (self.w + t * w) - level.k]
    }
}

/// 0: above the row, 1: below. Upon the row is below.
#[inline(always)]
pub(super) fn side(height: f32) -> usize {
    usize::from(height <= 0.0)
}

impl Lanes {
    /// Of the directions of a block, from an edge's crossing on: one layer more for each of
    /// its two triangles to the right of its left edge, and one fewer to the right of its right
    /// edge. Seen along d, a triangle with n·d > 0 has its edges that go `up` (in V − b·W) at
    /// its right. A lone triangle is given twice.
    #[inline(always)]
    pub(super) fn new(sides: [Facing; 2], up: bool, frame: &Frame, block: usize) -> Self {
        let [one, other] = [sides[0].towards(block), sides[1].towards(block)];
        let steps = !(one ^ other) & frame.lanes(block);
        let fewer = if up { one } else { !one };
        Self { steps, fewer }
    }
}

/// 2²³: adding it to a float in 0..2²² leaves the nearest whole number in the lowest bits.
const WHOLE: f32 = (1 << 23) as f32;
const MANTISSA: u32 = (1 << 23) - 1;

/// The first column that a step at `u`, `height` above the row, changes, for each direction:
/// the least whole number not below u − height·slope, from 0 to `n_u`, which is nowhere.
#[inline(always)]
pub(super) fn first_columns(u: f32, height: f32, slopes: &[f32; LANES], n_u: f32) -> [u32; LANES] {
    let mut columns = [0; LANES];
    for (column, slope) in columns.iter_mut().zip(slopes) {
        let at = (u - height * slope).max(0.0).min(n_u);
        let nearest = at + WHOLE;
        let below = nearest - WHOLE < at;
        *column = (nearest.to_bits() & MANTISSA) + u32::from(below);
    }
    columns
}

/// What a batch counts with.
#[derive(Clone, Copy)]
pub(super) struct Batch<'a> {
    pub mesh: &'a PreparedMesh,
    pub frame: &'a Frame,
    pub tile: &'a Tile,
    /// The face's row.
    pub b: u32,
    /// Of the vertices, in cells.
    pub positions: &'a [[f32; 3]],
    pub levels: &'a Levels,
    /// Of each block.
    pub slopes: &'a [[f32; LANES]],
}

impl Batch<'_> {
    #[inline(always)]
    pub(super) fn end(&self, vertex: u32, rank: i32) -> End {
        let position = &self.positions[vertex as usize];
        let Frame { u, v, w, .. } = *self.frame;
        End {
            rank,
            u: position[u],
            v: position[v],
            w: position[w],
        }
    }

    /// How far single floats may be off where an edge passes a row, in cells, for an edge
    /// along which u and w do not change with the level: see [`Line::near`].
    pub(super) fn rounding(&self) -> f32 {
        let [across_u, across_v] = self.frame.shear;
        let reach = self.mesh.lattice().reach();
        (ROUNDING * reach * (1.0 + across_u) * (1.0 + across_v)) as f32
    }

    /// [`first_columns`] of one direction from an edge's vertices, in double precision.
    #[cold]
    #[inline(never)]
    pub(super) fn exact_column(&self, vertices: [u32; 2], row: u32, z: u32) -> u32 {
        let Frame { u, v, w, n, .. } = *self.frame;
        let cell = f64::from(1_u32 << self.mesh.lattice().bits());
        let [from, to] = vertices.map(|vertex| {
            let place = self.mesh.vertices()[vertex as usize];
            [u, v, w].map(|axis| f64::from(place[axis]) / cell)
        });
        let slope = self.frame.row_slope(self.b);
        let width = self.tile.j.len() as u32;
        let j = f64::from(self.tile.j.start + row % width);
        let k = f64::from(self.tile.k.start + row / width);
        let q = |p: [f64; 3]| p[1] - slope * p[2];
        let between = q(to) - q(from);
        // Ranks are of single floats: an edge may not quite reach the level.
        let t = ((j - slope * k - q(from)) / between).clamp(0.0, 1.0);
        // Level with the row, or so nearly that all its points are as good.
        let t = if t.is_nan() { 0.0 } else { t };
        let at = |axis: usize| from[axis] + t * (to[axis] - from[axis]);
        let column = at(0) - (at(2) - k) * self.frame.column_slope(z);
        column.ceil().clamp(0.0, f64::from(n[0])) as u32
    }
}

/// Over the largest coordinates, (1 + shear) · reach: V − b·W, a level, and their difference are
/// each off by 2⁻²⁴ of those, the change of u and w with the level by as much of itself twice (a
/// difference, a quotient), and u, the height, and u − height·a once more. Eight in all.
const ROUNDING: f64 = 8.0 / (1 << 24) as f64;

/// In cells: beyond all columns, and far from where machines cannot round to whole numbers.
pub(super) const FARTHEST: f32 = (1 << 20) as f32;

/// Edges that a thread collects before it counts them.
const COLLECTED: usize = 256;

/// Edges that cross levels, in arrays.
#[repr(C, align(64))]
pub(super) struct Edges {
    /// The lower vertices, and the higher.
    pub vertices: [[u32; COLLECTED]; 2],
    /// Of the vertices.
    pub ranks: [[i32; COLLECTED]; 2],
    pub sides: [Sides; COLLECTED],
    pub n: usize,
}

impl Default for Edges {
    fn default() -> Self {
        Self {
            vertices: [[0; COLLECTED]; 2],
            ranks: [[0; COLLECTED]; 2],
            sides: [Sides::default(); COLLECTED],
            n: 0,
        }
    }
}

impl Edges {
    #[inline(always)]
    pub(super) fn has_room(&self, n: usize) -> bool {
        self.n + n <= COLLECTED
    }

    /// Adds an edge, if it crosses a level. There is room. That is hard to foretell, and
    /// therefore done without a branch.
    #[inline(always)]
    pub(super) fn push(&mut self, vertices: [u32; 2], ranks: &[i32], sides: Sides) {
        let n = self.n & (COLLECTED - 1);
        let [a, b] = vertices;
        let [from, to] = [ranks[a as usize], ranks[b as usize]];
        self.vertices[0][n] = a;
        self.vertices[1][n] = b;
        self.ranks[0][n] = from;
        self.ranks[1][n] = to;
        self.sides[n] = sides;
        self.n += usize::from(from != to);
    }
}

/// Collects those of some silhouettes of two triangles that cross a level. There is room.
#[inline(always)]
pub(super) fn collect(row: &Row<'_>, edges: &mut Edges) {
    for (&vertices, &sides) in row.vertices.iter().zip(row.sides) {
        edges.push(vertices, row.ranks, sides);
    }
}

/// Up to [`AT_ONCE`] silhouettes of a face's row.
pub(super) struct Row<'a> {
    pub vertices: &'a [[u32; 2]],
    pub sides: &'a [Sides],
    /// Of all vertices.
    pub ranks: &'a [i32],
}

impl<'a> Row<'a> {
    /// Those of a list from a place on, and the number of the next.
    pub(super) fn new(list: &'a List, first: usize, ranks: &'a [i32]) -> (Self, usize) {
        let next = (first + AT_ONCE).min(list.sides.len());
        let row = Self {
            vertices: &list.vertices[first..next],
            sides: &list.sides[first..next],
            ranks,
        };
        (row, next)
    }

    /// Without the first `n`.
    #[cfg(target_arch = "x86_64")]
    pub(super) fn after(&self, n: usize) -> Self {
        Self {
            vertices: &self.vertices[n..],
            sides: &self.sides[n..],
            ranks: self.ranks,
        }
    }
}

/// Edges that are collected at once.
pub(super) const AT_ONCE: usize = 64;

/// Counts each edge at every row that it crosses, `unit` for each layer. This is what faster
/// ways have to agree with.
#[inline(always)]
pub(super) fn count(batch: &Batch<'_>, edges: &Edges, unit: i8, steps: &mut Steps) {
    let n_u = steps.layout.n_u as f32;
    let rounding = batch.rounding();
    for n in 0..edges.n {
        let [from, to] = [edges.ranks[0][n], edges.ranks[1][n]];
        let ends = [
            batch.end(edges.vertices[0][n], from),
            batch.end(edges.vertices[1][n], to),
        ];
        let sides = edges.sides[n].facings();
        let line = Line::new(ends[0], ends[1], batch.levels);
        let near = line.near(rounding);
        for (block, slopes) in batch.slopes.iter().enumerate() {
            let lanes = Lanes::new(sides, from < to, batch.frame, block);
            if lanes.steps == 0 {
                continue;
            }
            for level in batch.levels.between(from.min(to), from.max(to)) {
                let [u, height] = line.at(&level);
                let mut columns = first_columns(u - near, height, slopes, n_u);
                let last = first_columns(u + near, height, slopes, n_u);
                if columns != last {
                    let vertices = [edges.vertices[0][n], edges.vertices[1][n]];
                    for (lane, column) in columns.iter_mut().enumerate() {
                        if *column != last[lane] {
                            let z = (block * LANES + lane) as u32;
                            *column = batch.exact_column(vertices, level.row, z);
                        }
                    }
                }
                let at = (level.row, block as u32);
                steps.add(at, side(height), &columns, lanes, unit);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_rounded_up_and_kept_in_the_grid() {
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
