//! Mode `truth`: path-traced reference with rays through all occluders.

use aogrid_baker_cpu::RayScene;

use super::{Mode, ShadeInput, Shaded, glossy};
use crate::error::{Context, Result};
use crate::reference::{self, Lighting, ShadingEstimate};

pub(super) static MODE: Mode = Mode {
    name: "truth",
    summary: "Ray tracing of the whole scene",
    needs_light: false,
    on_cpu: shade,
    on_gpu: None,
};

fn shade(input: &ShadeInput<'_>) -> Result<Shaded> {
    let scene = input.scene;
    let lighting = Lighting {
        ambient: scene.ambient,
        environment: input.environment,
        area_light: scene.area_light,
    };
    let casters = scene.flattened(|instance| instance.casts)?;
    let occluder = casters.as_ref().map(RayScene::new);
    let stage = (input.stages)("truth");
    let mut shades = reference::shade(
        occluder.as_ref(),
        &input.target.receivers,
        &lighting,
        &scene.truth,
        &*stage,
    )
    .with_context(|| scene.path.display().to_string())?;
    drop(stage);
    // Glossy receivers reflect a lobe instead of the hemisphere; AO stays as it is.
    if scene.is_lit() {
        let (indices, lobes): (Vec<_>, Vec<_>) = glossy::lobes(input)?.into_iter().unzip();
        let stage = (input.stages)("truth, glossy");
        let reflected =
            reference::reflect(occluder.as_ref(), &lobes, &lighting, &scene.truth, &*stage)
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
