//! Conversion of a parsed scene file to a scene.

mod instances;
mod meshes;

use std::collections::HashMap;

use aogrid_runtime::VolumeWeight;
use glam::DVec3;
use toml::Spanned;

use super::camera::Camera;
use super::diagnostics::SceneText;
use super::environment::EnvironmentSource;
use super::schema::{
    AreaLightFile, MaterialFile, SceneFile, ShowFile, TruthFile, UpAxis, VolumesFile, WeightFile,
};
use super::values::{color, triple};
use super::{
    Instance, LoadOptions, Material, ReceiverList, Scene, SceneMesh, VolumeSettings, receivers,
};
use crate::error::SceneError;
use crate::reference::{AreaLight, ReferenceOptions};

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
    warnings: Vec<String>,
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
            warnings: vec![],
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
        let volumes = self.volumes(file.volumes.as_ref())?;
        let picture = file.picture.as_ref();
        let show = picture.and_then(|picture| picture.show);
        let mut scene = Scene {
            path: self.source.path.to_owned(),
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
            volumes,
            exposure: picture
                .and_then(|picture| picture.exposure)
                .map_or(1.0, |v| v.f32()),
            shows_light: false,
            warnings: self.warnings,
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

    fn volumes(&self, file: Option<&Spanned<VolumesFile>>) -> crate::Result<VolumeSettings> {
        let Some(file) = file.map(Spanned::get_ref) else {
            return Ok(VolumeSettings::default());
        };
        let exponent = file.exponent.as_ref().map_or(1.0, |v| v.get_ref().0 as f32);
        let weight = match (file.weight.unwrap_or_default(), &file.exponent) {
            (WeightFile::None, Some(given)) => {
                let message = "weight `none` does not fall off and has no exponent";
                return Err(self.source.error_at(given, "volumes.exponent", message));
            }
            (WeightFile::None, None) => VolumeWeight::None,
            (WeightFile::Linear, _) => VolumeWeight::Linear { exponent },
            (WeightFile::Edges, _) => VolumeWeight::Edges { exponent },
        };
        Ok(VolumeSettings {
            extent: file.extent.map(|v| v.f32()),
            weight,
            two_sided: file.two_sided,
        })
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

/// The standard error that truth has to reach if a scene says nothing.
const TRUTH_ERROR: f64 = 0.002;

fn truth_options(file: Option<TruthFile>) -> ReferenceOptions {
    let default = ReferenceOptions::recommended();
    let Some(file) = file else {
        return ReferenceOptions {
            error: Some(TRUTH_ERROR),
            ..default
        };
    };
    ReferenceOptions {
        samples: file.samples.map_or(default.samples, |n| n.0),
        error: match (file.error, file.samples) {
            (Some(error), _) => Some(error.0),
            // Someone who names a number of rays wants them all.
            (None, Some(_)) => None,
            (None, None) => Some(TRUTH_ERROR),
        },
        seed: file.seed.map_or(default.seed, |n| n.0.into()),
        max_distance: file.max_distance.map(|d| d.0),
    }
}
