//! The instances of a scene.

use aogrid_bake_core::mesh::Pose;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use toml::Spanned;

use super::{Builder, MAX_INSTANCES};
use crate::schema::{InstanceFile, Layer};
use crate::values::{OneOrThree, triple};
use crate::{Instance, SceneMesh};

impl Builder<'_> {
    pub(super) fn instance(&mut self, file: Spanned<InstanceFile>) -> crate::Result<()> {
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
            let SceneMesh {
                name: default_name,
                pose,
                ..
            } = &self.meshes[mesh];
            let object_from_part = affine(pose);
            let name = match (&file.name, named.count) {
                (None, _) => default_name.clone(),
                (Some(name), 1) => name.clone(),
                (Some(name), _) => {
                    // The mesh of a part is called `mesh/part`.
                    let part = default_name.get(file.mesh.get_ref().len()..);
                    format!("{name}{}", part.unwrap_or_default())
                }
            };
            self.claim_id(id, &name, &span)?;
            self.instances.push(Instance {
                name,
                id,
                mesh,
                world_from_object: world_from_object * object_from_part,
                is_similarity,
                // A rectangle casts only if asked to: it does not occlude what stands on it, and
                // its grid would be nearly empty.
                casts: file.casts.unwrap_or(!named.is_rectangle),
                strength: file.strength.map_or(1.0, |v| v.0 as f32),
                far_field: file.far_field.map(|v| v.0 as f32),
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

    pub(super) fn material_idx(&self, name: &Spanned<String>) -> crate::Result<usize> {
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
}

fn affine(pose: &Pose) -> DAffine3 {
    DAffine3 {
        matrix3: DMat3::from_cols_array_2d(&pose.linear),
        translation: DVec3::from_array(pose.translation),
    }
}

/// Returns a mask with a bit for each listed layer.
fn layer_mask(listed: Option<&[Layer]>, default: u32) -> u32 {
    listed.map_or(default, |list| {
        list.iter().fold(0, |mask, layer| mask | 1 << layer.0)
    })
}
