//! Look-ups of the scene's grids on the CPU by the runtime's CPU twin, multiplied or merged (RR-5779, sections 4, 5.1 and 5.2.2).

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use aogrid_bake_core::Progress;
use aogrid_runtime::CpuTexture;
use aogrid_runtime::shading::{
    aogrid_cone_at, aogrid_cone_with_axis_at, aogrid_mean, aogrid_merge, aogrid_occlusion,
    aogrid_occlusion_of_cone,
};
use rayon::prelude::*;

use super::casters::{Caster, GridShading, any_mesh, casters};
use super::light::with_light;
use super::{ShadeInput, Shaded};
use crate::SceneMesh;
use crate::error::{Result, bail};
use crate::reference::Receiver;

/// Number of receivers between two checks for an interrupt.
const CHUNK: usize = 4096;

/// A caster and its grid's texture.
struct Textured<'a> {
    caster: &'a Caster<'a>,
    texture: Arc<CpuTexture>,
}

/// The tables for clipping and merging cones.
struct Tables {
    transmittance: CpuTexture,
    clip: CpuTexture,
    overlaps: CpuTexture,
}

pub(super) fn shade(input: &ShadeInput<'_>, shading: GridShading) -> Result<Shaded> {
    with_light(input, occlusion(input, shading, any_mesh)?)
}

/// Returns the AO of the casters of chosen meshes for each receiver.
pub(super) fn occlusion(
    input: &ShadeInput<'_>,
    shading: GridShading,
    chosen: fn(&SceneMesh) -> bool,
) -> Result<Vec<f32>> {
    let casters = casters(input, shading, chosen)?;
    let mut textures = HashMap::new();
    let textured = casters.iter().map(|caster| Textured {
        caster,
        texture: textures
            .entry(Arc::as_ptr(&caster.grid))
            .or_insert_with(|| Arc::new(CpuTexture::of_grid(&caster.grid)))
            .clone(),
    });
    let casters: Vec<_> = textured.collect();
    occlusions(input, &casters, shading)
}

/// Returns the AO of all casters for each receiver.
fn occlusions(
    input: &ShadeInput<'_>,
    casters: &[Textured<'_>],
    shading: GridShading,
) -> Result<Vec<f32>> {
    let tables = Tables {
        transmittance: CpuTexture::transmittance_table(),
        clip: CpuTexture::clip_table(),
        overlaps: CpuTexture::intersection_table(),
    };
    let (target, instances) = (input.target, &input.instances);
    let stage = (input.stages)("look-ups");
    let total = target.receivers.len();
    let done = AtomicUsize::new(0);
    let chunks = target
        .receivers
        .par_chunks(CHUNK)
        .zip(target.ids.par_chunks(CHUNK));
    let shade = |(receivers, ids): (&[Receiver], &[u32])| {
        let done = done.fetch_add(receivers.len(), Ordering::Relaxed) + receivers.len();
        if let ControlFlow::Break(()) = stage(Progress { done, total }) {
            bail!("interrupted");
        }
        let pairs = receivers.iter().zip(ids);
        let shade_one = |(receiver, &id): (&Receiver, &u32)| {
            let layers = instances.layers(id);
            let seen = target.singles(receiver);
            let casting = casters.iter().filter(|c| c.caster.casts_on(id, layers));
            if matches!(shading, GridShading::Merge | GridShading::Mean) {
                let unoccluded = [0.0, 0.0, 0.0, 1.0];
                let [.., t] = casting.fold(unoccluded, |before, caster| {
                    let one = caster.contribution(seen, id, &tables);
                    match (one, shading) {
                        (None, _) => before,
                        (Some(one), GridShading::Mean) => {
                            aogrid_mean(before, one, &tables.overlaps)
                        }
                        (Some(one), _) => aogrid_merge(before, one, &tables.overlaps),
                    }
                });
                return 1.0 - t;
            }
            let product: f32 = casting
                .map(|caster| caster.transmittance(seen, id, shading, &tables))
                .product();
            1.0 - product
        };
        Ok(pairs.map(shade_one).collect::<Vec<f32>>())
    };
    let shaded: Result<Vec<Vec<f32>>> = chunks.map(shade).collect();
    Ok(shaded?.concat())
}

impl Textured<'_> {
    /// Returns what this caster adds to the accumulated occlusion; none beyond its reach.
    fn contribution(&self, [p, n]: [[f32; 3]; 2], id: u32, tables: &Tables) -> Option<[f32; 4]> {
        let (occluder, clip) = (&self.caster.occluder, &tables.clip);
        let lookup = self.caster.lookup(id, p, n);
        let at = || aogrid_cone_with_axis_at(occluder, &self.texture, clip, lookup, n);
        lookup.is_reached.then(at)
    }

    /// Returns the share of light that this caster leaves to a receiver.
    fn transmittance(
        &self,
        [p, n]: [[f32; 3]; 2],
        id: u32,
        shading: GridShading,
        tables: &Tables,
    ) -> f32 {
        let on_itself = id == self.caster.instance.id;
        let Caster { occluder, grid, .. } = self.caster;
        match (shading, grid.encoding().has_direction()) {
            (
                GridShading::Cone | GridShading::Merge | GridShading::Mean | GridShading::Neighbors,
                _,
            ) => {
                let lookup = self.caster.lookup(id, p, n);
                let table = &tables.transmittance;
                match lookup.is_reached {
                    true => aogrid_cone_at(occluder, &self.texture, table, lookup, n),
                    false => 1.0,
                }
            }
            (GridShading::Occlusion, false) => {
                aogrid_occlusion(occluder, &self.texture, p, on_itself)
            }
            (GridShading::Occlusion, true) => {
                aogrid_occlusion_of_cone(occluder, &self.texture, p, on_itself)
            }
        }
    }
}
