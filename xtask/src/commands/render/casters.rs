//! What the modes that look grids up have in common: the casting instances and their grids.

use std::sync::Arc;

use anyhow::{Context, ensure};
use aogrid_grid_format::{Encoding, Grid};
use aogrid_runtime::AogridOccluder;
use glam::DMat4;

use super::environment::Surroundings;
use super::{Job, Shaded};
use crate::scene::Instance;

/// What is made of a cone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Model {
    /// Its solid angle alone.
    Occlusion,
    /// It is clipped by the receiver's tangent plane.
    Cone,
    /// It is clipped, and united with those before it.
    Merge,
}

/// A casting instance, ready to be looked up.
pub(super) struct Caster<'a> {
    pub instance: &'a Instance,
    pub grid: Arc<Grid>,
    /// As the CPU reads it.
    pub occluder: AogridOccluder,
}

impl Caster<'_> {
    /// Whether it shades a receiver with this id and these layers.
    pub(super) fn casts_on(&self, id: u32, layers: u32) -> bool {
        self.instance.casts_on & layers != 0 && !self.instance.excludes.contains(&id)
    }
}

/// All casters, in the scene's order; bakes their grids.
pub(super) fn casters<'a>(job: &Job<'a>, model: Model) -> anyhow::Result<Vec<Caster<'a>>> {
    let scene = job.scene;
    let bar = job.console.progress("grids");
    let mut grids = job.grids.borrow_mut();
    let resolved = grids.resolve(scene, &|progress| bar.observe(progress))?;
    drop(bar);
    for warning in grids.take_warnings() {
        job.console
            .warning(&format!("{}: {warning}", scene.path.display()));
    }
    let caster = |instance: &'a Instance| {
        let grid = resolved[instance.mesh]
            .clone()
            .context("no grid was made")?;
        ensure!(
            model == Model::Occlusion || grid.encoding() == Encoding::Cone,
            "its grid has no cones: bake it with --encoding cone, or use --mode occlusion"
        );
        let occluder = AogridOccluder::new(grid.spec(), grid.format(), &as_instance(instance))?;
        Ok(Caster {
            instance,
            grid,
            occluder,
        })
    };
    let named = |instance| caster(instance).with_context(|| place(job, instance));
    scene.casters().map(named).collect()
}

/// Where an instance is, in words.
pub(super) fn place(job: &Job<'_>, instance: &Instance) -> String {
    format!("{}: `{}`", job.scene.path.display(), instance.name)
}

/// The layers of the instance with an id; all where nothing is known of the receiver.
pub(super) fn layers<'a>(job: &Job<'a>) -> impl Fn(u32) -> u32 + use<'a> {
    let instances = &job.scene.instances;
    move |id| {
        let instance = instances.iter().find(|instance| instance.id == id);
        instance.map_or(u32::MAX, |instance| instance.layers)
    }
}

/// As the runtime has it, but for the receivers that it leaves out: a scene may name more of them
/// than a uniform has room for.
pub(super) fn as_instance(instance: &Instance) -> aogrid_runtime::Instance {
    let world_from_object = DMat4::from(instance.world_from_object).as_mat4();
    aogrid_runtime::Instance {
        strength: instance.strength,
        layers: instance.casts_on,
        object_id: instance.id,
        ..aogrid_runtime::Instance::at(world_from_object.to_cols_array_2d())
    }
}

/// A mode's result from its AO alone: in a scene without an area light, which has shadows of its
/// own, the light is all that there would be without occluders, times 1 − AO.
pub(super) fn shaded(job: &Job<'_>, occlusion: Vec<f32>) -> anyhow::Result<Shaded> {
    let scene = job.scene;
    let light = match scene.is_lit() && scene.area_light.is_none() {
        true => {
            let open = Surroundings::new(job)?.open();
            let pairs = open.iter().zip(&occlusion);
            Some(pairs.map(|(c, ao)| c.map(|v| v * (1.0 - ao))).collect())
        }
        false => None,
    };
    Ok(Shaded {
        occlusion,
        occlusion_error: None,
        light,
        light_error: None,
    })
}
