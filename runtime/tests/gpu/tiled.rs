use aogrid_grid_format::{Encoding, TexelFormat};
use aogrid_runtime::{
    AOGRID_LIST_ALL_DEPTHS, AOGRID_LIST_OPAQUE, Combine, GBufferError, GBufferFormat, GBufferViews,
    GridAtlas, GridAtlasError, Instance, Mode, Output, PassError, Positions, PrepareError,
    Receivers, TiledFrame, TiledPass, TiledPassDescriptor, wgsl,
};
use glam::{EulerRot, Mat4, Quat, Vec3};

use crate::grids::{ball, ball_in, other_spec, spec};
use crate::many::{ManyOccluders, halves, max_difference, tiled_descriptor, vectors};
use crate::merge::ERROR_PER_MERGE;
use crate::raster;
use crate::scene::{SIZE, orthographic, perspective, reversed};
use aogrid_gpu_support::{Gpu, gpu};

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
    for combine in [Combine::Multiply, Combine::Merge] {
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
            Combine::Merge => 11.0 * ERROR_PER_MERGE,
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

/// A kernel that shades given points at given pixels with the tile lists.
const FORWARD: &str = "
struct Point { position: vec4f, normal: vec4f, pixel_and_object: vec4u }
@group(0) @binding(0) var<storage, read> points: array<Point>;
@group(0) @binding(1) var<storage, read_write> outputs: array<vec4f>;
override list: u32;
@compute @workgroup_size(64)
fn forward(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&points) {
        let at = points[id.x];
        let seen = at.pixel_and_object;
        outputs[2u * id.x] = aogrid_merge_listed(list, seen.xy, at.position.xyz, at.normal.xyz, seen.zw);
        outputs[2u * id.x + 1u] = aogrid_multiply_listed(list, seen.xy, at.position.xyz, at.normal.xyz, seen.zw);
    }
}
";

type Point = ([f32; 4], [f32; 4], [u32; 4]);

/// Returns the merged and the multiplied result of each point.
fn forward(gpu: &Gpu, pass: &TiledPass, list: u32, points: &[Point]) -> Vec<[[f32; 4]; 2]> {
    let Gpu { device, queue, .. } = gpu;
    let source = [wgsl::SHADING, &wgsl::tile_lists(1), FORWARD].concat();
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("test"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let storage = |read_only: bool| wgpu::BindGroupLayoutEntry {
        binding: u32::from(!read_only),
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let own = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("test"),
        entries: &[storage(true), storage(false)],
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("test"),
        bind_group_layouts: &[Some(&own), Some(pass.lists_layout())],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("test"),
        layout: Some(&layout),
        module: &module,
        entry_point: Some("forward"),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants: &[("list", f64::from(list))],
            ..Default::default()
        },
        cache: None,
    });
    let words = |(p, n, seen): &Point| [p.map(f32::to_bits), n.map(f32::to_bits), *seen];
    let words: Vec<[u32; 4]> = points.iter().flat_map(words).collect();
    let input = gpu.storage(bytemuck::cast_slice(&words));
    let output = gpu.storage(&vec![0; 32 * points.len()]);
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("test"),
        layout: &own,
        entries: &[&input, &output].map(|buffer| wgpu::BindGroupEntry {
            binding: u32::from(buffer == &output),
            resource: buffer.as_entire_binding(),
        }),
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut compute = encoder.begin_compute_pass(&Default::default());
    compute.set_pipeline(&pipeline);
    compute.set_bind_group(0, &group, &[]);
    compute.set_bind_group(1, pass.lists().unwrap(), &[]);
    compute.dispatch_workgroups(points.len().div_ceil(64) as u32, 1, 1);
    drop(compute);
    queue.submit([encoder.finish()]);
    let outputs: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&output));
    let pairs = outputs.chunks_exact(2);
    pairs.map(|both| [both[0], both[1]]).collect()
}

#[test]
fn tile_lists_shade_the_g_buffer_and_points_in_front_of_it() {
    let Some(gpu) = gpu() else { return };
    let kept = tiled_descriptor();
    let mut pass = TiledPass::new(&gpu.device, &gpu.queue, kept.clone()).unwrap();
    let mut many = ManyOccluders::new(UNALIGNED_SIZE, perspective());
    many.occluders = crowd(300);
    many.dispatch(&gpu, &kept, &mut pass);
    let twin = many.cpu_twin();
    let pixel = |idx: u32| [idx % UNALIGNED_SIZE[0], idx / UNALIGNED_SIZE[0]];
    let shown: Vec<Point> = (0..UNALIGNED_SIZE[0] * UNALIGNED_SIZE[1])
        .map(|idx| {
            let ([x, y], at) = (pixel(idx), idx as usize);
            let object = many.buffer.receivers[at];
            (
                many.buffer.positions[at],
                many.buffer.normals[at],
                [x, y, object[0], object[1]],
            )
        })
        .collect();
    // Move points between the camera and the visible surface, like smoke or glass.
    let eye = Vec3::new(3.0, 2.5, 4.0);
    let mut floating = shown.clone();
    for (idx, (position, normal, _)) in floating.iter_mut().enumerate() {
        let t = 0.2 + 0.7 * ((idx * 7919) % 1000) as f32 / 1000.0;
        let [x, y, z, _] = *position;
        *position = eye.lerp(Vec3::new(x, y, z), t).extend(1.0).to_array();
        *normal = Vec3::new(0.6, 0.0, 0.8).extend(0.0).to_array();
    }
    for (list, points) in [
        (AOGRID_LIST_OPAQUE, &shown),
        (AOGRID_LIST_ALL_DEPTHS, &shown),
        (AOGRID_LIST_ALL_DEPTHS, &floating),
    ] {
        let found = forward(&gpu, &pass, list, points);
        for (which, combine) in [(0, Combine::Merge), (1, Combine::Multiply)] {
            let expected = points.iter().map(|([x, y, z, _], [nx, ny, nz, _], seen)| {
                twin.shade([*x, *y, *z], [*nx, *ny, *nz], [seen[2], seen[3]], combine)
            });
            let found: Vec<_> = found.iter().map(|both| both[which]).collect();
            let expected: Vec<_> = expected.collect();
            assert!(max_difference(&found, &expected) <= 6.0 * ERROR_PER_MERGE);
        }
    }
    // The list of receivers is the shorter one: it lacks occluders of the floating points.
    let found = forward(&gpu, &pass, AOGRID_LIST_OPAQUE, &floating);
    let by_all = forward(&gpu, &pass, AOGRID_LIST_ALL_DEPTHS, &floating);
    assert!(
        found
            .iter()
            .zip(&by_all)
            .any(|(a, b)| a[0][3] > b[0][3] + 0.1)
    );
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

#[test]
fn unsuitable_descriptors_and_frames_are_rejected() {
    let Some(gpu) = gpu() else { return };
    let Gpu { device, queue, .. } = &gpu;
    let refusal = |descriptor| TiledPass::new(device, queue, descriptor).unwrap_err();
    let no_axis = TiledPassDescriptor {
        mode: Mode::Occlusion,
        ..tiled_descriptor()
    };
    assert_eq!(refusal(no_axis), PassError::NoAxis);
    for (target, output) in [
        (wgpu::TextureFormat::R16Float, Output::Transmittance),
        (
            wgpu::TextureFormat::Rgba8Unorm,
            Output::TransmittanceAndAxis,
        ),
    ] {
        let descriptor = TiledPassDescriptor {
            target,
            output,
            ..tiled_descriptor()
        };
        assert!(matches!(refusal(descriptor), PassError::Target { .. }));
    }
    let cones = ball(Encoding::Cone, TexelFormat::F16);
    let bytes = ball(Encoding::Cone, TexelFormat::Unorm8);
    let plain = ball(Encoding::Occlusion, TexelFormat::F16);
    let atlas = |grids: &[_]| GridAtlas::new(device, queue, grids, "balls");
    assert_eq!(atlas(&[]).unwrap_err(), GridAtlasError::Empty);
    assert_eq!(
        atlas(&[&cones, &bytes]).unwrap_err(),
        GridAtlasError::Mixed(1)
    );
    let (cones, plain) = (atlas(&[&cones]).unwrap(), atlas(&[&plain]).unwrap());
    let many = ManyOccluders::new(SIZE, perspective());
    let views = many.views(&gpu);
    let format = tiled_descriptor().target;
    let target = gpu
        .storage_target(SIZE, format)
        .create_view(&Default::default());
    let small = gpu
        .storage_target([16, 16], format)
        .create_view(&Default::default());
    let mut pass = TiledPass::new(device, queue, tiled_descriptor()).unwrap();
    let crowd = vec![many.occluders[0]; TiledPass::MAX_OCCLUDERS + 1];
    let frame = TiledFrame {
        gbuffer: views.gbuffer(perspective(), &raster::world_and_signed()),
        atlas: &cones,
        occluders: &many.occluders[..1],
        target: &target,
    };
    let mut prepare = |frame| pass.prepare(device, queue, &frame);
    assert_eq!(prepare(frame), Ok(()));
    let occluders = &many.occluders;
    let cases = [
        (
            TiledFrame { occluders, ..frame },
            PrepareError::NoSuchGrid(1),
        ),
        (
            TiledFrame {
                occluders: &crowd,
                ..frame
            },
            PrepareError::TooMany(crowd.len()),
        ),
        (
            TiledFrame {
                atlas: &plain,
                ..frame
            },
            PrepareError::NoCones(0),
        ),
        (
            TiledFrame {
                target: &small,
                ..frame
            },
            PrepareError::TargetSize,
        ),
        (
            TiledFrame {
                gbuffer: GBufferViews {
                    normals: None,
                    ..frame.gbuffer
                },
                ..frame
            },
            GBufferError::Missing("normals").into(),
        ),
    ];
    for (frame, expected) in cases {
        assert_eq!(prepare(frame), Err(expected));
    }
}
