//! Mode `volumes+cone`: what deforms occludes by volumes, everything else by its grid's cones.

use super::casters::GridShading;
use super::light::with_light;
use super::{Mode, lookups, raster, volumes};
use crate::SceneMesh;

pub(super) static MODE: Mode = Mode {
    name: "volumes+cone",
    summary: "Volumes for meshes that an animation deforms, cones for all others, multiplied",
    needs_light: false,
    on_cpu: |input| {
        let near = volumes::occlusion(input, deforms)?;
        let far = lookups::occlusion(input, GridShading::Cone, is_rigid)?;
        with_light(input, multiplied(&near, &far))
    },
    on_gpu: Some(|input, gpu| {
        let near = volumes::occlusion_on_gpu(input, gpu, deforms)?;
        let far = raster::occlusion(input, gpu, GridShading::Cone, is_rigid)?;
        with_light(input, multiplied(&near, &far))
    }),
};

/// Whether the mesh is posed otherwise than its grid is baked.
fn deforms(mesh: &SceneMesh) -> bool {
    mesh.bind.is_some()
}

fn is_rigid(mesh: &SceneMesh) -> bool {
    !deforms(mesh)
}

/// Returns AO where two groups of occluders let light through independently.
fn multiplied(a: &[f32], b: &[f32]) -> Vec<f32> {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| 1.0 - (1.0 - a) * (1.0 - b)).collect()
}
