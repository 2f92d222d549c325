//! Modes `occlusion` and `cone`: the scene's grids, looked up by the runtime's CPU twin and
//! multiplied (RR-5779, sections 4 and 5.1).

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Context, bail, ensure};
use aogrid_bake_core::Progress;
use aogrid_baker_cpu::truth::Receiver;
use aogrid_grid_format::Encoding;
use aogrid_runtime::shading::{aogrid_cone, aogrid_occlusion, aogrid_occlusion_of_cone};
use aogrid_runtime::{AogridOccluder, LinearTexture};
use glam::DMat4;
use rayon::prelude::*;

use super::{Job, Shaded};
use crate::scene::Instance;

/// What is made of a cone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Model {
    /// Its solid angle alone.
    Occlusion,
    /// It is clipped by the receiver's tangent plane.
    Cone,
}

/// A casting instance, ready to be looked up.
struct Caster<'a> {
    instance: &'a Instance,
    occluder: AogridOccluder,
    texture: &'a LinearTexture,
    encoding: Encoding,
}

/// Receivers between two looks at the stop button.
const CHUNK: usize = 4096;

pub(super) fn shade(job: &Job<'_>, model: Model) -> anyhow::Result<Shaded> {
    let scene = job.scene;
    let bar = job.console.progress("grids");
    let mut grids = job.grids.borrow_mut();
    let grids = grids.resolve(scene, &|progress| bar.observe(progress))?;
    drop(bar);
    let textures = grids
        .iter()
        .map(|g| g.as_deref().map(LinearTexture::of_grid));
    let textures: Vec<_> = textures.collect();
    let caster = |instance| {
        let instance: &Instance = instance;
        let mesh = instance.mesh;
        let (Some(grid), Some(texture)) = (&grids[mesh], &textures[mesh]) else {
            bail!("no grid was made");
        };
        ensure!(
            model == Model::Occlusion || grid.encoding() == Encoding::Cone,
            "its grid has no cones: bake it with --encoding cone, or use --mode occlusion"
        );
        let occluder = AogridOccluder::new(grid.spec(), grid.format(), &as_instance(instance))?;
        Ok(Caster {
            instance,
            occluder,
            texture,
            encoding: grid.encoding(),
        })
    };
    let casters = scene.casters().map(|instance| {
        caster(instance).with_context(|| format!("{}: `{}`", scene.path.display(), instance.name))
    });
    let casters = casters.collect::<anyhow::Result<Vec<_>>>()?;
    let occlusion = occlusions(job, &casters, model)?;
    let only_ambient = scene.area_light.is_none() && scene.environment.is_none();
    let lit = scene.is_lit() && only_ambient;
    let light = lit.then(|| {
        let light = |ao: &f32| scene.ambient.map(|c| c * (1.0 - ao));
        occlusion.iter().map(light).collect()
    });
    Ok(Shaded {
        occlusion,
        occlusion_error: None,
        light,
        light_error: None,
    })
}

/// 1 minus the product of all transmittances, for each receiver.
fn occlusions(job: &Job<'_>, casters: &[Caster<'_>], model: Model) -> anyhow::Result<Vec<f32>> {
    let table = LinearTexture::transmittance_table();
    let target = job.target;
    let layers = layers(job);
    let bar = job.console.progress("look-ups");
    let total = target.receivers.len();
    let done = AtomicUsize::new(0);
    let chunks = target
        .receivers
        .par_chunks(CHUNK)
        .zip(target.ids.par_chunks(CHUNK));
    let shade = |(receivers, ids): (&[Receiver], &[u32])| {
        let done = done.fetch_add(receivers.len(), Ordering::Relaxed) + receivers.len();
        if let ControlFlow::Break(()) = bar.observe(Progress { done, total }) {
            bail!("interrupted");
        }
        let pairs = receivers.iter().zip(ids);
        let one = |(receiver, &id): (&Receiver, &u32)| {
            let casting = casters.iter().filter(|c| c.casts_on(id, layers(id)));
            let product: f32 = casting
                .map(|caster| caster.transmittance(receiver, id, model, &table))
                .product();
            1.0 - product
        };
        Ok(pairs.map(one).collect::<Vec<f32>>())
    };
    let shaded: anyhow::Result<Vec<Vec<f32>>> = chunks.map(shade).collect();
    Ok(shaded?.concat())
}

/// The layers of the instance with an id; all where nothing is known of the receiver.
fn layers<'a>(job: &'a Job<'_>) -> impl Fn(u32) -> u32 + 'a {
    let instances = &job.scene.instances;
    move |id| {
        let instance = instances.iter().find(|instance| instance.id == id);
        instance.map_or(u32::MAX, |instance| instance.layers)
    }
}

impl Caster<'_> {
    fn casts_on(&self, id: u32, layers: u32) -> bool {
        self.instance.casts_on & layers != 0 && !self.instance.excludes.contains(&id)
    }

    fn transmittance(
        &self,
        receiver: &Receiver,
        id: u32,
        model: Model,
        table: &LinearTexture,
    ) -> f32 {
        let p = receiver.position.map(|x| x as f32);
        let n = receiver.normal.map(|x| x as f32);
        let on_itself = id == self.instance.id;
        match (model, self.encoding) {
            (Model::Cone, _) => aogrid_cone(&self.occluder, self.texture, table, p, n),
            (Model::Occlusion, Encoding::Occlusion) => {
                aogrid_occlusion(&self.occluder, self.texture, p, on_itself)
            }
            (Model::Occlusion, Encoding::Cone) => {
                aogrid_occlusion_of_cone(&self.occluder, self.texture, p, on_itself)
            }
        }
    }
}

/// As the runtime has it. Layers and exclusions are looked at here: a scene may exclude more ids
/// than a uniform has room for.
fn as_instance(instance: &Instance) -> aogrid_runtime::Instance {
    let world_from_object = DMat4::from(instance.world_from_object).as_mat4();
    aogrid_runtime::Instance {
        strength: instance.strength,
        object_id: instance.id,
        ..aogrid_runtime::Instance::at(world_from_object.to_cols_array_2d())
    }
}
