//! The casting instances and their grids, for all modes that look up grids.

use std::sync::Arc;

use anyhow::{Context, ensure};
use aogrid_grid_format::Grid;
use aogrid_runtime::AogridOccluder;
use glam::DMat4;

use super::Job;
use aogrid_scene::Instance;

/// The use of a grid's cone in shading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GridShading {
    /// Uses the solid angle alone.
    Occlusion,
    /// Clips the cone by the receiver's tangent plane, and multiplies.
    Cone,
    /// Clips the cone, and merges it with those before it.
    Merge,
}

/// A casting instance with its grid, ready for look-ups.
pub(super) struct Caster<'a> {
    pub instance: &'a Instance,
    pub grid: Arc<Grid>,
    /// The occluder in the form that the runtime's CPU twin reads.
    pub occluder: AogridOccluder,
}

impl Caster<'_> {
    /// Whether the instance shades a receiver with this id and these layers.
    pub(super) fn casts_on(&self, id: u32, layers: u32) -> bool {
        self.instance.casts_on & layers != 0 && !self.instance.excludes.contains(&id)
    }
}

/// Returns all casters in the scene's order; bakes or reads their grids.
pub(super) fn casters<'a>(job: &Job<'a>, shading: GridShading) -> anyhow::Result<Vec<Caster<'a>>> {
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
            shading == GridShading::Occlusion || grid.encoding().has_direction(),
            "its grid has no cones: bake it with --encoding cone, or use --mode occlusion"
        );
        let occluder = AogridOccluder::new(
            grid.spec(),
            grid.encoding(),
            grid.format(),
            &runtime_instance(instance),
        )?;
        Ok(Caster {
            instance,
            grid,
            occluder,
        })
    };
    let named = |instance| caster(instance).with_context(|| describe(job, instance));
    scene.casters().map(named).collect()
}

/// Returns an instance's scene and name for messages.
pub(super) fn describe(job: &Job<'_>, instance: &Instance) -> String {
    format!("{}: `{}`", job.scene.path.display(), instance.name)
}

/// Converts an instance to the runtime's type, without the excluded receivers, of which a scene may
/// name more than fit into a uniform.
pub(super) fn runtime_instance(instance: &Instance) -> aogrid_runtime::Instance {
    let world_from_object = DMat4::from(instance.world_from_object).as_mat4();
    aogrid_runtime::Instance {
        strength: instance.strength,
        layers: instance.casts_on,
        object_id: instance.id,
        ..aogrid_runtime::Instance::at(world_from_object.to_cols_array_2d())
    }
}
