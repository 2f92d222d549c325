//! Mode `truth`: path-traced reference with rays through all occluders.

use anyhow::Context;
use aogrid_baker_cpu::RayScene;
use aogrid_scene::reference::{self, Lighting, ShadingEstimate};

use super::{Job, Shaded, glossy};

pub(super) fn shade(job: &Job<'_>) -> anyhow::Result<Shaded> {
    let scene = job.scene;
    let lighting = Lighting {
        ambient: scene.ambient,
        environment: job.environment.as_ref(),
        area_light: scene.area_light,
    };
    let casters = scene.flattened(|instance| instance.casts)?;
    let occluder = casters.as_ref().map(RayScene::new);
    let bar = job.console.progress("truth");
    let shades = reference::shade(
        occluder.as_ref(),
        &job.target.receivers,
        &lighting,
        &scene.truth,
        &|progress| bar.observe(progress),
    )
    .with_context(|| scene.path.display().to_string())?;
    let mut shades = shades;
    // Glossy receivers reflect a lobe instead of the hemisphere; AO stays as it is.
    if scene.is_lit() {
        let (indices, lobes): (Vec<_>, Vec<_>) = glossy::lobes(job)?.into_iter().unzip();
        let bar = job.console.progress("truth, glossy");
        let reflected = reference::reflect(
            occluder.as_ref(),
            &lobes,
            &lighting,
            &scene.truth,
            &|progress| bar.observe(progress),
        )
        .with_context(|| scene.path.display().to_string())?;
        for (idx, glossy) in indices.into_iter().zip(reflected) {
            shades[idx].light = glossy.light;
        }
    }
    let lit = |value: fn(&ShadingEstimate) -> [f32; 3]| {
        scene.is_lit().then(|| shades.iter().map(value).collect())
    };
    Ok(Shaded {
        occlusion: shades.iter().map(|s| s.occlusion.mean).collect(),
        occlusion_error: Some(shades.iter().map(|s| s.occlusion.standard_error).collect()),
        light: lit(|s| s.light.map(|c| c.mean)),
        light_error: lit(|s| s.light.map(|c| c.standard_error)),
    })
}
