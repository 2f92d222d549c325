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

use crate::mesh::{Bounds, first_duplicate};
use crate::{Observer, Progress, TriangleMesh, UNOBSERVED};

/// A mesh prepared for one grid; see the [module](self).
#[derive(Debug)]
pub struct PreparedMesh {
    spec: GridSpec,
    lattice: Lattice,
    vertices: Vec<[i32; 3]>,
    triangles: Vec<[u32; 3]>,
    edges: Edges,
    bounds: [[i32; 3]; 2],
    /// The number of vertices of the mesh.
    n_unwelded: usize,
    /// The merged vertices, unless all were different.
    welded: Option<Welded>,
}

/// Vertices that were merged: the index of each vertex of the mesh among the prepared ones, and the
/// first vertex of the mesh for each of those.
#[derive(Debug)]
struct Welded {
    new_idx: Vec<u32>,
    first: Vec<u32>,
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
    /// The observer cancelled the preparation.
    #[error("the preparation was cancelled")]
    Cancelled,
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
        Self::observed(mesh, spec, sample_offset, UNOBSERVED)
    }

    /// Prepares a mesh like [`PreparedMesh::new`], and calls the observer before each stage, with no
    /// cell done: the bake has yet to begin.
    ///
    /// # Errors
    ///
    /// The mesh and the grid exceed the [limits](self#limits), or the observer cancelled.
    pub fn observed(
        mesh: &TriangleMesh,
        spec: GridSpec,
        sample_offset: [f32; 3],
        observer: Observer<'_>,
    ) -> Result<Self, PrepareError> {
        Self::within(Limits::SWEEP, mesh, spec, sample_offset, observer)
    }

    /// Prepares a mesh like [`PreparedMesh::observed`], but within the given limits.
    pub(crate) fn within(
        limits: Limits,
        mesh: &TriangleMesh,
        spec: GridSpec,
        sample_offset: [f32; 3],
        observer: Observer<'_>,
    ) -> Result<Self, PrepareError> {
        let begin_stage = || {
            let (done, total) = (0, spec.cell_count());
            match observer(Progress { done, total }).is_break() {
                true => Err(PrepareError::Cancelled),
                false => Ok(()),
            }
        };
        let n_triangles = mesh.triangles().len();
        if n_triangles >= 1 << 31 {
            return Err(PrepareError::TooMany(n_triangles));
        }
        let lattice = Lattice::new(&spec, sample_offset, &mesh.bounds(), limits)?;
        let Bounds { min, max, .. } = mesh.bounds();
        // Rounding is monotonic, so the snapped bounds are those of the snapped vertices.
        let bounds = [min, max].map(|corner| lattice.snap(corner));
        begin_stage()?;
        let snapped = snap_all(&lattice, mesh);
        begin_stage()?;
        let (vertices, mut triangles, welded) = weld(snapped, mesh.triangles());
        begin_stage()?;
        let mut edges = find_edges(&triangles, vertices.len());
        begin_stage()?;
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
            n_unwelded: mesh.positions().len(),
            welded,
        })
    }

    /// Moves the vertices to those of another pose of the same mesh, for a grid, and keeps triangles
    /// and edges: a fraction of the time of [`PreparedMesh::new`]. The triangles of `mesh` must be
    /// those of the mesh that this one was made from.
    ///
    /// Returns whether it did: not if the number of vertices differs, or if vertices that were merged
    /// are apart in this pose. Then nothing has changed, and the mesh has to be prepared anew.
    /// Vertices that coincide only in this pose are not merged; their edges count as boundaries, to
    /// the same effect.
    ///
    /// # Errors
    ///
    /// The mesh and the grid exceed the [limits](self#limits).
    pub fn repose(
        &mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        sample_offset: [f32; 3],
    ) -> Result<bool, PrepareError> {
        if mesh.positions().len() != self.n_unwelded {
            return Ok(false);
        }
        let lattice = Lattice::new(&spec, sample_offset, &mesh.bounds(), Limits::SWEEP)?;
        let snapped = snap_all(&lattice, mesh);
        self.vertices = match &self.welded {
            None => snapped,
            Some(welded) => match welded.merged(&snapped) {
                Some(vertices) => vertices,
                None => return Ok(false),
            },
        };
        let Bounds { min, max, .. } = mesh.bounds();
        self.bounds = [min, max].map(|corner| lattice.snap(corner));
        (self.spec, self.lattice) = (spec, lattice);
        Ok(true)
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

impl Welded {
    /// Returns the position of each prepared vertex, if those that were merged coincide.
    fn merged(&self, snapped: &[[i32; 3]]) -> Option<Vec<[i32; 3]>> {
        let position = |&vertex: &u32| snapped[vertex as usize];
        let merged: Vec<_> = self.first.iter().map(position).collect();
        let coincide =
            |(new_idx, position): (&u32, &[i32; 3])| merged[*new_idx as usize] == *position;
        self.new_idx
            .iter()
            .zip(snapped)
            .all(coincide)
            .then_some(merged)
    }
}

/// Returns the lattice points of all vertices.
fn snap_all(lattice: &Lattice, mesh: &TriangleMesh) -> Vec<[i32; 3]> {
    let positions = mesh.positions().par_iter().with_min_len(SNAP_CHUNK);
    positions.map(|&position| lattice.snap(position)).collect()
}

/// The minimum number of vertices that one task snaps: fewer are snapped sooner than shared out.
const SNAP_CHUNK: usize = 4096;

/// Merges vertices at the same position, and drops triangles with coincident corners. The order is
/// kept.
fn weld(
    snapped: Vec<[i32; 3]>,
    triangles: &[[u32; 3]],
) -> (Vec<[i32; 3]>, Vec<[u32; 3]>, Option<Welded>) {
    let keys: Vec<[u32; 3]> = snapped
        .par_iter()
        .map(|p| p.map(i32::cast_unsigned))
        .collect();
    let first = first_duplicate(&keys);
    let all_differ = (0..).zip(&first).all(|(idx, &first)| idx == first);
    let (vertices, welded) = match all_differ {
        // The usual case. Unused vertices stay, and are harmless.
        true => (snapped, None),
        false => {
            let (vertices, welded) = compact(&snapped, &first);
            (vertices, Some(welded))
        }
    };
    let renumber = |vertex: u32| match &welded {
        None => vertex,
        Some(welded) => welded.new_idx[vertex as usize],
    };
    let corners_differ = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    let triangles = triangles
        .par_iter()
        .map(|t| t.map(renumber))
        .filter(corners_differ)
        .collect();
    (vertices, triangles, welded)
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

/// Returns the vertices that are the first at their position, and how the vertices were merged.
fn compact(snapped: &[[i32; 3]], first: &[u32]) -> (Vec<[i32; 3]>, Welded) {
    let mut vertices = Vec::new();
    let mut welded = Welded {
        new_idx: Vec::with_capacity(first.len()),
        first: Vec::new(),
    };
    for (idx, &first) in first.iter().enumerate() {
        if first as usize == idx {
            welded.new_idx.push(vertices.len() as u32);
            welded.first.push(first);
            vertices.push(snapped[idx]);
        } else {
            welded.new_idx.push(welded.new_idx[first as usize]);
        }
    }
    (vertices, welded)
}

#[cfg(test)]
mod tests;
