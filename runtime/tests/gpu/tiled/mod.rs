/// The lists, for forward and transparent shaders.
mod lists;
/// Descriptors, atlases and frames that are rejected.
mod rejections;

use aogrid_gpu_support::gpu;
use aogrid_grid_format::{Encoding, TexelFormat};
use aogrid_runtime::{
    Combine, GBufferFormat, Instance, Mode, Output, Positions, Receivers, TiledPass,
    TiledPassDescriptor,
};
use glam::{EulerRot, Mat4, Quat, Vec3};

use crate::grids::{ball_in, other_spec, spec};
use crate::many::{ManyOccluders, halves, max_difference, tiled_descriptor, vectors};
use crate::merge::ERROR_PER_MERGE;
use crate::raster;
use crate::scene::{SIZE, orthographic, perspective, reversed};

/// An image size that is no multiple of the tile size.
const UNALIGNED_SIZE: [u32; 2] = [117, 93];

/// The error of one occluder: that of the raster pass, and the rounding of an atlas's coordinates,
/// 2⁻²⁴ of its 64 texels, each of which changes a look-up by at most a third.
const ERROR_PER_OCCLUDER: f32 = 2e-5;

/// The error of its axis next to the jump of f.
const ERROR_PER_AXIS: f32 = 20.0 * ERROR_PER_OCCLUDER;

fn multiplied() -> TiledPassDescriptor {
    TiledPassDescriptor {
        combine: Combine::Multiply,
        ..tiled_descriptor()
    }
}

#[test]
fn images_match_the_cpu_twin_multiplied_and_merged_for_every_camera() {
    let Some(gpu) = gpu() else { return };
    for size in [SIZE, UNALIGNED_SIZE] {
        for camera in [perspective(), reversed(), orthographic()] {
            let many = ManyOccluders::new(size, camera);
            let found = vectors(&many.tiled(&gpu, &multiplied()));
            assert!(
                max_difference(&found, &many.twin_image(Combine::Multiply)) <= 3.0 * ERROR_PER_AXIS
            );
            let found = vectors(&many.tiled(&gpu, &tiled_descriptor()));
            assert!(
                max_difference(&found, &many.twin_image(Combine::Merge)) <= 3.0 * ERROR_PER_MERGE
            );
        }
    }
}

#[test]
fn images_match_the_raster_passes() {
    let Some(gpu) = gpu() else { return };
    let many = ManyOccluders::new(SIZE, perspective());
    let by_raster = vectors(&many.merge(&gpu, &crate::many::merge_descriptor()));
    let in_tiles = vectors(&many.tiled(&gpu, &tiled_descriptor()));
    assert!(max_difference(&in_tiles, &by_raster) <= 3.0 * ERROR_PER_MERGE);

    let scene = raster::Scene::new(perspective(), raster::faded());
    let mut alike = ManyOccluders::new(SIZE, perspective());
    alike.grids.truncate(1);
    alike.occluders.iter_mut().for_each(|(grid, _)| *grid = 0);
    for mode in [Mode::Cone, Mode::Occlusion] {
        let in_tiles = TiledPassDescriptor {
            mode,
            output: Output::Transmittance,
            target: wgpu::TextureFormat::R32Float,
            ..multiplied()
        };
        let in_tiles: Vec<f32> = bytemuck::pod_collect_to_vec(&alike.tiled(&gpu, &in_tiles));
        let by_raster = aogrid_runtime::OcclusionPassDescriptor {
            mode,
            ..raster::descriptor()
        };
        let by_raster = scene.transmittances(&gpu, by_raster);
        assert!(raster::max_difference(&in_tiles, &by_raster) <= 3.0 * ERROR_PER_OCCLUDER);
    }
}

#[test]
fn every_target_format_is_as_accurate_as_its_texels() {
    use wgpu::TextureFormat as F;
    let Some(gpu) = gpu() else { return };
    let many = ManyOccluders::new(UNALIGNED_SIZE, perspective());
    let expected = many.twin_image(Combine::Merge);
    let whole = TiledPassDescriptor {
        target: F::Rgba16Float,
        ..tiled_descriptor()
    };
    let found = halves(&many.tiled(&gpu, &whole));
    // Written once: one rounding of axes up to 2 to a half float.
    assert!(max_difference(&found, &expected) <= 1.0 / 1024.0 + 3.0 * ERROR_PER_MERGE);
    let alone = |target| TiledPassDescriptor {
        target,
        output: Output::Transmittance,
        ..tiled_descriptor()
    };
    let bytes = many.tiled(&gpu, &alone(F::Rgba8Unorm));
    let floats: Vec<f32> = bytemuck::pod_collect_to_vec(&many.tiled(&gpu, &alone(F::R32Float)));
    for ((byte, float), expected) in bytes.chunks_exact(4).zip(floats).zip(expected) {
        assert!((float - expected[3]).abs() <= 3.0 * ERROR_PER_MERGE);
        // Half a step, and a rounding.
        let difference = (f32::from(byte[0]) / 255.0 - float).abs();
        assert!(difference <= 0.501 / 255.0, "{byte:?} {float}");
    }
}

#[test]
fn ids_layers_strength_and_exclusion_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let mut many = ManyOccluders::new(SIZE, perspective());
    let plain = many.twin_image(Combine::Merge);
    many.occluders[1].1.strength = 0.4;
    many.occluders[1].1.layers = 2;
    many.occluders[2].1.excluded = [3, 2, u32::MAX, u32::MAX];
    let with_ids = TiledPassDescriptor {
        gbuffer: GBufferFormat {
            receivers: Receivers::IdsAndLayers,
            ..raster::world_and_signed()
        },
        ..tiled_descriptor()
    };
    let found = vectors(&many.tiled(&gpu, &with_ids));
    assert!(max_difference(&found, &many.twin_image(Combine::Merge)) <= 3.0 * ERROR_PER_MERGE);
    assert!(max_difference(&found, &plain) > 0.1);
}

#[test]
fn depths_serve_as_positions_and_cleared_depths_as_background() {
    let Some(gpu) = gpu() else { return };
    for (camera, cleared) in [(perspective(), 1.0), (reversed(), 0.0)] {
        let mut many = ManyOccluders::new(SIZE, camera);
        for depth in &mut many.buffer.depths {
            *depth = if depth.is_nan() { cleared } else { *depth };
        }
        let from_depth = TiledPassDescriptor {
            gbuffer: GBufferFormat {
                positions: Positions::Depth,
                ..raster::world_and_signed()
            },
            ..multiplied()
        };
        let found = vectors(&many.tiled(&gpu, &from_depth));
        // The tolerance of the raster pass, with the axes' jump.
        let tolerance = 3.0 * (2e-5 * 4.0 * 3.4 + ERROR_PER_AXIS);
        assert!(max_difference(&found, &many.twin_image(Combine::Multiply)) <= tolerance);
    }
}

/// Returns the next pseudo-random number in 0..1.
fn random(state: &mut u64) -> f32 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*state >> 40) as f32 / (1 << 24) as f32
}

/// Returns balls of all sizes all over the scene, also behind the camera.
fn crowd(count: usize) -> Vec<(usize, Instance)> {
    let state = &mut 7;
    (0..count)
        .map(|i| {
            let mut between = |low: f32, high: f32| low + (high - low) * random(state);
            let position = Vec3::new(between(-4.0, 5.0), between(-1.0, 3.0), between(-2.0, 6.0));
            let angles = [between(0.0, 6.3), between(0.0, 6.3), between(0.0, 6.3)];
            let rotation = Quat::from_euler(EulerRot::XYZ, angles[0], angles[1], angles[2]);
            let scale = Vec3::splat(between(0.05, 0.4));
            let world_from_object =
                Mat4::from_scale_rotation_translation(scale, rotation, position);
            let instance = Instance {
                strength: between(0.2, 1.0),
                ..Instance::at(world_from_object.to_cols_array_2d())
            };
            (i % 2, instance)
        })
        .collect()
}

#[test]
fn a_thousand_occluders_match_a_loop_over_all_of_them_and_never_flicker() {
    let Some(gpu) = gpu() else { return };
    let mut many = ManyOccluders::new(UNALIGNED_SIZE, perspective());
    many.occluders = crowd(1000);
    for combine in [Combine::Multiply, Combine::Merge, Combine::Mean] {
        let descriptor = TiledPassDescriptor {
            combine,
            ..tiled_descriptor()
        };
        let mut pass = TiledPass::new(&gpu.device, &gpu.queue, descriptor.clone()).unwrap();
        let first = many.dispatch(&gpu, &descriptor, &mut pass);
        let expected = many.twin_image(combine);
        // Eleven boxes overlap at the most crowded pixel.
        let tolerance = match combine {
            Combine::Multiply => 11.0 * ERROR_PER_AXIS,
            Combine::Merge | Combine::Mean => 11.0 * ERROR_PER_MERGE,
        };
        assert!(max_difference(&vectors(&first), &expected) <= tolerance);
        let repeats = if combine == Combine::Merge { 20 } else { 1 };
        for _ in 0..repeats {
            assert!(many.dispatch(&gpu, &descriptor, &mut pass) == first);
        }
    }
}

#[test]
fn a_pass_can_be_reused_for_other_sizes_and_numbers_of_occluders() {
    let Some(gpu) = gpu() else { return };
    let descriptor = tiled_descriptor();
    let mut pass = TiledPass::new(&gpu.device, &gpu.queue, descriptor.clone()).unwrap();
    for (size, count) in [
        (UNALIGNED_SIZE, 3),
        (SIZE, 70),
        ([16, 16], 0),
        (UNALIGNED_SIZE, 200),
    ] {
        let mut many = ManyOccluders::new(size, perspective());
        many.occluders = crowd(count);
        let kept = many.dispatch(&gpu, &descriptor, &mut pass);
        assert!(kept == many.tiled(&gpu, &tiled_descriptor()), "{count}");
    }
}

#[test]
fn grids_in_an_atlas_match_their_own_texture_up_to_their_edges() {
    let Some(gpu) = gpu() else { return };
    for format in TexelFormat::ALL {
        // The grids are not faded, so that leaks from a neighbor would show.
        let mut many = ManyOccluders::new(SIZE, perspective());
        many.grids = [spec(), other_spec()]
            .map(|spec| ball_in(spec, Encoding::Cone, format))
            .to_vec();
        let found = vectors(&many.tiled(&gpu, &multiplied()));
        let expected = many.twin_image(Combine::Multiply);
        // Weights of 8 bits between 8-bit texels, as in the tests of single functions.
        let tolerance = match format {
            TexelFormat::Unorm8 => 0.04,
            TexelFormat::F16 | TexelFormat::F32 => {
                3.0 * ERROR_PER_AXIS + 8.0 * gpu.weight_error(false)
            }
        };
        let pairs = found.iter().zip(&expected);
        let different = pairs.filter(|(a, b)| (a[3] - b[3]).abs() > tolerance);
        // One or two receivers of an image may lie within rounding of a box's face.
        assert!(different.count() <= 2, "{format:?}");
        assert!(expected.iter().filter(|v| v[3] < 0.9).count() > 200);
    }
}
