//! A mesh made ready for one grid: on the grid's lattice, welded, with its edges.
//!
//! The direction sweep of every baker takes this. Its vertices are integers, so that the sign
//! of an area is exact in 64 bits and two places that ask the same question of the same
//! vertices get the same answer. The lattice is so fine (2⁻¹⁹ of a cell for grids of up to 32
//! cells a side) that single floats hold its points exactly, too.
//!
//! # Limits
//!
//! A coordinate takes 24 bits and a sign. A mesh that reaches farther than 32 cells from the
//! grid's first sample, because the grid has more cells or is smaller than the mesh, lies on
//! a lattice as many times coarser: never coarser than 24 bits across the whole, which is as
//! much as the mesh's own single floats have. Beyond 2048 cells, or where a cell is more than
//! 64 times longer than wide, there is no prepared mesh ([`PrepareError`]) and only rays can
//! bake.

mod edges;
mod lattice;

use aogrid_grid_format::GridSpec;
use rayon::prelude::*;

pub(crate) use edges::Edges;
use edges::edges as find_edges;
pub use edges::{Edge, HalfEdge, LoneEdge};
pub use lattice::Lattice;
pub(crate) use lattice::Limits;

use crate::TriangleMesh;
use crate::mesh::{Bounds, first_at_place};

/// See the [module](self).
#[derive(Debug)]
pub struct PreparedMesh {
    spec: GridSpec,
    lattice: Lattice,
    vertices: Vec<[i32; 3]>,
    triangles: Vec<[u32; 3]>,
    edges: Edges,
    bounds: [[i32; 3]; 2],
}

/// Why a mesh and a grid do not fit the sweep. Rays have no such limits.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// The mesh is many times larger than the grid's cells.
    #[error("the mesh reaches {0:.0} cells from the grid's first sample, more than 2048")]
    TooFar(f64),
    /// Cells like needles or sheets.
    #[error("the grid's cells are {0:.0} times longer than wide, more than 64")]
    Stretched(f64),
    /// Indices take 31 bits.
    #[error("{0} triangles are more than 2^31")]
    TooMany(usize),
}

impl PreparedMesh {
    /// Prepares `mesh` for the samples of `spec` at `sample_offset` cells from the centres.
    /// On all threads; the result does not depend on their number.
    ///
    /// # Errors
    ///
    /// A mesh and a grid beyond the [limits](self#limits).
    pub fn new(
        mesh: &TriangleMesh,
        spec: GridSpec,
        sample_offset: [f32; 3],
    ) -> Result<Self, PrepareError> {
        Self::within(Limits::SWEEP, mesh, spec, sample_offset)
    }

    /// [`PreparedMesh::new`], with other limits than the sweep's.
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
        let Bounds { min, max } = mesh.bounds();
        // Rounding keeps the order.
        let bounds = [min, max].map(|corner| lattice.snap(corner));
        let snapped: Vec<[i32; 3]> = mesh
            .positions()
            .par_iter()
            .map(|&position| lattice.snap(position))
            .collect();
        let (vertices, triangles) = weld(snapped, mesh.triangles());
        let edges = find_edges(&triangles, vertices.len());
        Ok(Self {
            spec,
            lattice,
            vertices,
            triangles,
            edges,
            bounds,
        })
    }

    /// The grid.
    pub fn spec(&self) -> &GridSpec {
        &self.spec
    }

    /// What the coordinates mean.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// The vertices, no two at the same place, in steps of the lattice from the first sample.
    pub fn vertices(&self) -> &[[i32; 3]] {
        &self.vertices
    }

    /// Triangles over [`PreparedMesh::vertices`]. Those with two corners at one place are
    /// left out: they hide nothing.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Half-edges in pairs.
    pub fn edges(&self) -> &[Edge] {
        &self.edges.pairs
    }

    /// Half-edges alone.
    pub fn lone_edges(&self) -> &[LoneEdge] {
        &self.edges.lone
    }

    /// Both kinds of edges, and facts about them.
    pub(crate) fn all_edges(&self) -> &Edges {
        &self.edges
    }

    /// The smallest and the largest coordinates of the triangles' vertices.
    pub(crate) fn bounds(&self) -> [[i32; 3]; 2] {
        self.bounds
    }

    /// The normal of a triangle by the right-hand rule, in squared steps: exact, below 2⁵².
    #[inline]
    pub fn normal(&self, triangle: [u32; 3]) -> [i64; 3] {
        let vertex = |corner: usize| &self.vertices[triangle[corner] as usize];
        let (a, b, c) = (vertex(0), vertex(1), vertex(2));
        // Coordinates have 25 bits with their sign, so that differences fit 32.
        let along = |p: &[i32; 3], x: usize| i64::from(p[x] - a[x]);
        let minor = |y: usize, z: usize| along(b, y) * along(c, z) - along(b, z) * along(c, y);
        [minor(1, 2), minor(2, 0), minor(0, 1)]
    }
}

/// Vertices at one place become one, those of no triangle go. The order stays.
fn weld(snapped: Vec<[i32; 3]>, triangles: &[[u32; 3]]) -> (Vec<[i32; 3]>, Vec<[u32; 3]>) {
    let places: Vec<[u32; 3]> = snapped
        .par_iter()
        .map(|p| p.map(i32::cast_unsigned))
        .collect();
    let first = first_at_place(&places);
    let all_differ = (0..).zip(&first).all(|(idx, &first)| idx == first);
    let (vertices, new_idx) = match all_differ {
        // As most files are. Vertices of no triangle stay here, and do no harm.
        true => (snapped, first),
        false => compact(&snapped, &first),
    };
    let renumber = |vertex: u32| new_idx[vertex as usize];
    let has_corners = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    let triangles = triangles
        .par_iter()
        .map(|t| t.map(renumber))
        .filter(has_corners)
        .collect();
    (vertices, triangles)
}

/// The vertices that are the first at their place, and the new index of each old one.
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
    use crate::samples::Sample;

    fn prepared(mesh: &TriangleMesh) -> PreparedMesh {
        let spec = Placement::default().place(&mesh.bounds()).unwrap();
        PreparedMesh::new(mesh, spec, [3.1e-4, -1.7e-4, 4.3e-4]).unwrap()
    }

    /// The mesh with a vertex of its own for every corner.
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
    fn closed_meshes_have_no_lone_edges_also_when_split() {
        for sample in Sample::CLOSED {
            let mesh = sample.mesh(None).unwrap();
            let whole = prepared(&mesh);
            assert!(whole.lone_edges().is_empty(), "{sample:?}");
            assert_eq!(2 * whole.edges().len(), 3 * whole.triangles().len());
            let split = prepared(&split(&mesh));
            assert!(split.lone_edges().is_empty(), "{sample:?}");
            assert_eq!(split.vertices().len(), whole.vertices().len());
        }
    }

    #[test]
    fn triangles_without_corners_are_left_out() {
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
            (prepared.vertices().len(), prepared.lone_edges().len()),
            (3, 3)
        );
    }

    #[test]
    fn unused_vertices_may_be_anything() {
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
        let mesh = prepared(&Sample::Box.mesh(None).unwrap());
        for &triangle in mesh.triangles() {
            let normal = mesh.normal(triangle);
            assert_eq!(normal.iter().filter(|v| **v != 0).count(), 1, "{normal:?}");
        }
    }
}
