//! A mesh prepared for one grid: on the grid's lattice, welded, with its edges.
//!
//! It is the input of every baker's direction sweep. Vertices are integers, so that the sign of an
//! area is exact in 64 bits and independent computations on the same vertices agree. The lattice
//! spacing (2⁻¹⁹ of a cell for grids of up to 32 cells per axis) is such that single-precision
//! floats hold its points exactly, too.
//!
//! # Limits
//!
//! A coordinate takes 24 bits and a sign. If a mesh reaches farther than 32 cells from the grid's
//! first sample, because the grid has more cells or is smaller than the mesh, the lattice is
//! coarser in proportion: never coarser than 24 bits across the whole, the precision of the mesh's
//! own single-precision floats. If it reaches beyond 2048 cells, or a cell is more than 64 times
//! longer than wide, the mesh cannot be prepared ([`PrepareError`]) and only ray casting can bake
//! it.

mod edges;
mod lattice;

use std::collections::HashMap;

use aogrid_grid_format::GridSpec;
use rayon::prelude::*;

pub(crate) use edges::Edges;
use edges::edges as find_edges;
pub use edges::{BoundaryEdge, Edge, HalfEdge};
pub use lattice::Lattice;
pub(crate) use lattice::Limits;

use crate::TriangleMesh;
use crate::mesh::{Bounds, first_duplicate};

/// A mesh prepared for one grid; see the [module](self).
#[derive(Debug)]
pub struct PreparedMesh {
    spec: GridSpec,
    lattice: Lattice,
    vertices: Vec<[i32; 3]>,
    triangles: Vec<[u32; 3]>,
    edges: Edges,
    bounds: [[i32; 3]; 2],
}

/// The reason that a mesh and a grid exceed the limits of the direction sweep. Ray casting has no
/// such limits.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// The mesh reaches too many cells from the grid.
    #[error("the mesh reaches {0:.0} cells from the grid's first sample, more than 2048")]
    TooFar(f64),
    /// The grid's cells are too elongated.
    #[error("the grid's cells are {0:.0} times longer than wide, more than 64")]
    Stretched(f64),
    /// The mesh has more triangles than 31-bit indices can hold.
    #[error("{0} triangles are too many, the maximum is 2^31 - 1")]
    TooMany(usize),
}

impl PreparedMesh {
    /// Prepares `mesh` for the samples of `spec` at `sample_offset` cells from the cells' centers.
    /// Uses all threads; the result does not depend on their number.
    ///
    /// # Errors
    ///
    /// The mesh and the grid exceed the [limits](self#limits).
    pub fn new(
        mesh: &TriangleMesh,
        spec: GridSpec,
        sample_offset: [f32; 3],
    ) -> Result<Self, PrepareError> {
        Self::within(Limits::SWEEP, mesh, spec, sample_offset)
    }

    /// Prepares a mesh like [`PreparedMesh::new`], but within the given limits.
    pub(crate) fn within(
        limits: Limits,
        mesh: &TriangleMesh,
        spec: GridSpec,
        sample_offset: [f32; 3],
    ) -> Result<Self, PrepareError> {
        let n_triangles = mesh.triangles().len();
        if n_triangles >= 1 << 31 {
            return Err(PrepareError::TooMany(n_triangles));
        }
        let lattice = Lattice::new(&spec, sample_offset, &mesh.bounds(), limits)?;
        let Bounds { min, max, .. } = mesh.bounds();
        // Rounding is monotonic, so the snapped bounds are those of the snapped vertices.
        let bounds = [min, max].map(|corner| lattice.snap(corner));
        let snapped: Vec<[i32; 3]> = mesh
            .positions()
            .par_iter()
            .map(|&position| lattice.snap(position))
            .collect();
        let (vertices, mut triangles) = weld(snapped, mesh.triangles());
        let mut edges = find_edges(&triangles, vertices.len());
        let repeated = repeated(&triangles, &edges);
        if !repeated.is_empty() {
            triangles = without(&triangles, &repeated);
            edges = find_edges(&triangles, vertices.len());
        }
        Ok(Self {
            spec,
            lattice,
            vertices,
            triangles,
            edges,
            bounds,
        })
    }

    /// Returns the grid.
    pub fn spec(&self) -> &GridSpec {
        &self.spec
    }

    /// Returns the lattice of the coordinates.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Returns the vertices, all at different positions, in lattice steps from the first sample.
    pub fn vertices(&self) -> &[[i32; 3]] {
        &self.vertices
    }

    /// Returns the triangles over [`PreparedMesh::vertices`]. Triangles with two coincident corners
    /// are left out, because they occlude nothing, and so are all but the first with the same three
    /// corners.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the interior edges.
    pub fn edges(&self) -> &[Edge] {
        &self.edges.pairs
    }

    /// Returns the boundary edges.
    pub fn boundary_edges(&self) -> &[BoundaryEdge] {
        &self.edges.lone
    }

    /// Returns interior and boundary edges, and their statistics.
    pub(crate) fn all_edges(&self) -> &Edges {
        &self.edges
    }

    /// Returns the smallest and the largest coordinates of the triangles' vertices.
    pub(crate) fn bounds(&self) -> [[i32; 3]; 2] {
        self.bounds
    }

    /// Returns the normal of a triangle by the right-hand rule, in squared lattice steps: exact,
    /// below 2⁵².
    #[inline]
    pub fn normal(&self, triangle: [u32; 3]) -> [i64; 3] {
        let vertex = |corner: usize| &self.vertices[triangle[corner] as usize];
        let (a, b, c) = (vertex(0), vertex(1), vertex(2));
        // Coordinates have 25 bits with their sign, so that differences fit 32.
        let edge = |p: &[i32; 3], x: usize| i64::from(p[x] - a[x]);
        let minor = |y: usize, z: usize| edge(b, y) * edge(c, z) - edge(b, z) * edge(c, y);
        [minor(1, 2), minor(2, 0), minor(0, 1)]
    }
}

/// Merges vertices at the same position, and drops triangles with coincident corners. The order is
/// kept.
fn weld(snapped: Vec<[i32; 3]>, triangles: &[[u32; 3]]) -> (Vec<[i32; 3]>, Vec<[u32; 3]>) {
    let keys: Vec<[u32; 3]> = snapped
        .par_iter()
        .map(|p| p.map(i32::cast_unsigned))
        .collect();
    let first = first_duplicate(&keys);
    let all_differ = (0..).zip(&first).all(|(idx, &first)| idx == first);
    let (vertices, new_idx) = match all_differ {
        // The usual case. Unused vertices stay, and are harmless.
        true => (snapped, first),
        false => compact(&snapped, &first),
    };
    let renumber = |vertex: u32| new_idx[vertex as usize];
    let corners_differ = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    let triangles = triangles
        .par_iter()
        .map(|t| t.map(renumber))
        .filter(corners_differ)
        .collect();
    (vertices, triangles)
}

/// Returns the triangles that have the three corners of an earlier one, whatever the winding, in
/// order. They are the same surface, and each edge of thousands of them would be a silhouette.
fn repeated(triangles: &[[u32; 3]], edges: &Edges) -> Vec<u32> {
    let mut candidates = edges.facts.may_repeat.clone();
    candidates.sort_unstable();
    candidates.dedup();
    let mut first = HashMap::new();
    candidates.retain(|&triangle| {
        let mut corners = triangles[triangle as usize];
        corners.sort_unstable();
        *first.entry(corners).or_insert(triangle) != triangle
    });
    candidates
}

/// Returns the triangles but for some, whose indices are in order.
fn without(triangles: &[[u32; 3]], left_out: &[u32]) -> Vec<[u32; 3]> {
    let mut left_out = left_out.iter().peekable();
    let is_kept = |&(triangle, _): &(u32, _)| left_out.next_if_eq(&&triangle).is_none();
    let kept = (0..).zip(triangles).filter(is_kept);
    kept.map(|(_, corners)| *corners).collect()
}

/// Returns the vertices that are the first at their position, and the new index of each old vertex.
fn compact(snapped: &[[i32; 3]], first: &[u32]) -> (Vec<[i32; 3]>, Vec<u32>) {
    let mut vertices = Vec::new();
    let mut new_idx: Vec<u32> = Vec::with_capacity(first.len());
    for (idx, &first) in first.iter().enumerate() {
        if first as usize == idx {
            new_idx.push(vertices.len() as u32);
            vertices.push(snapped[idx]);
        } else {
            new_idx.push(new_idx[first as usize]);
        }
    }
    (vertices, new_idx)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Placement;
    use crate::mesh::{MeshReport, Part};
    use crate::models::Model;

    fn prepared(mesh: &TriangleMesh) -> PreparedMesh {
        let spec = Placement::paper().place(&mesh.bounds()).unwrap();
        PreparedMesh::new(mesh, spec, [3.1e-4, -1.7e-4, 4.3e-4]).unwrap()
    }

    /// Returns the mesh with a separate vertex for every corner.
    fn split(mesh: &TriangleMesh) -> TriangleMesh {
        let positions: Vec<_> = mesh.corners().flatten().collect();
        let n = mesh.triangles().len();
        let triangles = (0..n as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        let whole = Part {
            name: "split".into(),
            triangles: 0..n,
        };
        TriangleMesh::new(positions, triangles.collect(), vec![whole]).unwrap()
    }

    #[test]
    fn closed_meshes_have_no_boundary_edges_with_and_without_shared_vertices() {
        for sample in Model::CLOSED {
            let mesh = sample.mesh(None).unwrap();
            let whole = prepared(&mesh);
            assert!(whole.boundary_edges().is_empty(), "{sample:?}");
            assert_eq!(2 * whole.edges().len(), 3 * whole.triangles().len());
            let split = prepared(&split(&mesh));
            assert!(split.boundary_edges().is_empty(), "{sample:?}");
            assert_eq!(split.vertices().len(), whole.vertices().len());
        }
    }

    #[test]
    fn triangles_with_coincident_corners_are_left_out() {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [1e-9, 0.0, 0.0]];
        let whole = Part {
            name: "points".into(),
            triangles: 0..2,
        };
        // The last vertex snaps to the first.
        let mesh = TriangleMesh::new(points, vec![[0, 1, 2], [0, 3, 2]], vec![whole]).unwrap();
        assert_eq!(MeshReport::new(&mesh).degenerate, 0);
        let prepared = prepared(&mesh);
        assert_eq!(prepared.triangles(), [[0, 1, 2]]);
        assert_eq!(
            (prepared.vertices().len(), prepared.boundary_edges().len()),
            (3, 3)
        );
    }

    /// A triangle that is repeated 33,333 times took a minute to sweep.
    #[test]
    fn repeated_triangles_are_one() {
        let mesh = Model::Box.mesh(None).unwrap();
        let whole = prepared(&mesh);
        let mut triangles = mesh.triangles().to_vec();
        let [a, b, c] = triangles[5];
        triangles.extend([[b, a, c], [b, c, a]].repeat(1000));
        let part = Part {
            name: "repeated".into(),
            triangles: 0..triangles.len(),
        };
        let repeated = TriangleMesh::new(mesh.positions().to_vec(), triangles, vec![part]).unwrap();
        let repeated = prepared(&repeated);
        assert_eq!(repeated.triangles(), whole.triangles());
        assert_eq!(repeated.edges(), whole.edges());
        assert!(repeated.boundary_edges().is_empty());
    }

    #[test]
    fn unused_vertices_may_be_nan() {
        let points = vec![[f32::NAN; 3], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]];
        let whole = Part {
            name: "points".into(),
            triangles: 0..1,
        };
        let mesh = TriangleMesh::new(points, vec![[1, 2, 3]], vec![whole]).unwrap();
        assert_eq!(prepared(&mesh).triangles().len(), 1);
    }

    #[test]
    fn normals_are_exact() {
        let mesh = prepared(&Model::Box.mesh(None).unwrap());
        for &triangle in mesh.triangles() {
            let normal = mesh.normal(triangle);
            assert_eq!(normal.iter().filter(|v| **v != 0).count(), 1, "{normal:?}");
        }
    }
}
