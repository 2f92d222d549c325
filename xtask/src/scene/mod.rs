//! Scenes: what is where, what casts, who receives, from which camera. `docs/scenes.md` explains
//! the files.
//!
//! [`load`] reads a file and everything in it that is geometry; grids ([`Grids`]) and the
//! environment's map ([`EnvironmentSource::load`]) are read or made when a mode needs them.

mod build;
mod camera;
mod environment;
mod gbuffer;
mod grids;
mod numbers;
mod places;
mod receivers;
mod schema;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use aogrid_bake_core::mesh::Part;
use aogrid_bake_core::{BakeOptions, Placement, TriangleMesh};
use aogrid_baker_cpu::truth::{AreaLight, TruthOptions};
use aogrid_grid_format::Source;
use glam::{DAffine3, DVec3};

pub use camera::{Camera, Projection};
pub use environment::EnvironmentSource;
pub use gbuffer::GBuffer;
pub(crate) use gbuffer::{channel, exr};
pub use grids::Grids;
pub use receivers::ReceiverList;

/// A scene in world space, whole: every index is valid, every number finite.
pub struct Scene {
    /// The file.
    pub path: PathBuf,
    /// The world's up.
    pub up: DVec3,
    /// From where the picture is taken, if there is one.
    pub camera: Option<Camera>,
    /// The points to shade where no picture is asked for.
    pub receivers: Option<ReceiverList>,
    /// What stands in it, in the file's order. At most 65,535 instances, with distinct ids.
    pub instances: Vec<Instance>,
    /// What the instances are of.
    pub meshes: Vec<SceneMesh>,
    /// How surfaces reflect; the first one is white, for instances without.
    pub materials: Vec<Material>,
    /// Light that comes from everywhere and that occlusion takes away, as radiance.
    pub ambient: [f32; 3],
    /// Direct light.
    pub area_light: Option<AreaLight>,
    /// What surrounds all.
    pub environment: Option<EnvironmentSource>,
    /// How truth is found unless the command line says otherwise.
    pub truth: TruthOptions,
    /// What multiplies radiance in pictures.
    pub exposure: f32,
    /// Whether pictures show light; else 1 − AO.
    pub shows_light: bool,
}

/// A mesh in object space and the grid around it.
pub struct SceneMesh {
    /// The name in the scene; `mesh/part` for a part.
    pub name: String,
    /// The triangles.
    pub mesh: TriangleMesh,
    /// Where it came from, as a grid's metadata says it.
    pub source: Source,
    /// Where its grid comes from.
    pub grid: GridSource,
}

/// Where a grid comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum GridSource {
    /// A grid file.
    File(PathBuf),
    /// It is baked.
    Bake(Placement, BakeOptions),
}

/// An object in the scene.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The name in messages.
    pub name: String,
    /// What G-buffers hold where it is seen: 1 to 65,535.
    pub id: u32,
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// The object's place.
    pub world_from_object: DAffine3,
    /// Whether the scale is the same along all axes but for signs; otherwise a cone's direction
    /// and solid angle are only approximate.
    pub is_similarity: bool,
    /// Whether it occludes.
    pub casts: bool,
    /// What its grid's occlusion is multiplied by. Truth knows no such thing.
    pub strength: f32,
    /// As a receiver: a bit for each layer that it belongs to.
    pub layers: u32,
    /// As an occluder: a bit for each layer that it casts on. Truth knows no layers.
    pub casts_on: u32,
    /// As an occluder: ids that it does not cast on, its own perhaps. Truth ignores them.
    pub excludes: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// How a surface reflects.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name in the scene.
    pub name: String,
    /// The reflected share of light: red, green, blue, linear.
    pub albedo: [f32; 3],
    /// Of the cone around the mirrored direction that a glossy surface reflects, the half-angle, in
    /// radians, up to π/2; none: it reflects diffusely.
    pub gloss: Option<f64>,
}

/// How a scene is read.
#[derive(Clone, Copy, Debug, Default)]
pub struct LoadOptions {
    /// Only so many of the casting instances, in the file's order; the others are left out.
    pub occluders: Option<usize>,
}

/// The most bytes a scene file may have.
const MAX_FILE: u64 = 16 << 20;

/// Reads the scene in the file at `path`, and its meshes and receivers.
///
/// # Errors
///
/// One line that names the file, and for what is wrong in the scene file its line and key.
pub fn load(path: &Path, options: LoadOptions) -> anyhow::Result<Scene> {
    let shown = || path.display().to_string();
    let metadata = fs::metadata(path).with_context(shown)?;
    ensure!(metadata.is_file(), "{}: it is not a regular file", shown());
    let bytes = metadata.len();
    ensure!(
        bytes <= MAX_FILE,
        "{}: {bytes} bytes are too many for a scene, of which meshes are no part",
        shown()
    );
    let text = fs::read_to_string(path).with_context(shown)?;
    parse(path, &text, options)
}

/// [`load`] for a text that stands in `path`, which need not exist; files that it names lie
/// relative to it.
///
/// # Errors
///
/// As [`load`].
pub fn parse(path: &Path, text: &str, options: LoadOptions) -> anyhow::Result<Scene> {
    let source = places::Source::new(path, text);
    build::Builder::new(&source).build(source.parse()?, options)
}

impl Scene {
    /// The instances that cast, in the file's order: an occluder's index is its place in it.
    pub fn casters(&self) -> impl Iterator<Item = &Instance> {
        self.instances.iter().filter(|instance| instance.casts)
    }

    /// Whether anything lights the scene.
    pub fn is_lit(&self) -> bool {
        self.ambient != [0.0; 3] || self.area_light.is_some() || self.environment.is_some()
    }

    /// The chosen instances as one mesh in world space, a part each; none without any. Its
    /// coordinates are rounded to single floats.
    ///
    /// # Errors
    ///
    /// Coordinates beyond single floats, more triangles than 32 bits count.
    pub fn flattened(
        &self,
        chosen: impl Fn(&Instance) -> bool,
    ) -> anyhow::Result<Option<TriangleMesh>> {
        let (mut positions, mut triangles, mut parts) = (vec![], vec![], vec![]);
        for instance in self.instances.iter().filter(|i| chosen(i)) {
            let mesh = &self.meshes[instance.mesh].mesh;
            let first = u32::try_from(positions.len() + mesh.positions().len())
                .map(|_| positions.len() as u32);
            let first = first.with_context(|| {
                format!("{}: more vertices than can be counted", self.path.display())
            })?;
            let placed = mesh.positions().iter().map(|p| {
                let local = DVec3::from_array(p.map(f64::from));
                let world = instance.world_from_object.transform_point3(local);
                world.to_array().map(|v| v as f32)
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
        let mesh = TriangleMesh::new(positions, triangles, parts)
            .with_context(|| format!("{}: the scene in world space", self.path.display()))?;
        Ok(Some(mesh))
    }
}
