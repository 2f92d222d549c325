//! Light on the CPU: light from the environment less what the
//! grids' cones occlude, multiplied or merged, by the runtime's CPU twin (RR-5779, 5.2 and 5.3).

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use aogrid_bake_core::Progress;
use aogrid_runtime::environment::{aogrid_glossy, aogrid_lambertian};
use aogrid_runtime::shading::{
    aogrid_cone_with_axis_at, aogrid_mean, aogrid_merge, aogrid_multiply,
};
use aogrid_runtime::surface::aogrid_surface_light;
use aogrid_runtime::{AogridEnvironment, CpuTexture, EnvironmentMap};
use rayon::prelude::*;

use super::casters::{Caster, GridShading, any_mesh, casters};
use super::own_surface::{OwnSurface, own_surfaces};
use super::{ShadeInput, Shaded, glossy};
use crate::error::{Context, Result, bail, ensure};
use crate::reference::Receiver;

/// Number of receivers between two checks for an interrupt.
const CHUNK: usize = 4096;

/// Accumulated occlusion of a receiver that sees no occluder.
const UNOCCLUDED: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// The light from a scene's environment, and its receivers' reflection.
pub(super) struct EnvironmentLight<'a> {
    receivers: &'a [Receiver],
    /// Radiance of the environment plus ambient light.
    pub map: EnvironmentMap,
    /// Orientation of the map relative to the scene.
    pub environment: AogridEnvironment,
    /// Mirrored direction and lobe fraction of each receiver; `None` if it is diffuse.
    lobes: Vec<Option<([f32; 3], f32)>>,
}

impl<'a> EnvironmentLight<'a> {
    /// Prepares the environment, if there is one, plus ambient light.
    pub(super) fn new(input: &ShadeInput<'a>) -> Result<Self> {
        let ambient = input.scene.ambient;
        let (map, rows) = match input.environment {
            None => (EnvironmentMap::new([1, 1], &[ambient]), IDENTITY),
            Some(environment) => {
                let texels = environment.texels().iter();
                let all = texels.map(|t| std::array::from_fn(|c| t[c] + ambient[c]));
                let map = EnvironmentMap::new(environment.size(), &all.collect::<Vec<_>>());
                (map, environment.map_from_world())
            }
        };
        let mut lobes = vec![None; input.target.receivers.len()];
        for (idx, lobe) in glossy::lobes(input)? {
            let fraction = 0.5 * (1.0 - lobe.half_angle.cos());
            lobes[idx] = Some((lobe.axis.map(|x| x as f32), fraction as f32));
        }
        Ok(Self {
            receivers: &input.target.receivers,
            map: map.with_context(|| format!("{}: environment", input.scene.path.display()))?,
            environment: AogridEnvironment::from_rotation(rows.map(|row| row.map(|x| x as f32))),
            lobes,
        })
    }

    /// Returns the radiance that each receiver would reflect if it were white and unoccluded.
    pub(super) fn unoccluded(&self) -> Vec<[f32; 3]> {
        let all = 0..self.lobes.len();
        all.into_par_iter()
            .map(|idx| self.light(idx, UNOCCLUDED))
            .collect()
    }

    /// Returns the radiance that receiver `idx` reflects if it is white, given its accumulated
    /// occlusion.
    fn light(&self, idx: usize, occlusion: [f32; 4]) -> [f32; 3] {
        let n = self.receivers[idx].normal.map(|x| x as f32);
        match self.lobes[idx] {
            None => aogrid_lambertian(&self.environment, &self.map, occlusion, n),
            Some((mirrored, fraction)) => aogrid_glossy(
                &self.environment,
                &self.map,
                occlusion,
                n,
                mirrored,
                fraction,
            ),
        }
    }

    /// Returns the radiance that receiver `idx` reflects if it is white, given the accumulated occlusion
    /// of its neighbors and its own surface's bake. Of a lobe the bake knows no direction.
    fn light_on(&self, idx: usize, neighbors: [f32; 4], own: &OwnSurface) -> [f32; 3] {
        if self.lobes[idx].is_some() {
            return self.light(idx, neighbors).map(|c| own.accessibility * c);
        }
        aogrid_surface_light(
            &self.environment,
            &self.map,
            neighbors,
            self.receivers[idx].normal.map(|x| x as f32),
            own.accessibility,
            &own.cone(),
        )
    }
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

pub(super) fn shade(input: &ShadeInput<'_>, shading: GridShading) -> Result<Shaded> {
    check(input)?;
    let environment_light = EnvironmentLight::new(input)?;
    let casters = casters(input, shading, any_mesh)?;
    let occlusion = occlusion(input, &casters, shading)?;
    let own = match shading {
        GridShading::Neighbors => Some(own_surfaces(input)?),
        _ => None,
    };
    let own = own.as_deref();
    let pairs = occlusion.par_iter().enumerate();
    let light = pairs.map(|(idx, &occlusion)| match own {
        Some(own) => environment_light.light_on(idx, occlusion, &own[idx]),
        None => environment_light.light(idx, occlusion),
    });
    let accessibility = |idx: usize| own.map_or(1.0, |own| own[idx].accessibility);
    let pairs = occlusion.iter().enumerate();
    Ok(Shaded {
        occlusion: pairs
            .map(|(idx, [.., t])| 1.0 - accessibility(idx) * t)
            .collect(),
        occlusion_error: None,
        light: Some(light.collect()),
        light_error: None,
    })
}

/// Checks that the scene is lit by an environment or ambient light, and by nothing else.
pub(super) fn check(input: &ShadeInput<'_>) -> Result<()> {
    let (scene, shown) = (input.scene, input.scene.path.display());
    ensure!(
        scene.environment.is_some() || scene.ambient != [0.0; 3],
        "{shown}: this mode needs light from all around: add [environment] or `ambient`"
    );
    ensure!(
        scene.area_light.is_none(),
        "{shown}: this mode has no shadows of an [area_light]: leave that out"
    );
    Ok(())
}

/// Accumulates the casters at each receiver: the sum of all (AO/2) d′, and the transmittance
/// 1 − AO.
fn occlusion(
    input: &ShadeInput<'_>,
    casters: &[Caster<'_>],
    shading: GridShading,
) -> Result<Vec<[f32; 4]>> {
    let clip = CpuTexture::clip_table();
    let overlaps = CpuTexture::intersection_table();
    // Instances that share a grid share its texture.
    let mut textures = HashMap::new();
    for Caster { grid, .. } in casters {
        let texture = || CpuTexture::of_grid(grid);
        textures.entry(Arc::as_ptr(grid)).or_insert_with(texture);
    }
    let textures: Vec<_> = casters
        .iter()
        .map(|c| &textures[&Arc::as_ptr(&c.grid)])
        .collect();
    let (target, instances) = (input.target, &input.instances);
    let accumulate = |idx: usize| {
        let (receiver, id) = (&target.receivers[idx], target.ids[idx]);
        let [p, n] = [receiver.position, receiver.normal].map(|v| v.map(|x| x as f32));
        let layers = instances.layers(id);
        let mut occlusion = UNOCCLUDED;
        for (caster, texture) in casters.iter().zip(&textures) {
            let lookup = caster.lookup(id, p, n);
            if caster.casts_on(id, layers) && lookup.is_reached {
                let cone = aogrid_cone_with_axis_at(&caster.occluder, texture, &clip, lookup, n);
                occlusion = match shading {
                    GridShading::Merge => aogrid_merge(occlusion, cone, &overlaps),
                    GridShading::Mean => aogrid_mean(occlusion, cone, &overlaps),
                    GridShading::Occlusion | GridShading::Cone | GridShading::Neighbors => {
                        aogrid_multiply(occlusion, cone)
                    }
                };
            }
        }
        occlusion
    };
    let stage = (input.stages)("look-ups");
    let total = target.receivers.len();
    let done = AtomicUsize::new(0);
    let indices: Vec<_> = (0..total).collect();
    let chunk = |indices: &[usize]| {
        let done = done.fetch_add(indices.len(), Ordering::Relaxed) + indices.len();
        match stage(Progress { done, total }) {
            ControlFlow::Break(()) => bail!("interrupted"),
            ControlFlow::Continue(()) => Ok(indices.iter().map(|&idx| accumulate(idx)).collect()),
        }
    };
    let chunks: Result<Vec<Vec<_>>> = indices.par_chunks(CHUNK).map(chunk).collect();
    Ok(chunks?.concat())
}

/// Returns a mode's result from its AO alone: the light is that of the scene without occluders
/// times 1 − AO. A scene with an area light, which casts shadows of its own, gets no light.
pub(super) fn with_light(input: &ShadeInput<'_>, occlusion: Vec<f32>) -> Result<Shaded> {
    let scene = input.scene;
    let light = match scene.is_lit() && scene.area_light.is_none() {
        true => {
            let unoccluded = EnvironmentLight::new(input)?.unoccluded();
            let pairs = unoccluded.iter().zip(&occlusion);
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
