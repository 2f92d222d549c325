//! Environment light in scenes through their grids, against ray tracing, and the part of the error
//! that is AO's own.

use std::path::Path;

use aogrid_bake_core::{BakeOptions, Extent, Placement, Preset, UNOBSERVED};
use aogrid_baker_cpu::RayScene;
use aogrid_grid_format::{BoundaryMode, TexelFormat};
use aogrid_runtime::shading::*;
use aogrid_runtime::{AogridOccluder, Combine, CpuTexture, Instance};
use aogrid_scene::reference::{self, Lighting, Receiver, ReferenceOptions};
use aogrid_scene::{GBuffer, GridSource, Grids, LoadOptions, Scene};
use glam::DMat4;

use crate::environment_light::{Errors, OccludedReceivers, diffuse, lights, options, report};

/// The settings to bake a scene's grids with, and to combine them.
struct Settings {
    name: &'static str,
    preset: Preset,
    /// Changes the preset's placement and options.
    change: fn(&mut Placement, &mut BakeOptions),
    combine: Combine,
}

/// The papers' settings without a fade, the same with fine and wide grids, and the default's.
const SETTINGS: [Settings; 3] = [
    Settings {
        name: "8 bits, 32³",
        preset: Preset::Paper,
        change: |_, options| options.boundary = BoundaryMode::None,
        combine: Combine::Multiply,
    },
    Settings {
        name: FINE,
        preset: Preset::Paper,
        change: |placement, options| {
            placement.resolution = [64; 3];
            placement.extent = Extent::Epsilon(0.02);
            options.boundary = BoundaryMode::None;
            options.format = TexelFormat::F32;
        },
        combine: Combine::Merge,
    },
    Settings {
        name: "default",
        preset: Preset::Default,
        change: |_, _| {},
        combine: Combine::Mean,
    },
];

/// The name of the settings with fine and wide grids.
const FINE: &str = "floats, 64³";

/// Samples per receiver of the reference light, whose variance is subtracted.
const SAMPLES: u32 = 256;

/// Samples per receiver of the reference AO, which replaces the grids': a few thousandths of noise.
const OCCLUSION_SAMPLES: u32 = 1024;

/// Returns the receivers that a scene's camera sees, occluded by its grids.
fn receivers_with_grids(name: &str, settings: &Settings) -> OccludedReceivers {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../scenes")
        .join(name);
    let mut scene = aogrid_scene::load(&path, LoadOptions::default()).unwrap();
    scene.camera.as_mut().unwrap().resolution = [40, 30];
    for mesh in &mut scene.meshes {
        let (mut placement, mut options) = (settings.preset.placement(), settings.preset.options());
        (settings.change)(&mut placement, &mut options);
        mesh.grid = GridSource::Bake(placement, options);
    }
    let gbuffer = GBuffer::trace(&scene, UNOBSERVED).unwrap();
    let (pixels, receivers): (Vec<_>, Vec<_>) = gbuffer.receivers().into_iter().unzip();
    let ids: Vec<u32> = pixels.into_iter().map(|pixel| gbuffer.ids[pixel]).collect();
    OccludedReceivers {
        combined: combined_occlusion(&scene, (&receivers, &ids), settings.combine),
        receivers,
        occluder: RayScene::new(&scene.flattened(|i| i.casts).unwrap().unwrap()),
    }
}

fn combined_occlusion(
    scene: &Scene,
    (receivers, ids): (&[Receiver], &[u32]),
    combine: Combine,
) -> Vec<[f32; 4]> {
    let grids = Grids::new().resolve(scene, UNOBSERVED).unwrap();
    let clip = CpuTexture::clip_table();
    let overlaps = CpuTexture::intersection_table();
    let mut combined = vec![[0.0, 0.0, 0.0, 1.0]; receivers.len()];
    for instance in scene.casters() {
        let grid = grids[instance.mesh].as_ref().unwrap();
        let world_from_object = DMat4::from(instance.world_from_object).as_mat4();
        let instance_at = Instance::at(world_from_object.to_cols_array_2d());
        let occluder = AogridOccluder::new(grid, &instance_at).unwrap();
        let texture = CpuTexture::of_grid(grid);
        for ((receiver, &id), sum) in receivers.iter().zip(ids).zip(&mut combined) {
            let [p, n] = [receiver.position, receiver.normal].map(|v| v.map(|x| x as f32));
            let lookup = match id == instance.id {
                true => aogrid_lookup_on_itself(&occluder, p, n),
                false => aogrid_lookup(&occluder, p),
            };
            if lookup.is_reached {
                let one = aogrid_cone_with_axis_at(&occluder, &texture, &clip, lookup, n);
                *sum = match combine {
                    Combine::Multiply => aogrid_multiply(*sum, one),
                    Combine::Merge => aogrid_merge(*sum, one, &overlaps),
                    Combine::Mean => aogrid_mean(*sum, one, &overlaps),
                };
            }
        }
    }
    combined
}

/// Returns the reference AO of each receiver, by other rays than the reference light's.
fn reference_occlusion(found: &OccludedReceivers) -> Vec<f32> {
    let options = ReferenceOptions {
        seed: 1,
        ..options(OCCLUSION_SAMPLES)
    };
    let (occluder, lighting) = (Some(&found.occluder), Lighting::default());
    let shades = reference::shade(occluder, &found.receivers, &lighting, &options, UNOBSERVED);
    shades.unwrap().iter().map(|s| s.occlusion.mean).collect()
}

/// Returns the RMS error of the light under a white sky, which is 1 − AO, over its mean.
fn white_sky(found: &OccludedReceivers, occlusion: &[f32]) -> f64 {
    let pairs = found.combined.iter().zip(occlusion);
    let squares = pairs.map(|(combined, ao)| f64::from(combined[3] - (1.0 - ao)).powi(2));
    let left: f64 = occlusion.iter().map(|ao| f64::from(1.0 - ao)).sum();
    let n = occlusion.len() as f64;
    (squares.sum::<f64>() / n).sqrt() / (left / n)
}

/// Returns the receivers with the grids' axes and another AO.
fn with_occlusion(found: OccludedReceivers, occlusion: &[f32]) -> OccludedReceivers {
    // The axis sums scale with AO, so that their mean directions stay.
    let rescaled = |(combined, &ao): (&[f32; 4], &f32)| {
        let [x, y, z, transmittance] = *combined;
        let times = ao / (1.0 - transmittance).max(f32::EPSILON);
        [times * x, times * y, times * z, 1.0 - ao]
    };
    let combined = found.combined.iter().zip(occlusion).map(rescaled).collect();
    OccludedReceivers { combined, ..found }
}

/// The scenes, each with the largest share of (1 − AO) · B's error that may remain with the
/// reference AO under the gradient. The finer grids measure 0.35, 0.50, 0.29 and 0.55.
const SCENES: [(&str, f64); 4] = [
    ("box-on-floor.toml", 0.4),
    ("table.toml", 0.55),
    ("spheres-and-boxes.toml", 0.35),
    ("robot.toml", 0.6),
];

/// Reports the share of (1 − AO) · B's error that remains with the grids' AO and with the reference
/// AO: the error of the light's model, and what AO's own error adds to it.
#[test]
fn errors_of_scenes_lit_through_their_grids_are_bounded() {
    let lights = lights();
    let mut sums = [[0.0; 3]; 2];
    for (scene, limit) in SCENES {
        for settings in &SETTINGS {
            let found = receivers_with_grids(scene, settings);
            let occlusion = reference_occlusion(&found);
            let white = white_sky(&found, &occlusion);
            println!("{scene}, {}: white sky {white:.4}", settings.name);
            let by_grid = lights.iter().map(|light| diffuse(&found, light, SAMPLES));
            let by_grid: Vec<Errors> = by_grid.collect();
            let found = with_occlusion(found, &occlusion);
            for (light, by_grid) in lights.iter().zip(by_grid) {
                report(scene, light.name, by_grid);
                let by_reference = diffuse(&found, light, SAMPLES);
                report("  with the reference AO", light.name, by_reference);
                for (sums, errors) in sums.iter_mut().zip([by_grid, by_reference]) {
                    (0..3).for_each(|k| sums[k] += (errors[k] / errors[1]).powi(2));
                }
                if light.name == "gradient" && settings.name == FINE {
                    assert!(
                        by_reference[0] < limit * by_reference[1],
                        "{scene}: {by_reference:?}"
                    );
                }
            }
        }
    }
    let count = (SCENES.len() * SETTINGS.len() * lights.len()) as f64;
    let [by_grid, by_reference] = sums.map(|sums| sums.map(|sum| (sum / count).sqrt()));
    report("all, root mean squares", "", by_grid);
    report("  with the reference AO", "", by_reference);
    assert!(by_grid[0] < by_grid[1], "{by_grid:?}");
    assert!(
        by_reference[0] < 0.75 * by_reference[1] && by_reference[0] < by_reference[2],
        "{by_reference:?}"
    );
}
