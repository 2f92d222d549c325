//! Light from environments in scenes by their grids, against ray tracing; and what part of the error
//! is AO's own.

use std::path::Path;

use aogrid_bake_core::{BakeOptions, Extent, Placement, UNOBSERVED};
use aogrid_baker_cpu::Occluder;
use aogrid_baker_cpu::truth::{self, Lighting, Receiver, TruthOptions};
use aogrid_grid_format::{BoundaryMode, TexelFormat};
use aogrid_runtime::shading::*;
use aogrid_runtime::{AogridOccluder, Combine, Instance, LinearTexture};
use glam::DMat4;
use xtask::scene::{self, GBuffer, GridSource, Grids, LoadOptions, Scene};

use crate::environment_light::{Errors, Found, diffuse, lights, options, report};

/// How a scene's grids are baked, without a fade, and combined.
struct Settings {
    name: &'static str,
    resolution: u32,
    epsilon: f32,
    format: TexelFormat,
    combine: Combine,
}

/// As by default; and as good as they get.
const SETTINGS: [Settings; 2] = [
    Settings {
        name: "8 bits, 32³",
        resolution: 32,
        epsilon: 0.1,
        format: TexelFormat::Unorm8,
        combine: Combine::Multiply,
    },
    Settings {
        name: "floats, 64³",
        resolution: 64,
        epsilon: 0.02,
        format: TexelFormat::F32,
        combine: Combine::Merge,
    },
];

/// Of the light's truth, whose variance is taken off.
const SAMPLES: u32 = 256;

/// Of AO's truth, which replaces the grids': a few thousandths of noise.
const OCCLUSION_SAMPLES: u32 = 1024;

/// What a scene's camera sees.
fn by_grids(name: &str, settings: &Settings) -> Found {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../scenes")
        .join(name);
    let mut scene = scene::load(&path, LoadOptions::default()).unwrap();
    scene.camera.as_mut().unwrap().resolution = [40, 30];
    for mesh in &mut scene.meshes {
        let options = BakeOptions {
            boundary: BoundaryMode::None,
            format: settings.format,
            ..BakeOptions::recommended()
        };
        let placement = Placement {
            resolution: [settings.resolution; 3],
            extent: Extent::Epsilon(settings.epsilon),
        };
        mesh.grid = GridSource::Bake(placement, options);
    }
    let pixels = GBuffer::trace(&scene, UNOBSERVED).unwrap().receivers();
    let receivers: Vec<_> = pixels.into_iter().map(|(_, receiver)| receiver).collect();
    Found {
        hidden: hidden(&scene, &receivers, settings.combine),
        receivers,
        occluder: Occluder::new(&scene.flattened(|i| i.casts).unwrap().unwrap()),
    }
}

fn hidden(scene: &Scene, receivers: &[Receiver], combine: Combine) -> Vec<[f32; 4]> {
    let grids = Grids::new().resolve(scene, UNOBSERVED).unwrap();
    let clip = LinearTexture::clip_table();
    let overlaps = LinearTexture::intersection_table();
    let mut hidden = vec![[0.0, 0.0, 0.0, 1.0]; receivers.len()];
    for instance in scene.casters() {
        let grid = grids[instance.mesh].as_ref().unwrap();
        let world_from_object = DMat4::from(instance.world_from_object).as_mat4();
        let place = Instance::at(world_from_object.to_cols_array_2d());
        let occluder = AogridOccluder::new(grid.spec(), grid.format(), &place).unwrap();
        let texture = LinearTexture::of_grid(grid);
        for (receiver, sum) in receivers.iter().zip(&mut hidden) {
            let [p, n] = [receiver.position, receiver.normal].map(|v| v.map(|x| x as f32));
            let p_grid = aogrid_grid_position(&occluder, p);
            if aogrid_is_inside(p_grid) {
                let one = aogrid_cone_with_axis_at(&occluder, &texture, &clip, p_grid, n);
                *sum = match combine {
                    Combine::Multiply => aogrid_multiply(*sum, one),
                    Combine::Merge => aogrid_merge(*sum, one, &overlaps),
                };
            }
        }
    }
    hidden
}

/// AO of each receiver, by rays that the light's truth does not use.
fn true_occlusion(found: &Found) -> Vec<f32> {
    let options = TruthOptions {
        seed: 1,
        ..options(OCCLUSION_SAMPLES)
    };
    let (occluder, lighting) = (Some(&found.occluder), Lighting::default());
    let truth = truth::shade(occluder, &found.receivers, &lighting, &options, UNOBSERVED);
    truth.unwrap().iter().map(|s| s.occlusion.mean).collect()
}

/// Under a white sky light is 1 − AO: how far that is off, over its mean.
fn white_sky(found: &Found, occlusion: &[f32]) -> f64 {
    let pairs = found.hidden.iter().zip(occlusion);
    let squares = pairs.map(|(hidden, ao)| f64::from(hidden[3] - (1.0 - ao)).powi(2));
    let left: f64 = occlusion.iter().map(|ao| f64::from(1.0 - ao)).sum();
    let n = occlusion.len() as f64;
    (squares.sum::<f64>() / n).sqrt() / (left / n)
}

/// The grids' axes, with another AO.
fn with_occlusion(found: Found, occlusion: &[f32]) -> Found {
    let rescaled = |(hidden, &ao): (&[f32; 4], &f32)| {
        let [x, y, z, left] = *hidden;
        let times = ao / (1.0 - left).max(f32::EPSILON);
        [times * x, times * y, times * z, 1.0 - ao]
    };
    let hidden = found.hidden.iter().zip(occlusion).map(rescaled).collect();
    Found { hidden, ..found }
}

/// What may be left of (1 − AO) · B's error with the true AO under the gradient: 0.35, 0.50, 0.29
/// and 0.55 are, of the finer grids.
const SCENES: [(&str, f64); 4] = [
    ("box-on-floor.toml", 0.4),
    ("table.toml", 0.55),
    ("spheres-and-boxes.toml", 0.35),
    ("robot.toml", 0.6),
];

/// How much of (1 − AO) · B's error is left, by the grids' AO and by the true one: what the light's
/// model leaves, and what AO's own error adds to it.
#[test]
fn scenes_by_their_grids_are_reported() {
    let lights = lights();
    let mut sums = [[0.0; 3]; 2];
    for (scene, limit) in SCENES {
        for settings in &SETTINGS {
            let found = by_grids(scene, settings);
            let occlusion = true_occlusion(&found);
            let white = white_sky(&found, &occlusion);
            println!("{scene}, {}: white sky {white:.4}", settings.name);
            let by_grid = lights.iter().map(|light| diffuse(&found, light, SAMPLES));
            let by_grid: Vec<Errors> = by_grid.collect();
            let found = with_occlusion(found, &occlusion);
            for (light, by_grid) in lights.iter().zip(by_grid) {
                report(scene, light.name, by_grid);
                let by_truth = diffuse(&found, light, SAMPLES);
                report("  with the true AO", light.name, by_truth);
                for (sums, errors) in sums.iter_mut().zip([by_grid, by_truth]) {
                    (0..3).for_each(|k| sums[k] += (errors[k] / errors[1]).powi(2));
                }
                if light.name == "gradient" && settings.format == TexelFormat::F32 {
                    assert!(by_truth[0] < limit * by_truth[1], "{scene}: {by_truth:?}");
                }
            }
        }
    }
    let count = (SCENES.len() * SETTINGS.len() * lights.len()) as f64;
    let [by_grid, by_truth] = sums.map(|sums| sums.map(|sum| (sum / count).sqrt()));
    report("all, root mean squares", "", by_grid);
    report("  with the true AO", "", by_truth);
    assert!(by_grid[0] < by_grid[1], "{by_grid:?}");
    assert!(
        by_truth[0] < 0.75 * by_truth[1] && by_truth[0] < by_truth[2],
        "{by_truth:?}"
    );
}
