//! Scenes: instances of meshes, occluders and receivers, camera and lights. `docs/scenes.md`
//! documents the files.
//!
//! [`load`] reads a file and the geometry that it names; grids ([`Grids`]) and the environment's
//! map ([`EnvironmentSource::load`]) are read or made when a mode needs them. [`shade`] has the
//! modes, [`mod@reference`] the truth.

mod build;
mod camera;
pub mod compare;
mod diagnostics;
mod environment;
mod error;
mod gbuffer;
mod grids;
mod paths;
mod receivers;
pub mod reference;
mod schema;
pub mod shade;
pub mod suite;
mod values;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{Context, ensure};
use crate::reference::{AreaLight, ReferenceOptions};
use aogrid_bake_core::mesh::{Part, Pose};
use aogrid_bake_core::surface::SurfaceOptions;
use aogrid_bake_core::{BakeOptions, Placement, TriangleMesh};
use aogrid_grid_format::{Grid, Source};
use aogrid_runtime::VolumeWeight;
use glam::{DAffine3, DVec3};

pub use camera::{Camera, Projection};
pub use environment::EnvironmentSource;
pub use error::{Result, SceneError};
pub use gbuffer::GBuffer;
pub use gbuffer::{channel, exr};
pub use grids::{Grids, read_grid};
pub use receivers::ReceiverList;

/// A complete scene in world space: every index is valid, every number finite.
pub struct Scene {
    /// The scene file.
    pub path: PathBuf,
    /// The world's up direction.
    pub up: DVec3,
    /// The camera of the picture, if there is one.
    pub camera: Option<Camera>,
    /// The points to shade for a table instead of a picture.
    pub receivers: Option<ReceiverList>,
    /// The instances in the file's order: at most 65,535, with distinct ids.
    pub instances: Vec<Instance>,
    /// The meshes of the instances.
    pub meshes: Vec<SceneMesh>,
    /// The materials; the first one is white, for instances that name none.
    pub materials: Vec<Material>,
    /// The ambient light, which occlusion reduces, as radiance.
    pub ambient: [f32; 3],
    /// The source of direct light.
    pub area_light: Option<AreaLight>,
    /// The environment around the scene.
    pub environment: Option<EnvironmentSource>,
    /// The options of path-traced truth; the command line may override them.
    pub truth: ReferenceOptions,
    /// The volumes in which triangles occlude, in mode `volumes`.
    pub volumes: VolumeSettings,
    /// The factor for radiance in pictures.
    pub exposure: f32,
    /// Whether pictures show light; otherwise they show 1 − AO.
    pub shows_light: bool,
    /// Notes of the mesh readers about what they left out or guessed, one line each.
    pub warnings: Vec<String>,
}

/// The volumes in which triangles occlude, in mode `volumes`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeSettings {
    /// The distance at which occlusion ends, in world units; `None` for a quarter of the occluders'
    /// largest extent.
    pub extent: Option<f32>,
    /// The fall-off within it.
    pub weight: VolumeWeight,
    /// Whether triangles occlude on both sides.
    pub two_sided: bool,
}

/// A mesh in object space and the grid around it.
pub struct SceneMesh {
    /// The name in the scene; `mesh/part` for a part.
    pub name: String,
    /// The triangles, as the scene poses them.
    pub mesh: Arc<TriangleMesh>,
    /// The triangles that the grid is baked from, if they are posed otherwise: in bind pose.
    pub bind: Option<Arc<TriangleMesh>>,
    /// The pose of the part in its model, which an instance's transform comes after.
    pub(crate) pose: Pose,
    /// The origin of the triangles, as a grid's metadata records it.
    pub source: Source,
    /// The origin of the mesh's grid.
    pub grid: GridSource,
    /// The origin of the values on its surface.
    pub surface: SurfaceSource,
}

/// The origin of a grid.
#[derive(Clone, Debug, PartialEq)]
pub enum GridSource {
    /// The grid is read from this file.
    File(PathBuf),
    /// The grid is baked.
    Bake(Placement, BakeOptions),
    /// The grid is at hand.
    Given(Arc<Grid>),
}

/// The origin of accessibility and bent normals on a mesh.
#[derive(Clone, Debug, PartialEq)]
pub enum SurfaceSource {
    /// A GLB of the same shape, with values at its vertices.
    File(PathBuf),
    /// A bake at every receiver, as a texture without texels would have it.
    Bake(SurfaceOptions),
}

/// An object in the scene.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The name in messages.
    pub name: String,
    /// The id in G-buffers: 1 to 65,535.
    pub id: u32,
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// The transform from object space to world space.
    pub world_from_object: DAffine3,
    /// Whether the scale is the same along all axes up to signs; otherwise a cone's direction and
    /// solid angle are only approximate.
    pub is_similarity: bool,
    /// Whether it occludes.
    pub casts: bool,
    /// The factor for the grid's occlusion. Truth ignores it.
    pub strength: f32,
    /// The AO at which the far field ends, 0..=1; `None` leaves it to the grid. Truth ignores it.
    pub far_field: Option<f32>,
    /// The layers that the instance belongs to as a receiver, a bit each.
    pub layers: u32,
    /// The layers that the instance casts on as an occluder, a bit each. Truth ignores layers.
    pub casts_on: u32,
    /// The ids of receivers that the instance does not cast on, perhaps its own. Truth ignores
    /// them.
    pub excludes: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// The reflectance of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name in the scene.
    pub name: String,
    /// The reflected share of light: linear red, green, blue.
    pub albedo: [f32; 3],
    /// The half-angle, in radians up to π/2, of the cone around the mirrored direction that a
    /// glossy surface reflects; `None` for a diffuse surface.
    pub gloss: Option<f64>,
}

/// Options of [`load`].
#[derive(Clone, Copy, Debug, Default)]
pub struct LoadOptions {
    /// The number of occluders to keep, in the file's order; all if `None`.
    pub occluders: Option<usize>,
}

/// The maximum size of a scene file in bytes.
const MAX_FILE_BYTES: u64 = 16 << 20;

/// Reads the scene in the file at `path`, and its meshes and receivers.
///
/// # Errors
///
/// One line that names the file, and for errors in the scene file the line and key.
pub fn load(path: &Path, options: LoadOptions) -> Result<Scene> {
    let shown = || path.display().to_string();
    let metadata = fs::metadata(path).with_context(shown)?;
    ensure!(metadata.is_file(), "{}: it is not a regular file", shown());
    let bytes = metadata.len();
    ensure!(
        bytes <= MAX_FILE_BYTES,
        "{}: {bytes} bytes are too many for a scene file: keep meshes in files of their own",
        shown()
    );
    let text = fs::read_to_string(path).with_context(shown)?;
    parse(path, &text, options)
}

/// Parses `text` as the scene file at `path`, which need not exist; files that the scene names are
/// relative to it.
///
/// # Errors
///
/// The same as those of [`load`].
pub fn parse(path: &Path, text: &str, options: LoadOptions) -> Result<Scene> {
    let source = diagnostics::SceneText::new(path, text);
    build::Builder::new(&source).build(source.parse()?, options)
}

impl Default for VolumeSettings {
    /// The linear weight with an exponent of 1, on the front alone.
    fn default() -> Self {
        Self {
            extent: None,
            weight: VolumeWeight::Linear { exponent: 1.0 },
            two_sided: false,
        }
    }
}

impl Instance {
    /// Whether the instance shades a receiver with this id and these layers.
    pub(crate) fn casts_on_receiver(&self, id: u32, layers: u32) -> bool {
        self.casts_on & layers != 0 && !self.excludes.contains(&id)
    }
}

impl Scene {
    /// Returns the instances that cast, in the file's order; an occluder's index is its position in
    /// this sequence.
    pub fn casters(&self) -> impl Iterator<Item = &Instance> {
        self.instances.iter().filter(|instance| instance.casts)
    }

    /// Whether anything lights the scene.
    pub fn is_lit(&self) -> bool {
        self.ambient != [0.0; 3] || self.area_light.is_some() || self.environment.is_some()
    }

    /// Returns the chosen instances as one mesh in world space with a part for each; `None` without
    /// triangles. Far from zero its coordinates are relative to an origin.
    ///
    /// # Errors
    ///
    /// Coordinates exceed single floats, or vertices exceed 32-bit indices.
    pub fn flattened(&self, chosen: impl Fn(&Instance) -> bool) -> Result<Option<TriangleMesh>> {
        let (mut positions, mut triangles, mut parts) = (vec![], vec![], vec![]);
        for instance in self.instances.iter().filter(|i| chosen(i)) {
            let mesh = &self.meshes[instance.mesh].mesh;
            let first = u32::try_from(positions.len() + mesh.positions().len())
                .map(|_| positions.len() as u32);
            let first = first.with_context(|| {
                format!("{}: more vertices than can be counted", self.path.display())
            })?;
            let origin = DVec3::from_array(mesh.origin());
            let placed = mesh.positions().iter().map(|p| {
                let local = origin + DVec3::from_array(p.map(f64::from));
                instance
                    .world_from_object
                    .transform_point3(local)
                    .to_array()
            });
            positions.extend(placed);
            let start = triangles.len();
            triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| v + first)));
            parts.push(Part {
                name: instance.name.clone(),
                triangles: start..triangles.len(),
            });
        }
        if triangles.is_empty() {
            return Ok(None);
        }
        let mesh = TriangleMesh::from_f64(&positions, triangles, parts)
            .with_context(|| format!("{}: the scene in world space", self.path.display()))?;
        Ok(Some(mesh))
    }
}
