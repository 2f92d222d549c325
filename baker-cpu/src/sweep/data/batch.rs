//! The inputs of a batch's counting.

use aogrid_bake_core::PreparedMesh;
use aogrid_bake_core::sweep::{AxisFrame, LANES};

use super::counters::Tile;
use super::levels::Levels;
use super::line::End;

/// The inputs of a batch's counting.
#[derive(Clone, Copy)]
pub(in crate::sweep) struct Batch<'a> {
    pub mesh: &'a PreparedMesh,
    pub frame: &'a AxisFrame,
    pub tile: &'a Tile,
    /// The texel row of the face.
    pub b: u32,
    /// The vertex positions, in cells, and a spare one.
    pub positions: &'a [[f32; 3]],
    pub levels: &'a Levels,
    /// The column slopes of each block.
    pub slopes: &'a [[f32; LANES]],
}

impl Batch<'_> {
    #[inline(always)]
    pub(in crate::sweep) fn end(&self, vertex: u32, rank: i32) -> End {
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
    /// an edge along which u and w do not change with the level: see
    /// [`Line::column_error`](super::line::Line::column_error).
    pub(in crate::sweep) fn rounding(&self) -> f32 {
        let [across_u, across_v] = self.frame.shear;
        let reach = self.mesh.lattice().reach();
        (ROUNDING * reach * (1.0 + across_u) * (1.0 + across_v)) as f32
    }

    /// Returns the [first column](super::line::first_columns) of one direction, from the edge's
    /// vertices and in double precision.
    #[cold]
    #[inline(never)]
    pub(in crate::sweep) fn exact_column(&self, vertices: [u32; 2], row: u32, z: u32) -> u32 {
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
