/// Descriptors and frames that are rejected.
mod rejections;
/// A scene for the pass and for the CPU twin.
mod scene;

use aogrid_gpu_support::{Gpu, gpu, gpu_with};
use aogrid_grid_format::{Encoding, TexelFormat};
use aogrid_runtime::shading::*;
use aogrid_runtime::{
    AogridOccluder, CpuTexture, DepthTest, GBufferFormat, GridTexture, Instance, Mode,
    OcclusionPassDescriptor, Output, Positions, Receivers,
};
use glam::camera::rh::{proj, view};
use glam::{Mat4, Vec3};

use crate::grids::{ball, flattened};
use crate::scene::{SIZE, Shape, Surface, gbuffer, orthographic, perspective, reversed};

pub use scene::{Scene, descriptor, faded, max_difference, world_and_signed};

/// The error of one occluder with a float grid and a 32-bit float target: a few roundings in
/// positions of a few units, which T_clip amplifies fourfold.
const ERROR_PER_OCCLUDER: f32 = 1e-5;

/// One rounding to a half float just below 1. Mesa's software rasterizer truncates when it blends
/// half floats.
const HALF_ROUNDING: f32 = 1.0 / 2048.0;

#[test]
fn images_match_the_cpu_twin_in_perspective_and_orthographic() {
    let Some(gpu) = gpu() else { return };
    for camera in [perspective(), reversed(), orthographic()] {
        let scene = Scene::new(camera, faded());
        let found = scene.transmittances(&gpu, descriptor());
        assert!(max_difference(&found, &scene.twin_image(Mode::Cone)) <= 3.0 * ERROR_PER_OCCLUDER);
    }
}

#[test]
fn grids_without_a_fade_end_where_the_cpu_twin_ends_them() {
    let Some(gpu) = gpu() else { return };
    let scene = Scene::new(perspective(), ball(Encoding::Cone, TexelFormat::F32));
    let found = scene.transmittances(&gpu, descriptor());
    let expected = scene.twin_image(Mode::Cone);
    let pairs = found.iter().zip(&expected);
    let different = pairs.filter(|(a, b)| (*a - *b).abs() > 3.0 * ERROR_PER_OCCLUDER);
    // One or two receivers of an image may lie within rounding of a box's face.
    assert!(different.count() <= 2);
}

#[test]
fn far_fields_end_where_they_have_faded_out() {
    let Some(gpu) = gpu() else { return };
    for mode in [Mode::Cone, Mode::Occlusion] {
        for camera in [perspective(), orthographic()] {
            let grid = flattened(&ball(Encoding::Moment, TexelFormat::F16));
            let mut scene = Scene::new(camera, grid);
            for instance in &mut scene.instances {
                instance.far_field = Some(0.05);
            }
            let descriptor = OcclusionPassDescriptor {
                mode,
                ..descriptor()
            };
            let found = scene.transmittances(&gpu, descriptor);
            // Every pixel, also those next to an end: there is no step.
            let expected = scene.twin_image(mode);
            assert!(max_difference(&found, &expected) <= 3.0 * ERROR_PER_OCCLUDER);
        }
    }
}

#[test]
fn positions_from_depth_shade_like_world_positions() {
    let Some(gpu) = gpu() else { return };
    for camera in [perspective(), reversed(), orthographic()] {
        let scene = Scene::new(camera, faded());
        let from_depth = OcclusionPassDescriptor {
            gbuffer: GBufferFormat {
                positions: Positions::Depth,
                ..world_and_signed()
            },
            ..descriptor()
        };
        let found = scene.transmittances(&gpu, from_depth);
        // One step of a depth near 1 is 2^-24 = 6e-8. At a distance of 6 units from a near plane of
        // 0.1 that is 6 * 6 / 0.1 * 6e-8 = 2e-5 units. There a changes by 0.34 in a cell of 0.1
        // units (the smallest here), and T_clip multiplies that by 4.
        let tolerance = 3.0 * (2e-5 * 4.0 * 3.4 + ERROR_PER_OCCLUDER);
        assert!(max_difference(&found, &scene.twin_image(Mode::Cone)) <= tolerance);
    }
}

#[test]
fn a_depth_test_does_not_change_the_image() {
    let wanted = wgpu::Features::FLOAT32_BLENDABLE | wgpu::Features::DEPTH_CLIP_CONTROL;
    let Some(gpu) = gpu_with(wanted) else { return };
    let near_far = |far: f32| {
        let view = view::look_at_mat4(Vec3::new(3.0, 2.5, 4.0), Vec3::ZERO, Vec3::Y);
        proj::directx::perspective(0.9, SIZE[0] as f32 / SIZE[1] as f32, 0.1, far) * view
    };
    let cases = [
        (near_far(50.0), wgpu::CompareFunction::GreaterEqual),
        (reversed(), wgpu::CompareFunction::LessEqual),
        // The far plane cuts through the boxes.
        (near_far(6.5), wgpu::CompareFunction::GreaterEqual),
    ];
    for (camera, compare) in cases {
        let scene = Scene::new(camera, faded());
        let without = scene.transmittances(&gpu, descriptor());
        let with = OcclusionPassDescriptor {
            gbuffer: GBufferFormat {
                depth: Some(DepthTest {
                    format: wgpu::TextureFormat::Depth32Float,
                    compare,
                }),
                ..world_and_signed()
            },
            ..descriptor()
        };
        let with = scene.transmittances(&gpu, with);
        assert_eq!(with, without);
        assert!(max_difference(&with, &scene.twin_image(Mode::Cone)) <= 3.0 * ERROR_PER_OCCLUDER);
    }
}

#[test]
fn cameras_inside_a_box_and_in_front_of_an_occluder_see_its_shadow() {
    let Some(gpu) = gpu() else { return };
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let projection = proj::directx::perspective(1.2, aspect, 0.1, 50.0);
    // Inside the first box; and with the ball, which is at the origin, behind the camera.
    for (eye, at) in [
        (Vec3::new(0.2, 0.7, 0.9), Vec3::new(0.0, -0.6, 0.0)),
        (Vec3::new(0.0, 0.2, -0.62), Vec3::new(0.0, -0.4, -3.0)),
    ] {
        let camera = projection * view::look_at_mat4(eye, at, Vec3::Y);
        let scene = Scene::new(camera, faded());
        let found = scene.transmittances(&gpu, descriptor());
        assert!(max_difference(&found, &scene.twin_image(Mode::Cone)) <= 3.0 * ERROR_PER_OCCLUDER);
    }
}

#[test]
fn ids_layers_strength_and_exclusion_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    for mode in [Mode::Cone, Mode::Occlusion] {
        let mut scene = Scene::new(perspective(), faded());
        scene.instances[0].object_id = 3;
        scene.instances[1].strength = 0.4;
        scene.instances[1].layers = 2;
        scene.instances[2].excluded[0] = 3;
        scene.instances[2].excluded[1] = 2;
        let with_ids = OcclusionPassDescriptor {
            mode,
            gbuffer: GBufferFormat {
                receivers: Receivers::IdsAndLayers,
                ..world_and_signed()
            },
            ..descriptor()
        };
        let found = scene.transmittances(&gpu, with_ids);
        assert!(
            max_difference(&found, &scene.twin_image(mode)) <= 3.0 * ERROR_PER_OCCLUDER,
            "{mode:?}"
        );
        // The ids, layers and strength do change the image.
        let plain = Scene::new(perspective(), faded()).twin_image(mode);
        assert!(max_difference(&found, &plain) > 0.1);
    }
}

#[test]
fn grids_of_both_encodings_share_a_frame() {
    let Some(gpu) = gpu() else { return };
    let Gpu { device, queue, .. } = &gpu;
    let scene = Scene::new(perspective(), ball(Encoding::Cone, TexelFormat::F32));
    let descriptor = OcclusionPassDescriptor {
        mode: Mode::Occlusion,
        ..descriptor()
    };
    let expected = scene.transmittances(&gpu, descriptor.clone());
    // The same values, in a grid without axes for every second occluder.
    let grids = [Encoding::Cone, Encoding::Occlusion].map(|encoding| {
        let grid = ball(encoding, TexelFormat::F32);
        GridTexture::new(device, queue, &grid, "ball").unwrap()
    });
    let occluders = grids.iter().cycle().zip(scene.instances.iter().copied());
    let found = scene.draw(&gpu, descriptor, &occluders.collect::<Vec<_>>());
    assert!(bytemuck::pod_collect_to_vec::<u8, f32>(&found) == expected);
}

#[test]
fn axes_add_up_while_transmittances_multiply() {
    let Some(gpu) = gpu() else { return };
    let scene = Scene::new(perspective(), faded());
    let with_axis = OcclusionPassDescriptor {
        output: Output::TransmittanceAndAxis,
        target: wgpu::TextureFormat::Rgba32Float,
        ..descriptor()
    };
    let found: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&scene.texels(&gpu, with_axis));
    let clip = CpuTexture::clip_table();
    let texture = CpuTexture::of_grid(&scene.grid);
    let mut longest = 0.0_f32;
    for (pixel, found) in found.iter().enumerate() {
        let [x, y, z, _] = scene.buffer.positions[pixel];
        let [nx, ny, nz, _] = scene.buffer.normals[pixel];
        let mut expected = [0.0, 0.0, 0.0, 1.0];
        for instance in &scene.instances {
            let occluder = AogridOccluder::new(&scene.grid, instance).unwrap();
            let lookup = aogrid_lookup(&occluder, [x, y, z]);
            if lookup.is_reached {
                let n = [nx, ny, nz];
                let one = aogrid_cone_with_axis_at(&occluder, &texture, &clip, lookup, n);
                (0..3).for_each(|c| expected[c] += one[c]);
                expected[3] *= one[3];
            }
        }
        longest = longest.max(expected[1].abs());
        let pairs = found.iter().zip(expected);
        let difference = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        // f, which turns the axes, jumps from 0 to 1 at the horizon in places.
        assert!(
            difference <= 3.0 * 20.0 * ERROR_PER_OCCLUDER,
            "{found:?} {expected:?}"
        );
    }
    assert!(longest > 0.2);
}

#[test]
fn many_occluders_need_a_target_wider_than_eight_bits() {
    let Some(gpu) = gpu() else { return };
    let mut scene = Scene::new(perspective(), faded());
    scene.instances = (0..40)
        .map(|_| Instance {
            strength: 0.05,
            ..scene.instances[0]
        })
        .collect();
    let expected = scene.twin_image(Mode::Cone);
    let floats = max_difference(&scene.transmittances(&gpu, descriptor()), &expected);
    let halves = OcclusionPassDescriptor {
        target: wgpu::TextureFormat::R16Float,
        ..descriptor()
    };
    let halves: Vec<u16> = bytemuck::pod_collect_to_vec(&scene.texels(&gpu, halves));
    let halves: Vec<_> = halves
        .iter()
        .map(|h| half::f16::from_bits(*h).to_f32())
        .collect();
    // The same rounding forty times.
    let drift = max_difference(&halves, &expected);
    assert!(drift <= 40.0 * HALF_ROUNDING + 40.0 * ERROR_PER_OCCLUDER);
    let bytes = OcclusionPassDescriptor {
        target: wgpu::TextureFormat::Rgba8Unorm,
        ..descriptor()
    };
    let bytes = scene.texels(&gpu, bytes);
    let bytes: Vec<_> = bytes
        .iter()
        .step_by(4)
        .map(|b| f32::from(*b) / 255.0)
        .collect();
    let bytes = max_difference(&bytes, &expected);
    println!("off by {floats:.1e} in floats, {drift:.3} in halves, {bytes:.3} in bytes");
    assert!(bytes > 1.5 * drift);
    assert!(floats <= 40.0 * ERROR_PER_OCCLUDER);
}

/// Returns a ball close behind a wall that faces the camera (JGT, 3.2).
fn behind_a_wall() -> Scene {
    let eye = view::look_at_mat4(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, Vec3::Y);
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let camera = proj::directx::perspective(0.6, aspect, 0.1, 50.0) * eye;
    let wall = Surface {
        shape: Shape::Plane {
            point: Vec3::ZERO,
            normal: Vec3::Z,
        },
        object_id: 1,
        layers: 1,
    };
    let world_from_object = Mat4::from_translation(Vec3::new(0.0, 0.0, -0.6));
    Scene {
        buffer: gbuffer(camera, &[wall]),
        instances: vec![Instance::at(world_from_object.to_cols_array_2d())],
        ..Scene::new(camera, faded())
    }
}

#[test]
fn scalar_occlusion_leaks_through_a_wall_and_cones_do_not() {
    let Some(gpu) = gpu() else { return };
    let scene = behind_a_wall();
    let shade = |mode| {
        scene.transmittances(
            &gpu,
            OcclusionPassDescriptor {
                mode,
                ..descriptor()
            },
        )
    };
    let darkest = |t: &[f32]| t.iter().copied().fold(1.0, f32::min);
    let leaks = darkest(&shade(Mode::Occlusion));
    assert!(leaks < 0.8, "{leaks}");
    // The cones lie wholly behind the tangent plane.
    let stops = darkest(&shade(Mode::Cone));
    assert!(stops >= 1.0 - ERROR_PER_OCCLUDER, "{stops}");
}
