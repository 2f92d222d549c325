//! Crossings: the points where edges pass through the plane of a row, and the first cells that they
//! affect.

use aogrid_bake_core::PreparedMesh;
use aogrid_bake_core::sweep::{AxisFrame, LANES};

use super::counters::Tile;
use super::delta_buffer::{DeltaBuffer, LaneDeltas};
use super::levels::{Levels, RowLevel};
use super::silhouettes::{EdgeFacing, FacingInterval, SilhouetteList};

/// An end of an edge as seen by one batch.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    pub rank: i32,
    /// The position, in cells.
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
    /// Returns the line through two ends of different rank, which therefore differ in q.
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

    /// Returns the error bound of a column in cells: nearer than this to a whole number, the column
    /// is computed again in double precision. `rounding` is the error of a level; the error of the
    /// crossing point grows by as much as u and w change with the level.
    #[inline(always)]
    pub(super) fn column_error(&self, rounding: f32) -> f32 {
        let [u, w] = self.per_level;
        (rounding * (1.0 + (u.abs() + w.abs()))).min(MAX_COLUMN_ERROR)
    }

    /// Returns the point where the line crosses a level: u, and the height above the row, both in
    /// cells.
    ///
    /// All side tests use the sign of this height, with the edge oriented from its lower to its
    /// higher vertex index.
    #[inline(always)]
    pub(super) fn at(&self, level: &RowLevel) -> [f32; 2] {
        let t = level.value - self.q;
        let [u, w] = self.per_level;
        [self.u + t * u, (self.w + t * w) - level.k]
    }
}

/// Returns 0 above the row and 1 below. A height of zero counts as below.
#[inline(always)]
pub(super) fn row_side(height: f32) -> usize {
    usize::from(height <= 0.0)
}

impl LaneDeltas {
    /// Returns the layer changes from an edge's crossing on, for the directions of a block. Each of
    /// its two triangles adds a layer to the right of the triangle's left edge and removes it to
    /// the right of its right edge. Seen along d, a triangle with n·d > 0 has the edges that go
    /// `up` (in V − b·W) at its right. The triangle of a boundary edge is given twice.
    #[inline(always)]
    pub(super) fn new(
        facings: [FacingInterval; 2],
        up: bool,
        frame: &AxisFrame,
        block: usize,
    ) -> Self {
        let [one, other] = [facings[0].front_lanes(block), facings[1].front_lanes(block)];
        let active = !(one ^ other) & frame.lanes(block);
        let negative = if up { one } else { !one };
        Self { active, negative }
    }
}

/// 2²³: added to a float in 0..2²², it leaves the nearest whole number in the lowest bits.
const ROUNDING_BIAS: f32 = (1 << 23) as f32;
const MANTISSA: u32 = (1 << 23) - 1;

/// Returns, for each direction, the first column that a delta at `u`, `height` above the row,
/// changes: ⌈u − height·slope⌉, clamped to 0..=`n_u`, where `n_u` is past the last cell.
#[inline(always)]
pub(super) fn first_columns(u: f32, height: f32, slopes: &[f32; LANES], n_u: f32) -> [u32; LANES] {
    let mut columns = [0; LANES];
    for (column, slope) in columns.iter_mut().zip(slopes) {
        let at = (u - height * slope).max(0.0).min(n_u);
        let nearest = at + ROUNDING_BIAS;
        let below = nearest - ROUNDING_BIAS < at;
        *column = (nearest.to_bits() & MANTISSA) + u32::from(below);
    }
    columns
}

/// The inputs of a batch's counting.
#[derive(Clone, Copy)]
pub(super) struct Batch<'a> {
    pub mesh: &'a PreparedMesh,
    pub frame: &'a AxisFrame,
    pub tile: &'a Tile,
    /// The texel row of the face.
    pub b: u32,
    /// The vertex positions, in cells.
    pub positions: &'a [[f32; 3]],
    pub levels: &'a Levels,
    /// The column slopes of each block.
    pub slopes: &'a [[f32; LANES]],
}

impl Batch<'_> {
    #[inline(always)]
    pub(super) fn end(&self, vertex: u32, rank: i32) -> End {
        let position = &self.positions[vertex as usize];
        let [u, v, w] = self.frame.axes;
        End {
            rank,
            u: position[u],
            v: position[v],
            w: position[w],
        }
    }

    /// Returns the single-precision error, in cells, of the point where an edge passes a row, for
    /// an edge along which u and w do not change with the level: see [`Line::column_error`].
    pub(super) fn rounding(&self) -> f32 {
        let [across_u, across_v] = self.frame.shear;
        let reach = self.mesh.lattice().reach();
        (ROUNDING * reach * (1.0 + across_u) * (1.0 + across_v)) as f32
    }

    /// Returns the [first column](first_columns) of one direction, from the edge's vertices and in
    /// double precision.
    #[cold]
    #[inline(never)]
    pub(super) fn exact_column(&self, vertices: [u32; 2], row: u32, z: u32) -> u32 {
        let [u, v, w] = self.frame.axes;
        let cell = f64::from(1_u32 << self.mesh.lattice().bits());
        let [from, to] = vertices.map(|vertex| {
            let position = self.mesh.vertices()[vertex as usize];
            [u, v, w].map(|axis| f64::from(position[axis]) / cell)
        });
        let slope = self.frame.row_slope(self.b);
        let width = self.tile.j.len() as u32;
        let j = f64::from(self.tile.j.start + row % width);
        let k = f64::from(self.tile.k.start + row / width);
        let q = |p: [f64; 3]| p[1] - slope * p[2];
        let between = q(to) - q(from);
        // Ranks are computed in single precision, so an edge may fall just short of the level.
        let t = ((j - slope * k - q(from)) / between).clamp(0.0, 1.0);
        // NaN (0/0) if the edge lies in the plane of the level: any of its points will do.
        let t = if t.is_nan() { 0.0 } else { t };
        let at = |axis: usize| from[axis] + t * (to[axis] - from[axis]);
        let column = at(0) - (at(2) - k) * self.frame.column_slope(z);
        column.ceil().clamp(0.0, f64::from(self.frame.cells[0])) as u32
    }
}

/// The single-precision error over the largest coordinates, (1 + shear) · reach. V − b·W, a level,
/// and their difference are each off by 2⁻²⁴ of those; the change of u and w with the level by
/// twice as much (a difference, a quotient); u, the height, and u − height·a by once more each.
/// Eight in all.
const ROUNDING: f64 = 8.0 / (1 << 24) as f64;

/// The upper bound of the column error, in cells: larger than any column, yet small enough that
/// floats are still rounded to whole numbers exactly.
pub(super) const MAX_COLUMN_ERROR: f32 = (1 << 20) as f32;

/// The number of edges that a thread collects before it counts them.
const EDGE_CAPACITY: usize = 256;

/// Edges that cross levels, as a structure of arrays.
#[repr(C, align(64))]
pub(super) struct EdgeBuffer {
    /// The lower vertices, and the higher ones.
    pub vertices: [[u32; EDGE_CAPACITY]; 2],
    /// The ranks of the vertices.
    pub ranks: [[i32; EDGE_CAPACITY]; 2],
    pub facings: [EdgeFacing; EDGE_CAPACITY],
    pub n: usize,
}

impl Default for EdgeBuffer {
    fn default() -> Self {
        Self {
            vertices: [[0; EDGE_CAPACITY]; 2],
            ranks: [[0; EDGE_CAPACITY]; 2],
            facings: [EdgeFacing::default(); EDGE_CAPACITY],
            n: 0,
        }
    }
}

impl EdgeBuffer {
    #[inline(always)]
    pub(super) fn has_capacity(&self, n: usize) -> bool {
        self.n + n <= EDGE_CAPACITY
    }

    /// Appends the edge if it crosses a level. The caller has reserved space. Branchless: the test
    /// is unpredictable.
    #[inline(always)]
    pub(super) fn push(&mut self, vertices: [u32; 2], ranks: &[i32], facing: EdgeFacing) {
        let n = self.n & (EDGE_CAPACITY - 1);
        let [a, b] = vertices;
        let [from, to] = [ranks[a as usize], ranks[b as usize]];
        self.vertices[0][n] = a;
        self.vertices[1][n] = b;
        self.ranks[0][n] = from;
        self.ranks[1][n] = to;
        self.facings[n] = facing;
        self.n += usize::from(from != to);
    }
}

/// Appends the silhouettes of a chunk that cross a level. The caller has reserved space.
#[inline(always)]
pub(super) fn collect(chunk: &SilhouetteChunk<'_>, edges: &mut EdgeBuffer) {
    for (&vertices, &facing) in chunk.vertices.iter().zip(chunk.facings) {
        edges.push(vertices, chunk.ranks, facing);
    }
}

/// A chunk of at most [`EDGE_CHUNK`] silhouettes of one texel row.
pub(super) struct SilhouetteChunk<'a> {
    pub vertices: &'a [[u32; 2]],
    pub facings: &'a [EdgeFacing],
    /// The ranks of all vertices.
    pub ranks: &'a [i32],
}

impl<'a> SilhouetteChunk<'a> {
    /// Returns the chunk that starts at index `first` of a list, and the index of the next chunk.
    pub(super) fn new(list: &'a SilhouetteList, first: usize, ranks: &'a [i32]) -> (Self, usize) {
        let next = (first + EDGE_CHUNK).min(list.facings.len());
        let chunk = Self {
            vertices: &list.vertices[first..next],
            facings: &list.facings[first..next],
            ranks,
        };
        (chunk, next)
    }

    /// Returns the chunk without its first `n` silhouettes.
    #[cfg(target_arch = "x86_64")]
    pub(super) fn after(&self, n: usize) -> Self {
        Self {
            vertices: &self.vertices[n..],
            facings: &self.facings[n..],
            ranks: self.ranks,
        }
    }
}

/// The number of edges that are collected at a time.
pub(super) const EDGE_CHUNK: usize = 64;

/// Counts each edge at every row that it crosses, `unit` for each layer. The SIMD versions are
/// tested against this one.
#[inline(always)]
pub(super) fn count(batch: &Batch<'_>, edges: &EdgeBuffer, unit: i8, deltas: &mut DeltaBuffer) {
    let n_u = deltas.layout.n_u as f32;
    let rounding = batch.rounding();
    for n in 0..edges.n {
        let [from, to] = [edges.ranks[0][n], edges.ranks[1][n]];
        let ends = [
            batch.end(edges.vertices[0][n], from),
            batch.end(edges.vertices[1][n], to),
        ];
        let facings = edges.facings[n].intervals();
        let line = Line::new(ends[0], ends[1], batch.levels);
        let column_error = line.column_error(rounding);
        for (block, slopes) in batch.slopes.iter().enumerate() {
            let lanes = LaneDeltas::new(facings, from < to, batch.frame, block);
            if lanes.active == 0 {
                continue;
            }
            for level in batch.levels.between(from.min(to), from.max(to)) {
                let [u, height] = line.at(&level);
                let mut columns = first_columns(u - column_error, height, slopes, n_u);
                // Where rounding could move the column, double precision decides.
                let last = first_columns(u + column_error, height, slopes, n_u);
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
                deltas.push(at, row_side(height), &columns, lanes, unit);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_rounded_up_and_clamped_to_the_grid() {
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
