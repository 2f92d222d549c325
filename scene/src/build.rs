//! Conversion of a parsed scene file to a scene.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::error::{Context, SceneError};
use crate::reference::{AreaLight, ReferenceOptions};
use aogrid_bake_core::mesh::{self, LoadedMesh, Part};
use aogrid_bake_core::models::{Model, to_obj};
use aogrid_bake_core::{BakeOptions, Extent, Placement, TriangleMesh};
use aogrid_grid_format::{Sampling, Source as MeshSource};
use glam::{DAffine3, DQuat, DVec3};
use toml::Spanned;

use super::camera::Camera;
use super::diagnostics::SceneText;
use super::environment::EnvironmentSource;
use super::schema::{
    AreaLightFile, GridFile, InstanceFile, Layer, MaterialFile, MeshFile, SceneFile, ShowFile,
    TruthFile, UpAxis,
};
use super::values::{OneOrThree, Whole, color, triple};
use super::{
    GridSource, Instance, LoadOptions, Material, ReceiverList, Scene, SceneMesh, receivers,
};

/// The largest half-angle of a glossy lobe, in degrees.
const MAX_GLOSS_DEGREES: f64 = 90.0;

/// The maximum number of instances; each part counts.
const MAX_INSTANCES: usize = 65_535;

/// The scene built so far, and the file's text to locate errors in.
pub(super) struct Builder<'a> {
    source: &'a SceneText<'a>,
    meshes: Vec<SceneMesh>,
    /// The meshes of each name in the file.
    named: HashMap<String, NamedMesh>,
    materials: Vec<Material>,
    instances: Vec<Instance>,
    /// The name of the instance that has an id.
    ids: HashMap<u32, String>,
}

/// The consecutive meshes that one `[[mesh]]` became: one, or one for each part.
#[derive(Clone, Copy)]
struct NamedMesh {
    first: usize,
    count: usize,
    is_rectangle: bool,
}

impl<'a> Builder<'a> {
    pub(super) fn new(source: &'a SceneText<'a>) -> Self {
        let white = Material {
            name: "white".into(),
            albedo: [1.0; 3],
            gloss: None,
        };
        Self {
            source,
            meshes: vec![],
            named: HashMap::new(),
            materials: vec![white],
            instances: vec![],
            ids: HashMap::new(),
        }
    }

    pub(super) fn build(mut self, file: SceneFile, options: LoadOptions) -> crate::Result<Scene> {
        for material in file.materials {
            self.material(material)?;
        }
        for mesh in file.meshes {
            self.mesh(mesh)?;
        }
        for instance in file.instances {
            self.instance(instance)?;
        }
        if let Some(limit) = options.occluders {
            self.limit_occluders(limit);
        }
        let path = self.source.path;
        let up_axis = file.up.unwrap_or_default();
        let up = up_axis.vector();
        let camera = match file.camera {
            Some(camera) => Some(Camera::new(self.source, &camera, up)?),
            None => None,
        };
        let receivers = match file.receivers {
            Some(list) => Some(self.receivers(&list)?),
            None => None,
        };
        let area_light = match file.area_light {
            Some(light) => Some(self.area_light(&light)?),
            None => None,
        };
        let environment = match file.environment {
            Some(environment) => Some(EnvironmentSource::new(self.source, environment, up_axis)?),
            None => None,
        };
        let picture = file.picture.as_ref();
        let show = picture.and_then(|picture| picture.show);
        let mut scene = Scene {
            path: path.to_owned(),
            up,
            camera,
            receivers,
            instances: self.instances,
            meshes: self.meshes,
            materials: self.materials,
            ambient: file.ambient.map_or([0.0; 3], color),
            area_light,
            environment,
            truth: truth_options(file.truth),
            exposure: picture
                .and_then(|picture| picture.exposure)
                .map_or(1.0, |v| v.f32()),
            shows_light: false,
        };
        scene.shows_light = match show {
            Some(ShowFile::Ao) => false,
            Some(ShowFile::Light) => true,
            None => scene.is_lit(),
        };
        Ok(scene)
    }

    fn material(&mut self, file: MaterialFile) -> crate::Result<()> {
        let name = file.name.get_ref();
        if self.materials.iter().skip(1).any(|m| m.name == *name) {
            return Err(self.duplicate_name(&file.name, "material"));
        }
        if let Some(gloss) = file
            .gloss
            .as_ref()
            .filter(|v| v.get_ref().0 > MAX_GLOSS_DEGREES)
        {
            let message = format!(
                "{} degrees are more than {MAX_GLOSS_DEGREES}",
                gloss.get_ref().0
            );
            return Err(self.source.error_at(gloss, "material.gloss", &message));
        }
        self.materials.push(Material {
            name: name.clone(),
            albedo: color(file.albedo),
            gloss: file.gloss.map(|v| v.get_ref().0.to_radians()),
        });
        Ok(())
    }

    /// Returns the error for a name that is already in use.
    fn duplicate_name(&self, name: &Spanned<String>, what: &str) -> SceneError {
        let message = format!("there is already a {what} `{}`", name.get_ref());
        self.source
            .error_at(name, &format!("{what}.name"), &message)
    }

    fn mesh(&mut self, file: Spanned<MeshFile>) -> crate::Result<()> {
        let span = Spanned::new(file.span(), ());
        let file = file.into_inner();
        if self.named.contains_key(file.name.get_ref()) {
            return Err(self.duplicate_name(&file.name, "mesh"));
        }
        let grid = self.grid(&file)?;
        let loaded = self.load_mesh(&file, &span)?;
        let name = file.name.get_ref();
        let first = self.meshes.len();
        if file.parts == Some(true) {
            for idx in 0..loaded.mesh.parts().len() {
                let part = loaded.mesh.parts()[idx].name.clone();
                let mesh = self.part_of(&loaded, idx, &span)?;
                self.push_mesh(format!("{name}/{part}"), mesh, &loaded, Some(part), &grid);
            }
        } else if let Some(part) = &file.part {
            let parts = loaded.mesh.parts();
            let Some(idx) = parts.iter().position(|p| p.name == *part.get_ref()) else {
                let names: Vec<_> = parts.iter().map(|p| p.name.as_str()).collect();
                let message = format!("no such part; there are: {}", names.join(", "));
                return Err(self.source.error_at(part, "mesh.part", &message));
            };
            let mesh = self.part_of(&loaded, idx, &span)?;
            let part = Some(part.get_ref().clone());
            self.push_mesh(name.clone(), mesh, &loaded, part, &grid);
        } else {
            self.push_mesh(name.clone(), loaded.mesh.clone(), &loaded, None, &grid);
        }
        let named = NamedMesh {
            first,
            count: self.meshes.len() - first,
            is_rectangle: file.rectangle.is_some(),
        };
        self.named.insert(name.clone(), named);
        Ok(())
    }

    fn part_of(
        &self,
        loaded: &LoadedMesh,
        idx: usize,
        span: &Spanned<()>,
    ) -> crate::Result<TriangleMesh> {
        loaded
            .mesh
            .part(idx)
            .map_err(|e| self.source.error_at(span, "mesh.parts", &e.to_string()))
    }

    fn push_mesh(
        &mut self,
        name: String,
        mesh: TriangleMesh,
        loaded: &LoadedMesh,
        part: Option<String>,
        grid: &GridSource,
    ) {
        self.meshes.push(SceneMesh {
            name,
            source: MeshSource {
                part,
                triangles: mesh.triangles().len() as u64,
                ..MeshSource::from(loaded)
            },
            mesh,
            grid: grid.clone(),
        });
    }

    fn load_mesh(&self, file: &MeshFile, span: &Spanned<()>) -> crate::Result<LoadedMesh> {
        let error = |key: &str, message: &str| self.source.error_at(span, key, message);
        if file.parts.is_some() && file.part.is_some() {
            return Err(error("mesh.part", "`parts` and `part` exclude each other"));
        }
        if file.triangles.is_some() && file.sample.is_none() {
            return Err(error(
                "mesh.triangles",
                "only a built-in `sample` can be refined",
            ));
        }
        match (&file.file, &file.sample, file.rectangle) {
            (Some(name), None, None) => {
                let path = resolve(self.source.path, name);
                mesh::load(&path)
                    .with_context(|| path.display())
                    .with_context(|| error("mesh.file", "cannot use it").to_string())
            }
            (None, Some(name), None) => self.sample(name, file.triangles),
            (None, None, Some(size)) => Ok(rectangle(size.map(|v| v.f32() / 2.0))),
            _ => Err(error(
                "mesh",
                "exactly one of `file`, `sample` and `rectangle` is needed",
            )),
        }
    }

    fn sample(
        &self,
        name: &Spanned<String>,
        triangles: Option<Whole<1, 20_000_000>>,
    ) -> crate::Result<LoadedMesh> {
        let Some(sample) = Model::ALL.iter().find(|s| s.name() == name.get_ref()) else {
            let names = Model::ALL.map(Model::name).join(", ");
            let message = format!("no such sample; there are: {names}");
            return Err(self.source.error_at(name, "mesh.sample", &message));
        };
        let mesh = sample
            .mesh(triangles.map(|n| n.0 as usize))
            .map_err(|e| self.source.error_at(name, "mesh.triangles", &e.to_string()))?;
        Ok(loaded_from_memory(mesh, sample.name()))
    }

    fn grid(&self, file: &MeshFile) -> crate::Result<GridSource> {
        let Some(spanned) = &file.grid else {
            return Ok(GridSource::Bake(
                Placement::default(),
                BakeOptions::recommended(),
            ));
        };
        let grid = spanned.get_ref();
        let error = |message: &str| self.source.error_at(spanned, "mesh.grid", message);
        if let Some(name) = &grid.file {
            if !is_only_file(grid) {
                return Err(error(
                    "with `file` there is nothing to bake: leave out the other keys",
                ));
            }
            if file.parts == Some(true) {
                return Err(error(
                    "a file is the grid of one mesh, not of its parts: name a `part`",
                ));
            }
            return Ok(GridSource::File(resolve(self.source.path, name)));
        }
        if grid.epsilon.is_some() && grid.half_extents.is_some() {
            return Err(error("`epsilon` and `half_extents` exclude each other"));
        }
        let placement = placement(grid);
        let options = bake_options(grid).map_err(error)?;
        options.validate().map_err(|e| error(&e.to_string()))?;
        Ok(GridSource::Bake(placement, options))
    }

    fn instance(&mut self, file: Spanned<InstanceFile>) -> crate::Result<()> {
        let span = Spanned::new(file.span(), ());
        let file = file.into_inner();
        let Some(&named) = self.named.get(file.mesh.get_ref()) else {
            let message = format!("there is no mesh `{}`", file.mesh.get_ref());
            return Err(self.source.error_at(&file.mesh, "instance.mesh", &message));
        };
        let material = match &file.material {
            None => 0,
            Some(name) => self.material_idx(name)?,
        };
        let (world_from_object, is_similarity) = self.transform(&file)?;
        if self.instances.len() + named.count > MAX_INSTANCES {
            let message = format!("more than {MAX_INSTANCES} instances");
            return Err(self.source.error_at(&span, "instance", &message));
        }
        // A mesh with parts becomes an instance for each part, with consecutive ids.
        for (idx, mesh) in (named.first..named.first + named.count).enumerate() {
            let id = match file.id {
                Some(id) => id.0 + idx as u32,
                None => 1 + self.instances.len() as u32,
            };
            let default_name = &self.meshes[mesh].name;
            let name = match (&file.name, named.count) {
                (None, _) => default_name.clone(),
                (Some(name), 1) => name.clone(),
                (Some(name), _) => {
                    let part = self.meshes[mesh].source.part.as_deref();
                    format!("{name}/{}", part.unwrap_or_default())
                }
            };
            self.claim_id(id, &name, &span)?;
            self.instances.push(Instance {
                name,
                id,
                mesh,
                world_from_object,
                is_similarity,
                // A rectangle casts only if asked to: it does not occlude what stands on it, and
                // its grid would be nearly empty.
                casts: file.casts.unwrap_or(!named.is_rectangle),
                strength: file.strength.map_or(1.0, |v| v.0 as f32),
                layers: layer_mask(file.layers.as_deref(), 1),
                casts_on: layer_mask(file.casts_on.as_deref(), u32::MAX),
                excludes: file.excludes.iter().map(|id| id.0).collect(),
                material,
            });
        }
        Ok(())
    }

    /// Registers the id of an instance; an error if another one has it.
    fn claim_id(&mut self, id: u32, name: &str, span: &Spanned<()>) -> crate::Result<()> {
        let Some(other) = self.ids.insert(id, name.to_owned()) else {
            return Ok(());
        };
        let message = format!("`{other}` and `{name}` both have {id}");
        Err(self.source.error_at(span, "instance.id", &message))
    }

    fn material_idx(&self, name: &Spanned<String>) -> crate::Result<usize> {
        let found = self
            .materials
            .iter()
            .rposition(|m| m.name == *name.get_ref());
        found.ok_or_else(|| {
            let message = format!("there is no material `{}`", name.get_ref());
            self.source.error_at(name, "instance.material", &message)
        })
    }

    /// Returns the transform, which scales, rotates and then translates, and whether its scale is
    /// uniform up to signs.
    fn transform(&self, file: &InstanceFile) -> crate::Result<(DAffine3, bool)> {
        let scale = match &file.scale {
            None => [1.0; 3],
            Some(scale) => {
                let OneOrThree(axes) = *scale.get_ref();
                let axes = axes.map(|v| v.0);
                if axes.iter().any(|v| v.abs() < f64::from(f32::MIN_POSITIVE)) {
                    let message = "a scale of zero makes the object vanish";
                    return Err(self.source.error_at(scale, "instance.scale", message));
                }
                axes
            }
        };
        let rotation = match &file.rotate {
            None => DQuat::IDENTITY,
            Some(rotate) => {
                let axis = DVec3::from_array(triple(rotate.get_ref().axis)).try_normalize();
                let Some(axis) = axis else {
                    let message = "the axis must not be zero";
                    return Err(self.source.error_at(rotate, "instance.rotate", message));
                };
                DQuat::from_axis_angle(axis, rotate.get_ref().degrees.0.to_radians())
            }
        };
        let translation = DVec3::from_array(file.translate.map_or([0.0; 3], triple));
        let is_similarity = scale.iter().all(|v| v.abs() == scale[0].abs());
        let transform = DAffine3::from_scale_rotation_translation(
            DVec3::from_array(scale),
            rotation,
            translation,
        );
        Ok((transform, is_similarity))
    }

    /// Removes all occluders but the first `limit`.
    fn limit_occluders(&mut self, limit: usize) {
        let mut casters = 0;
        self.instances.retain(|instance| {
            casters += usize::from(instance.casts);
            !instance.casts || casters <= limit
        });
    }

    fn receivers(
        &self,
        list: &Spanned<super::schema::ReceiversFile>,
    ) -> crate::Result<ReceiverList> {
        let mut receivers = receivers::read(self.source, list)?;
        receivers.lift = list.get_ref().lift.map_or(0.0, |v| v.0);
        if let Some(name) = &list.get_ref().object {
            let found = self.instances.iter().find(|i| i.name == *name.get_ref());
            let Some(found) = found else {
                let message = format!("there is no instance `{}`", name.get_ref());
                return Err(self.source.error_at(name, "receivers.object", &message));
            };
            receivers.object = Some(found.id);
        }
        Ok(receivers)
    }

    fn area_light(&self, light: &Spanned<AreaLightFile>) -> crate::Result<AreaLight> {
        let file = light.get_ref();
        let light_result = AreaLight::new(
            triple(file.center),
            triple(file.half_u),
            triple(file.half_v),
            color(file.radiance),
        );
        light_result.map_err(|e| self.source.error_at(light, "area_light", &e.to_string()))
    }
}

impl UpAxis {
    pub(super) fn vector(self) -> DVec3 {
        match self {
            Self::Y => DVec3::Y,
            Self::Z => DVec3::Z,
        }
    }
}

fn truth_options(file: Option<TruthFile>) -> ReferenceOptions {
    let default = ReferenceOptions::recommended();
    let Some(file) = file else { return default };
    ReferenceOptions {
        samples: file.samples.map_or(default.samples, |n| n.0),
        seed: file.seed.map_or(default.seed, |n| n.0.into()),
        max_distance: file.max_distance.map(|d| d.0),
    }
}

/// Returns a mask with a bit for each listed layer.
fn layer_mask(listed: Option<&[Layer]>, default: u32) -> u32 {
    listed.map_or(default, |list| {
        list.iter().fold(0, |mask, layer| mask | 1 << layer.0)
    })
}

fn placement(grid: &GridFile) -> Placement {
    let default = Placement::default();
    Placement {
        resolution: grid
            .resolution
            .map_or(default.resolution, |cells| cells.0.map(|n| n.0)),
        extent: match (grid.half_extents, grid.epsilon) {
            (Some(given), _) => Extent::HalfExtents(given.map(|v| v.f32())),
            (None, Some(epsilon)) => Extent::Epsilon(epsilon.f32()),
            (None, None) => default.extent,
        },
    }
}

fn bake_options(grid: &GridFile) -> Result<BakeOptions, &'static str> {
    let default = BakeOptions::recommended();
    let sampling = match (grid.rays, grid.face_size, grid.seed) {
        (Some(_), Some(_), _) => return Err("`rays` and `face_size` exclude each other"),
        (None, _, Some(_)) => return Err("`seed` needs `rays`"),
        (Some(rays), None, seed) => Sampling::MonteCarlo {
            count: rays.0,
            seed: seed.map_or(0, |n| n.0.into()),
        },
        (None, Some(size), None) => Sampling::CubeFaces { size: size.0 },
        (None, None, None) => default.sampling,
    };
    let offset = grid.sample_offset.map(|v| v.map(|v| v.0 as f32));
    Ok(BakeOptions {
        sampling,
        max_distance: grid.max_distance.map(|d| d.f32()),
        sample_offset: offset.unwrap_or(default.sample_offset),
        interior: grid.interior.map_or(default.interior, Into::into),
        boundary: grid.boundary.map_or(default.boundary, Into::into),
        encoding: grid.encoding.map_or(default.encoding, Into::into),
        format: grid.format.map_or(default.format, Into::into),
    })
}

/// Whether a grid names a file and no option of a bake.
fn is_only_file(grid: &GridFile) -> bool {
    let GridFile {
        file: _,
        resolution,
        epsilon,
        half_extents,
        face_size,
        rays,
        seed,
        max_distance,
        encoding,
        format,
        boundary,
        interior,
        sample_offset,
    } = grid;
    resolution.is_none()
        && epsilon.is_none()
        && half_extents.is_none()
        && face_size.is_none()
        && rays.is_none()
        && seed.is_none()
        && max_distance.is_none()
        && encoding.is_none()
        && format.is_none()
        && boundary.is_none()
        && interior.is_none()
        && sample_offset.is_none()
}

/// Returns a sheet of these half-extents in the xz-plane, facing +y.
fn rectangle([x, z]: [f32; 2]) -> LoadedMesh {
    let positions = vec![[-x, 0.0, -z], [x, 0.0, -z], [x, 0.0, z], [-x, 0.0, z]];
    let part = Part {
        name: "rectangle".into(),
        triangles: 0..2,
    };
    let triangles = vec![[0, 2, 1], [0, 3, 2]];
    let mesh = TriangleMesh::new(positions, triangles, vec![part]);
    loaded_from_memory(mesh.expect("two triangles are a mesh"), "rectangle")
}

/// Returns a generated mesh as if it had been loaded from an OBJ file.
fn loaded_from_memory(mesh: TriangleMesh, name: &str) -> LoadedMesh {
    LoadedMesh {
        blake3: blake3::hash(to_obj(&mesh).as_bytes()).to_hex().to_string(),
        mesh,
        name: format!("{name}.obj"),
    }
}

/// The prefix of file names that lie in the data folder, which the project does not ship.
const DATA_FOLDER_PREFIX: &str = "$AOGRID_SHARED/";

/// Returns the path of a file that a scene names: relative to the scene, or in the data folder.
pub(super) fn resolve(scene: &Path, name: &str) -> PathBuf {
    let Some(inside) = name.strip_prefix(DATA_FOLDER_PREFIX) else {
        return scene.parent().unwrap_or(Path::new("")).join(name);
    };
    let default_folder = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let folder = std::env::var_os("AOGRID_SHARED").map_or_else(default_folder, PathBuf::from);
    folder.join(inside)
}
