//! Ray casting against the quantized mesh of the direction sweep, to verify the sweep.

use aogrid_bake_core::mesh::Part;
use aogrid_bake_core::{FaceBits, PreparedMesh, TriangleMesh, cube_face};
use rayon::prelude::*;

use crate::RayScene;

/// A BVH over a [`PreparedMesh`], in units of cells relative to the first sample.
///
/// It uses the sweep's quantized vertices without further rounding. Its results and those of the
/// sweep may differ only where a ray passes an edge within the resolution of single precision.
pub struct QuantizedMeshRays<'a> {
    mesh: &'a PreparedMesh,
    /// The BVH, or `None` if no triangle with an area is left.
    occluder: Option<RayScene>,
}

impl<'a> QuantizedMeshRays<'a> {
    /// Builds the BVH.
    pub fn new(mesh: &'a PreparedMesh) -> Self {
        let in_cells = |p: &[i32; 3]| p.map(|v| mesh.lattice().in_cells(v));
        let whole = Part {
            name: String::new(),
            triangles: 0..mesh.triangles().len(),
        };
        let positions = mesh.vertices().iter().map(in_cells).collect();
        // The only possible error is a mesh without triangles that have an area.
        let quantized = TriangleMesh::new(positions, mesh.triangles().to_vec(), vec![whole]);
        Self {
            mesh,
            occluder: quantized.ok().as_ref().map(RayScene::new),
        }
    }

    /// Whether the ray from the sample of a cell in `direction` (object axes, any length) is
    /// occluded.
    pub fn is_occluded(&self, cell: [u32; 3], direction: [f64; 3]) -> bool {
        let size = self.mesh.spec().cell_size();
        let in_cells = std::array::from_fn(|x| direction[x] / size[x]);
        let hides = |o: &RayScene| o.is_occluded(cell.map(f64::from), in_cells, f64::INFINITY);
        self.occluder.as_ref().is_some_and(hides)
    }

    /// Returns the occlusion bits of the cube faces of every cell, with `size`² texels per face.
    pub fn faces(&self, size: u32) -> FaceBits {
        let texels = cube_face::texels(size);
        let spec = self.mesh.spec();
        let occluded = |cell_idx: usize| {
            let cell = spec.cell_at(cell_idx);
            let hides = |(_, t): &(usize, &cube_face::Texel)| self.is_occluded(cell, t.direction);
            let occluded_texels = texels.iter().enumerate().filter(hides);
            occluded_texels.map(|(texel, _)| texel).collect()
        };
        let cells: Vec<Vec<usize>> = (0..spec.cell_count())
            .into_par_iter()
            .map(occluded)
            .collect();
        let mut bits = FaceBits::new(cells.len(), size);
        for (cell, occluded_texels) in cells.iter().enumerate() {
            occluded_texels
                .iter()
                .for_each(|&texel| bits.set(cell, texel));
        }
        bits
    }
}
