//! The grids of a scene's occluders.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use crate::error::{Context, ensure};
use aogrid_bake_core::mesh::MeshReport;
use aogrid_bake_core::{BakeOptions, Observer, Placement, TriangleMesh, bake_grid_at};
use aogrid_baker_cpu::Baker;
use aogrid_grid_format::{Grid, GridSpec, Source};

use super::{GridSource, Scene, SceneMesh};
use aogrid_bake_core::warnings;

/// Reads the grid file at `path`.
///
/// # Errors
///
/// The file cannot be read or is not a grid: the message names it.
pub fn read_grid(path: &Path) -> crate::Result<Grid> {
    let shown = || path.display().to_string();
    // Reading from a device or pipe might never end.
    let metadata = fs::metadata(path).with_context(shown)?;
    ensure!(metadata.is_file(), "{}: it is not a regular file", shown());
    let bytes = fs::read(path).with_context(shown)?;
    Grid::from_bytes(&bytes).with_context(shown)
}

/// Bakes the grid at `spec`, which `placement` describes.
pub(crate) fn bake(
    mesh: &TriangleMesh,
    source: &Source,
    spec: GridSpec,
    placement: &Placement,
    options: &BakeOptions,
    observer: Observer<'_>,
) -> crate::Result<Grid> {
    let mut baker = Baker::new(None);
    let source = source.clone();
    bake_grid_at(spec, mesh, placement, options, source, |spec, options| {
        Ok(baker
            .prepare_observed(mesh, spec, options, observer)?
            .bake(observer)?)
    })
}

/// A cache of grids that were read or baked; one cache may serve many scenes.
#[derive(Default)]
pub struct Grids {
    entries: Vec<(GridSource, Source, Arc<Grid>)>,
    warnings: Vec<String>,
}

impl Grids {
    /// Creates an empty cache.
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the grid of each mesh that a casting instance uses, and `None` for the other meshes,
    /// in the order of [`Scene::meshes`].
    ///
    /// # Errors
    ///
    /// A file is not a grid, a mesh cannot be baked, or the observer cancelled: with the mesh's
    /// name.
    pub fn resolve(
        &mut self,
        scene: &Scene,
        observer: Observer<'_>,
    ) -> crate::Result<Vec<Option<Arc<Grid>>>> {
        self.resolve_chosen(scene, |_| true, observer)
    }

    /// Returns the same for casting instances of chosen meshes alone.
    pub(crate) fn resolve_chosen(
        &mut self,
        scene: &Scene,
        chosen: impl Fn(&SceneMesh) -> bool,
        observer: Observer<'_>,
    ) -> crate::Result<Vec<Option<Arc<Grid>>>> {
        let used = |idx: usize| {
            chosen(&scene.meshes[idx]) && scene.casters().any(|instance| instance.mesh == idx)
        };
        let meshes = scene.meshes.iter().enumerate();
        meshes
            .map(|(idx, mesh)| match used(idx) {
                true => self.grid_of(mesh, observer).map(Some).with_context(|| {
                    format!("{}: grid of mesh `{}`", scene.path.display(), mesh.name)
                }),
                false => Ok(None),
            })
            .collect()
    }

    /// Returns and forgets the warnings about grids baked since the last call, one line each.
    pub fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }

    /// Returns the grid of a mesh: from the cache, from its file, or baked.
    fn grid_of(&mut self, mesh: &SceneMesh, observer: Observer<'_>) -> crate::Result<Arc<Grid>> {
        let known = self
            .entries
            .iter()
            .find(|(grid, source, _)| *grid == mesh.grid && *source == mesh.source);
        if let Some((_, _, grid)) = known {
            return Ok(grid.clone());
        }
        let grid = Arc::new(match &mesh.grid {
            GridSource::Given(grid) => return Ok(grid.clone()),
            GridSource::File(path) => read_grid(path)?,
            GridSource::Bake(placement, options) => {
                let triangles = mesh.bind.as_ref().unwrap_or(&mesh.mesh);
                let spec = placement.place(&triangles.bounds())?;
                let source = &mesh.source;
                let grid = bake(triangles, source, spec, placement, options, observer)?;
                let mut warnings = warnings(&grid, &MeshReport::new(triangles));
                if mesh.bind.is_some() {
                    let pose = "its grid is that of its bind pose; mode volumes follows its pose";
                    warnings.push(pose.into());
                }
                let named = |warning| format!("mesh `{}`: {warning}", mesh.name);
                self.warnings.extend(warnings.into_iter().map(named));
                grid
            }
        });
        let entry = (mesh.grid.clone(), mesh.source.clone(), grid.clone());
        self.entries.push(entry);
        Ok(grid)
    }
}
