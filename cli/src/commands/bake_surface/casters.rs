//! The triangles that occlude: the model's own, and those of other models.

use std::path::Path;

use anyhow::Context;
use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::mesh::{self, MeshFile, Part};
use aogrid_bake_core::surface::{SurfacePoint, VertexGroups};

use super::{Args, file_name};
use crate::console::Console;

/// The mesh that occludes.
pub(super) struct Casters {
    pub mesh: TriangleMesh,
    /// The origin of the model's coordinates relative to that of the mesh.
    shift: [f64; 3],
    /// The names of the other models' files.
    pub names: Vec<String>,
    /// The finer model that points are moved onto.
    pub high: Option<High>,
}

/// A finer model, in the coordinates of its file.
pub(super) struct High {
    pub mesh: TriangleMesh,
    pub groups: VertexGroups,
    pub name: String,
}

impl High {
    fn read(path: &Path, console: &Console) -> anyhow::Result<Self> {
        let shown = path.display();
        let file = MeshFile::read(path).with_context(|| shown.to_string())?;
        // An OBJ file has normals apart from positions, which only its textured form joins.
        let (loaded, normals) = match file.obj_attributes() {
            Ok(Some((_, normals))) => (file.parse_textured(), normals),
            _ => (file.parse(), None),
        };
        let loaded = loaded.with_context(|| shown.to_string())?;
        let normals = match normals {
            Some(normals) => Some(normals),
            None => file.normals(&loaded).with_context(|| shown.to_string())?,
        };
        for warning in &loaded.warnings {
            console.warning(&format!("{shown}: {warning}"));
        }
        Ok(Self {
            groups: VertexGroups::new(&loaded.mesh, normals),
            mesh: loaded.mesh,
            name: file_name(path),
        })
    }
}

impl Casters {
    pub(super) fn new(
        model: &TriangleMesh,
        args: &Args,
        console: &Console,
    ) -> anyhow::Result<Self> {
        let others = &args.occluders;
        let high = match &args.high {
            Some(path) => Some(High::read(path, console)?),
            None => None,
        };
        let own = high.as_ref().map_or(model, |high| &high.mesh);
        let mut casters = Self {
            mesh: own.clone(),
            shift: [0.0; 3],
            names: others.iter().map(|path| file_name(path)).collect(),
            high: None,
        };
        if others.is_empty() {
            casters.set_shift(model);
            casters.high = high;
            return Ok(casters);
        }
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        add(own, &mut positions, &mut triangles);
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
        casters.set_shift(model);
        casters.high = high;
        Ok(casters)
    }

    fn set_shift(&mut self, model: &TriangleMesh) {
        let (from, to) = (model.origin(), self.mesh.origin());
        self.shift = [0, 1, 2].map(|x| from[x] - to[x]);
    }

    /// Returns points of the model in the coordinates of the mesh that occludes.
    pub(super) fn points(&self, points: &[SurfacePoint]) -> Vec<SurfacePoint> {
        let moved = |point: &SurfacePoint| SurfacePoint {
            position: [0, 1, 2].map(|x| point.position[x] + self.shift[x]),
            ..*point
        };
        points.iter().map(moved).collect()
    }

    /// Returns the height of the lowest point of the model, or of the finer one, in the coordinates of the mesh that occludes.
    pub(super) fn height(&self, model: &TriangleMesh) -> f64 {
        match &self.high {
            Some(High { mesh, .. }) => {
                f64::from(mesh.bounds().min[1]) + mesh.origin()[1] - self.mesh.origin()[1]
            }
            None => f64::from(model.bounds().min[1]) + self.shift[1],
        }
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
