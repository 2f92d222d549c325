//! The rows of cells whose lines meet a triangle or come near it, in exact integers.

use std::ops::Range;

use super::AxisFrame;
use crate::PreparedMesh;

/// The smallest distance, in cells, between a row's line and an edge at which the edge's side is
/// certain. Nearer ones are decided direction by direction, which costs time. It has to exceed the
/// effect of rounding on a vertex's rank, see [`margin`].
const MIN_MARGIN: f64 = 1.0 / 1024.0;

/// The rounding error of V − b·W, over the largest coordinates: a product and a difference, half a
/// unit of 2⁻²³ each, and as much again for the levels; eight times that for safety.
const ROUNDING: f64 = 8.0 / (1 << 22) as f64;

/// The position of a row's line relative to a triangle, both seen along the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RowClass {
    /// The line passes outside by more than the margin.
    Outside,
    /// The line passes an edge within the margin, where rounding may put it on either side.
    NearEdge,
    /// The line goes through the triangle, away from all edges by more than the margin.
    Inside,
}

/// The exact integer test of the lines of a frame's rows against triangles.
#[derive(Clone, Copy, Debug)]
pub struct RowSearch<'a> {
    frame: &'a AxisFrame,
    bits: u32,
    /// The margin in lattice units.
    margin: i32,
}

/// Returns the distance from an edge, in cells, beyond which no rounding for any direction can move
/// the row's line to the edge's other side.
fn margin(mesh: &PreparedMesh, frame: &AxisFrame) -> f64 {
    let reach = mesh.lattice().reach();
    MIN_MARGIN.max(ROUNDING * (reach + frame.shear[1] * reach))
}

impl<'a> RowSearch<'a> {
    /// Returns the search among the rows of a frame, for triangles of `mesh`.
    pub fn new(mesh: &PreparedMesh, frame: &'a AxisFrame) -> Self {
        let bits = mesh.lattice().bits();
        let margin = (margin(mesh, frame) * f64::from(1_u32 << bits)).ceil() as i32;
        Self {
            frame,
            bits,
            margin,
        }
    }

    /// Returns the frame whose rows are searched.
    #[inline]
    pub fn frame(&self) -> &'a AxisFrame {
        self.frame
    }

    /// Returns the rows, along v (1) or w (2), whose lines come near the triangle's bounds. They are
    /// numbered by the cells of the grid.
    #[inline(always)]
    pub fn rows(&self, points: &[[i32; 3]; 3], across: usize) -> Range<i32> {
        let axis = self.frame.axes[across];
        let at = [points[0][axis], points[1][axis], points[2][axis]];
        let low = at[0].min(at[1]).min(at[2]) - self.margin;
        let high = at[0].max(at[1]).max(at[2]) + self.margin;
        let first = (low + ((1 << self.bits) - 1)) >> self.bits;
        let last = high >> self.bits;
        let start = self.frame.first[across] as i32;
        let end = start + self.frame.cells[across] as i32;
        first.max(start)..last.saturating_add(1).min(end)
    }

    /// Returns the position of the line of row (j, k) along v and w, in lattice units.
    #[inline(always)]
    pub fn line(&self, [j, k]: [i32; 2]) -> [i64; 2] {
        [i64::from(j) << self.bits, i64::from(k) << self.bits]
    }

    /// Classifies a row's line. `normal` is the triangle's, see [`PreparedMesh::normal`].
    #[inline(always)]
    pub fn classify(&self, points: &[[i32; 3]; 3], normal: [i64; 3], [j, k]: [i64; 2]) -> RowClass {
        let [u, v, w] = self.frame.axes;
        let n_u = normal[u];
        // A triangle that is seen edge-on has no interior.
        let mut lowest = i32::from(n_u != 0);
        for i in 0..3 {
            let [a, b] = [points[i], points[(i + 1) % 3]].map(|p| [p[v], p[w]].map(i64::from));
            let along = [b[0] - a[0], b[1] - a[1]];
            // Twice the signed area: the distance from the edge times the edge's length.
            let area = along[0] * (k - a[1]) - along[1] * (j - a[0]);
            let inward = if n_u < 0 { -area } else { area };
            let margin = i64::from(self.margin) * (along[0].abs() + along[1].abs());
            let class = i32::from(inward >= margin) - i32::from(inward <= -margin);
            lowest = lowest.min(class);
        }
        match lowest {
            1 => RowClass::Inside,
            0 => RowClass::NearEdge,
            _ => RowClass::Outside,
        }
    }

    /// Returns the first column of the frame whose cells are not to the left of the point where the
    /// line meets the triangle's plane, or the number of columns if there is none. Double precision
    /// suffices: an error of 2⁻⁵² of the triangle's size is negligible.
    #[inline(always)]
    pub fn column(&self, points: &[[i32; 3]; 3], normal: [i64; 3], [j, k]: [i64; 2]) -> u32 {
        let [u, v, w] = self.frame.axes;
        let [n_u, n_v, n_w] = [u, v, w].map(|axis| normal[axis] as f64);
        let from = |at: i64, axis: usize| (at - i64::from(points[0][axis])) as f64;
        let along_u = points.map(|p| f64::from(p[u]));
        let low = along_u[0].min(along_u[1]).min(along_u[2]);
        let high = along_u[0].max(along_u[1]).max(along_u[2]);
        let at = if normal[u] == 0 {
            // The line lies in the triangle's plane, where any point serves.
            (low + high) / 2.0
        } else {
            let rise = (n_v * from(j, v) + n_w * from(k, w)) / n_u;
            (along_u[0] - rise).clamp(low, high)
        };
        let column = (at / f64::from(1_u32 << self.bits)).ceil() - f64::from(self.frame.first[0]);
        column.clamp(0.0, f64::from(self.frame.cells[0])) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Part;
    use crate::{BakeOptions, Placement, TriangleMesh};

    #[test]
    fn lines_of_rows_are_classified_by_their_distance_from_edges() {
        let corners = vec![[0.0, -1.0, -1.0], [0.2, 1.0, -1.0], [0.4, -1.0, 1.0]];
        let whole = Part {
            name: "triangle".into(),
            triangles: 0..1,
        };
        let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]], vec![whole]).unwrap();
        let spec = Placement::paper().place(&mesh.bounds()).unwrap();
        let mesh = PreparedMesh::new(&mesh, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
        let frame = AxisFrame::new(&spec, 2, 16);
        let search = RowSearch::new(&mesh, &frame);
        let triangle = mesh.triangles()[0];
        let points = triangle.map(|vertex| mesh.vertices()[vertex as usize]);
        let normal = mesh.normal(triangle);
        let center: [i64; 2] = [1, 2].map(|x| points.iter().map(|p| i64::from(p[x])).sum());
        let center = center.map(|sum| sum / 3);
        // The frame along z has its rows along x.
        assert_eq!(frame.axes, [0, 1, 2]);
        let class = |line| search.classify(&points, normal, line);
        assert_eq!(class(center), RowClass::Inside);
        assert_eq!(class([1 << 30, center[1]]), RowClass::Outside);
        let corner = [i64::from(points[0][1]), i64::from(points[0][2])];
        assert_eq!(class(corner), RowClass::NearEdge);
        let column = search.column(&points, normal, center);
        let middle = points.iter().map(|p| f64::from(p[0])).sum::<f64>() / 3.0;
        let middle = middle / f64::from(1_u32 << search.bits);
        assert!(
            (f64::from(column) - middle).abs() <= 1.0,
            "{column} {middle}"
        );
        for across in [1, 2] {
            let rows = search.rows(&points, across);
            assert!(
                rows.start > 0 && rows.end < 32 && rows.len() > 2,
                "{rows:?}"
            );
        }
    }
}
