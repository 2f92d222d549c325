//! The casting instances and their grids, for all modes that look up grids.

use std::sync::Arc;

use aogrid_grid_format::Grid;
use aogrid_runtime::AogridOccluder;
use aogrid_runtime::shading::{
    AogridLookup, aogrid_is_on_itself, aogrid_lookup, aogrid_lookup_on_itself,
};
use glam::{DAffine3, DMat4, DVec3};

use super::ShadeInput;
use crate::error::{Context, Result, SceneError, ensure};
use crate::{Instance, SceneMesh};

/// The use of a grid's cone in shading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GridShading {
    /// Uses the solid angle alone.
    Occlusion,
    /// Clips the cone by the receiver's tangent plane, and multiplies.
    Cone,
    /// Clips the cone, and merges it with those before it.
    Merge,
    /// Clips the cone, and takes the mean of merging and multiplying it with those before it.
    Mean,
    /// Clips the cone and multiplies, but for receivers on the occluder itself, which have a bake of
    /// their surface.
    Neighbors,
}

/// A casting instance with its grid, ready for look-ups.
pub(super) struct Caster<'a> {
    pub instance: &'a Instance,
    pub grid: Arc<Grid>,
    /// The instance in the form that the runtime's passes read, relative to the target's origin.
    pub posed: aogrid_runtime::Instance,
    /// The occluder in the form that the runtime's CPU twin reads.
    pub occluder: AogridOccluder,
    /// Whether receivers on the occluder itself are left out.
    excludes_itself: bool,
}

impl Caster<'_> {
    /// Whether the instance shades a receiver with this id and these layers.
    pub(super) fn casts_on(&self, id: u32, layers: u32) -> bool {
        let is_left_out = self.excludes_itself && id == self.instance.id;
        !is_left_out && self.instance.casts_on_receiver(id, layers)
    }

    /// Returns the ids of receivers that it does not cast on.
    pub(super) fn excludes(&self) -> Vec<u32> {
        let own = self.excludes_itself.then_some(self.instance.id);
        let others = self.instance.excludes.iter().copied();
        let others = others.filter(|id| Some(*id) != own);
        others.chain(own).collect()
    }

    /// Returns the look-up of the grid by a receiver with this id.
    pub(super) fn lookup(&self, id: u32, position: [f32; 3], normal: [f32; 3]) -> AogridLookup {
        match aogrid_is_on_itself(&self.occluder, id) {
            true => aogrid_lookup_on_itself(&self.occluder, position, normal),
            false => aogrid_lookup(&self.occluder, position),
        }
    }
}

/// Returns the casters of chosen meshes in the scene's order; bakes or reads their grids.
pub(super) fn casters<'a>(
    input: &ShadeInput<'a>,
    shading: GridShading,
    chosen: fn(&SceneMesh) -> bool,
) -> Result<Vec<Caster<'a>>> {
    let scene = input.scene;
    let stage = (input.stages)("grids");
    let mut grids = input.grids.borrow_mut();
    let resolved = grids.resolve_chosen(scene, chosen, &*stage)?;
    drop(grids);
    drop(stage);
    let caster = |instance: &'a Instance| {
        let grid = resolved[instance.mesh]
            .clone()
            .ok_or_else(|| SceneError::new("no grid was made"))?;
        ensure!(
            shading == GridShading::Occlusion || grid.encoding().has_direction(),
            "its grid has no cones: bake it with --encoding cone, or use --mode occlusion"
        );
        let posed = posed(instance, grid.spec().origin(), input.target.origin);
        let grid = match grid.spec().origin() {
            [0.0, 0.0, 0.0] => grid,
            _ => Arc::new(Grid::clone(&grid).at_zero()),
        };
        let occluder = AogridOccluder::new(&grid, &posed)?;
        Ok(Caster {
            instance,
            grid,
            posed,
            occluder,
            excludes_itself: shading == GridShading::Neighbors,
        })
    };
    let named = |instance| caster(instance).with_context(|| describe(input, instance));
    let casting = scene.casters();
    let casting = casting.filter(|instance| chosen(&scene.meshes[instance.mesh]));
    casting.map(named).collect()
}

/// Chooses all meshes.
pub(super) fn any_mesh(_: &SceneMesh) -> bool {
    true
}

/// Returns an instance's scene and name for messages.
pub(super) fn describe(input: &ShadeInput<'_>, instance: &Instance) -> String {
    format!("{}: `{}`", input.scene.path.display(), instance.name)
}

/// Converts an instance to the runtime's type, with its grid at zero and the world relative to `origin`,
/// so that single floats hold what is far away; without the excluded receivers, of which a scene may name
/// more than fit into a uniform.
fn posed(instance: &Instance, grid_origin: [f64; 3], origin: [f64; 3]) -> aogrid_runtime::Instance {
    let world_from_grid =
        instance.world_from_object * DAffine3::from_translation(grid_origin.into());
    let moved = DAffine3::from_translation(-DVec3::from(origin)) * world_from_grid;
    let world_from_object = DMat4::from(moved).as_mat4();
    aogrid_runtime::Instance {
        strength: instance.strength,
        far_field: instance.far_field,
        layers: instance.casts_on,
        object_id: instance.id,
        ..aogrid_runtime::Instance::at(world_from_object.to_cols_array_2d())
    }
}
