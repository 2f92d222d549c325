//! Rays at the mesh that the sweep sees, to check it by.

use aogrid_bake_core::mesh::Part;
use aogrid_bake_core::{FaceBits, PreparedMesh, TriangleMesh, cube_face};
use rayon::prelude::*;

use crate::Occluder;

/// A hierarchy over a [`PreparedMesh`], in cells from the first sample: the sweep's vertices,
/// not rounded again. Its images and the sweep's may differ only where a ray passes an edge
/// within the distance that single floats resolve.
pub struct SnappedRays<'a> {
    mesh: &'a PreparedMesh,
    /// None: no triangle is left.
    occluder: Option<Occluder>,
}

impl<'a> SnappedRays<'a> {
    /// Builds the hierarchy.
    pub fn new(mesh: &'a PreparedMesh) -> Self {
        let in_cells = |p: &[i32; 3]| p.map(|v| mesh.lattice().in_cells(v));
        let whole = Part {
            name: String::new(),
            triangles: 0..mesh.triangles().len(),
        };
        let positions = mesh.vertices().iter().map(in_cells).collect();
        // It is a mesh unless it has no triangles.
        let snapped = TriangleMesh::new(positions, mesh.triangles().to_vec(), vec![whole]);
        Self {
            mesh,
            occluder: snapped.ok().as_ref().map(Occluder::new),
        }
    }

    /// Whether the texel in `direction` (object axes, any length) of a cell is occluded.
    pub fn hides(&self, cell: [u32; 3], direction: [f64; 3]) -> bool {
        let size = self.mesh.spec().cell_size();
        let in_cells = std::array::from_fn(|x| direction[x] / size[x]);
        let hides = |o: &Occluder| o.hides(cell.map(f64::from), in_cells, f64::INFINITY);
        self.occluder.as_ref().is_some_and(hides)
    }

    /// The faces of every cell.
    pub fn faces(&self, size: u32) -> FaceBits {
        let texels = cube_face::texels(size);
        let spec = self.mesh.spec();
        let occluded = |cell_idx: usize| {
            let cell = spec.cell_at(cell_idx);
            let hides = |(_, t): &(usize, &cube_face::Texel)| self.hides(cell, t.direction);
            let hidden = texels.iter().enumerate().filter(hides);
            hidden.map(|(texel, _)| texel).collect()
        };
        let cells: Vec<Vec<usize>> = (0..spec.cell_count())
            .into_par_iter()
            .map(occluded)
            .collect();
        let mut bits = FaceBits::new(cells.len(), size);
        for (cell, hidden) in cells.iter().enumerate() {
            hidden.iter().for_each(|&texel| bits.set(cell, texel));
        }
        bits
    }
}
