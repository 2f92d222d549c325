//! The triangles that occlude: the model's own, and those of other models.

use std::path::PathBuf;

use anyhow::Context;
use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::mesh::{self, Part};
use aogrid_bake_core::surface::SurfacePoint;

use super::file_name;
use crate::console::Console;

/// The mesh that occludes.
pub(super) struct Casters {
    pub mesh: TriangleMesh,
    /// The origin of the model's coordinates relative to that of the mesh.
    shift: [f64; 3],
    /// The names of the other models' files.
    pub names: Vec<String>,
}

impl Casters {
    pub(super) fn new(
        model: &TriangleMesh,
        others: &[PathBuf],
        console: &Console,
    ) -> anyhow::Result<Self> {
        let mut casters = Self {
            mesh: model.clone(),
            shift: [0.0; 3],
            names: others.iter().map(|path| file_name(path)).collect(),
        };
        if others.is_empty() {
            return Ok(casters);
        }
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        add(model, &mut positions, &mut triangles);
        for path in others {
            let shown = path.display();
            let other = mesh::load(path).with_context(|| shown.to_string())?;
            for warning in &other.warnings {
                console.warning(&format!("{shown}: {warning}"));
            }
            add(&other.mesh, &mut positions, &mut triangles);
        }
        let whole = Part {
            name: "occluders".into(),
            triangles: 0..triangles.len(),
        };
        casters.mesh = TriangleMesh::from_f64(&positions, triangles, vec![whole])?;
        let (from, to) = (model.origin(), casters.mesh.origin());
        casters.shift = [0, 1, 2].map(|x| from[x] - to[x]);
        Ok(casters)
    }

    /// Returns points of the model in the coordinates of the mesh that occludes.
    pub(super) fn points(&self, points: &[SurfacePoint]) -> Vec<SurfacePoint> {
        let moved = |point: &SurfacePoint| SurfacePoint {
            position: [0, 1, 2].map(|x| point.position[x] + self.shift[x]),
            ..*point
        };
        points.iter().map(moved).collect()
    }

    /// Returns the height of the model's lowest point in the coordinates of the mesh that occludes.
    pub(super) fn height(&self, model: &TriangleMesh) -> f64 {
        f64::from(model.bounds().min[1]) + self.shift[1]
    }
}

/// Adds a mesh's triangles, in the coordinates of its file. Vertices of no triangle are left at zero:
/// they need not be finite.
fn add(mesh: &TriangleMesh, positions: &mut Vec<[f64; 3]>, triangles: &mut Vec<[u32; 3]>) {
    let first = positions.len() as u32;
    let origin = mesh.origin();
    positions.resize(positions.len() + mesh.positions().len(), [0.0; 3]);
    for triangle in mesh.triangles() {
        for &vertex in triangle {
            let p = mesh.positions()[vertex as usize];
            let position = [0, 1, 2].map(|x| f64::from(p[x]) + origin[x]);
            positions[(first + vertex) as usize] = position;
        }
        triangles.push(triangle.map(|vertex| first + vertex));
    }
}
