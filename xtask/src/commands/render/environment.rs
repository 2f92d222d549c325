//! Modes `environment` and `environment-merge` on the CPU: light from all around, less what the
//! grids' cones hide of it, multiplied or united, by the runtime's twin (RR-5779, 5.2 and 5.3).

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Context, bail, ensure};
use aogrid_bake_core::Progress;
use aogrid_baker_cpu::truth::Receiver;
use aogrid_runtime::environment::{aogrid_glossy, aogrid_lambertian};
use aogrid_runtime::shading::{
    aogrid_cone_with_axis_at, aogrid_grid_position, aogrid_is_inside, aogrid_merge, aogrid_multiply,
};
use aogrid_runtime::{AogridEnvironment, EnvironmentMap, LinearTexture};
use rayon::prelude::*;

use super::casters::{Caster, Model, casters, layers};
use super::{Job, Shaded, glossy};

/// Receivers between two looks at the stop button.
const CHUNK: usize = 4096;

/// Nothing hidden.
const OPEN: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// What lights a scene from all around, and how its receivers reflect it.
pub(super) struct Surroundings<'a> {
    receivers: &'a [Receiver],
    /// Its radiance, ambient light included.
    pub map: EnvironmentMap,
    /// How the scene stands in it.
    pub place: AogridEnvironment,
    /// Of each receiver, if it is glossy: the mirrored direction and the fraction of its lobe.
    lobes: Vec<Option<([f32; 3], f32)>>,
}

impl<'a> Surroundings<'a> {
    /// The environment, if there is one, and ambient light.
    pub(super) fn new(job: &Job<'a>) -> anyhow::Result<Self> {
        let ambient = job.scene.ambient;
        let (map, rows) = match &job.environment {
            None => (EnvironmentMap::new([1, 1], &[ambient]), IDENTITY),
            Some(environment) => {
                let texels = environment.texels().iter();
                let all = texels.map(|t| std::array::from_fn(|c| t[c] + ambient[c]));
                let map = EnvironmentMap::new(environment.size(), &all.collect::<Vec<_>>());
                (map, environment.map_from_world())
            }
        };
        let mut lobes = vec![None; job.target.receivers.len()];
        for (idx, lobe) in glossy::lobes(job)? {
            let fraction = 0.5 * (1.0 - lobe.half_angle.cos());
            lobes[idx] = Some((lobe.axis.map(|x| x as f32), fraction as f32));
        }
        Ok(Self {
            receivers: &job.target.receivers,
            map: map.with_context(|| format!("{}: environment", job.scene.path.display()))?,
            place: AogridEnvironment::from_rotation(rows.map(|row| row.map(|x| x as f32))),
            lobes,
        })
    }

    /// What each receiver would reflect if it were white and nothing hidden.
    pub(super) fn open(&self) -> Vec<[f32; 3]> {
        let all = 0..self.lobes.len();
        all.into_par_iter()
            .map(|idx| self.light(idx, OPEN))
            .collect()
    }

    /// What receiver `idx` reflects if it is white, and so much is hidden from it.
    fn light(&self, idx: usize, hidden: [f32; 4]) -> [f32; 3] {
        let n = self.receivers[idx].normal.map(|x| x as f32);
        match self.lobes[idx] {
            None => aogrid_lambertian(&self.place, &self.map, hidden, n),
            Some((mirrored, fraction)) => {
                aogrid_glossy(&self.place, &self.map, hidden, n, mirrored, fraction)
            }
        }
    }
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

pub(super) fn shade(job: &Job<'_>, model: Model) -> anyhow::Result<Shaded> {
    check(job)?;
    let surroundings = Surroundings::new(job)?;
    let casters = casters(job, model)?;
    let hidden = hidden(job, &casters, model)?;
    let pairs = hidden.par_iter().enumerate();
    let light = pairs.map(|(idx, &hidden)| surroundings.light(idx, hidden));
    Ok(Shaded {
        occlusion: hidden.iter().map(|[.., t]| 1.0 - t).collect(),
        occlusion_error: None,
        light: Some(light.collect()),
        light_error: None,
    })
}

/// Refuses a scene whose light is not all from around.
pub(super) fn check(job: &Job<'_>) -> anyhow::Result<()> {
    let (scene, shown) = (job.scene, job.scene.path.display());
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

/// What the casters add up to at each receiver: the sum of all (AO/2) d′, and what is left, 1 − AO.
fn hidden(job: &Job<'_>, casters: &[Caster<'_>], model: Model) -> anyhow::Result<Vec<[f32; 4]>> {
    let clip = LinearTexture::clip_table();
    let overlaps = LinearTexture::intersection_table();
    let mut textures = HashMap::new();
    for Caster { grid, .. } in casters {
        let texture = || LinearTexture::of_grid(grid);
        textures.entry(Arc::as_ptr(grid)).or_insert_with(texture);
    }
    let textures: Vec<_> = casters
        .iter()
        .map(|c| &textures[&Arc::as_ptr(&c.grid)])
        .collect();
    let layers = layers(job);
    let target = job.target;
    let one = |idx: usize| {
        let (receiver, id) = (&target.receivers[idx], target.ids[idx]);
        let [p, n] = [receiver.position, receiver.normal].map(|v| v.map(|x| x as f32));
        let mut hidden = OPEN;
        for (caster, texture) in casters.iter().zip(&textures) {
            let p_grid = aogrid_grid_position(&caster.occluder, p);
            if caster.casts_on(id, layers(id)) && aogrid_is_inside(p_grid) {
                let one = aogrid_cone_with_axis_at(&caster.occluder, texture, &clip, p_grid, n);
                hidden = match model {
                    Model::Merge => aogrid_merge(hidden, one, &overlaps),
                    Model::Occlusion | Model::Cone => aogrid_multiply(hidden, one),
                };
            }
        }
        hidden
    };
    let bar = job.console.progress("look-ups");
    let total = target.receivers.len();
    let done = AtomicUsize::new(0);
    let places: Vec<_> = (0..total).collect();
    let chunk = |places: &[usize]| {
        let done = done.fetch_add(places.len(), Ordering::Relaxed) + places.len();
        match bar.observe(Progress { done, total }) {
            ControlFlow::Break(()) => bail!("interrupted"),
            ControlFlow::Continue(()) => Ok(places.iter().map(|&idx| one(idx)).collect()),
        }
    };
    let chunks: anyhow::Result<Vec<Vec<_>>> = places.par_chunks(CHUNK).map(chunk).collect();
    Ok(chunks?.concat())
}
