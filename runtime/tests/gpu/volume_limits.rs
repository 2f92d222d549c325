use aogrid_gpu_support::{Gpu, gpu_with, gpu_with_limits};
use aogrid_runtime::volumes::aogrid_volume_occlusion;
use aogrid_runtime::{
    GBufferFormat, Normals, Positions, Receivers, VolumePass, VolumePassDescriptor,
    VolumePassError, VolumeResolution,
};
use glam::{Mat4, Vec3};

use crate::scene::perspective;
use crate::volumes::{Cubes, PER_TRIANGLE, device, linear};

/// Returns the sides of a square lattice over the surfaces, facing down.
fn lattice(cells: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let along = |i: u32| 3.0 * (i as f32 / cells as f32 - 0.5);
    let points = (0..=cells).flat_map(|z| (0..=cells).map(move |x| [along(x), 0.2, along(z)]));
    let corner = move |x: u32, z: u32| z * (cells + 1) + x;
    let triangles = (0..cells * cells).flat_map(|cell| {
        let (x, z) = (cell % cells, cell / cells);
        let [a, b] = [corner(x, z), corner(x + 1, z)];
        let [c, d] = [corner(x + 1, z + 1), corner(x, z + 1)];
        [[a, b, c], [a, c, d]]
    });
    (points.collect(), triangles.collect())
}

#[test]
fn a_hundred_thousand_triangles_are_those_of_the_twin() {
    let Some(gpu) = device() else { return };
    let mut cubes = Cubes::new(perspective(), linear(0.02));
    (cubes.vertices, cubes.triangles) = lattice(224);
    assert!(cubes.triangles.len() >= 100_000);
    cubes.transforms = vec![Mat4::from_translation(Vec3::new(0.0, -0.79, 0.0))];
    let found = cubes.draw(&gpu);
    assert!(found.iter().all(|sum| sum.is_finite()));
    // The twin is slow: a few pixels tell.
    let triangles = cubes.placed(&cubes.transforms[0]);
    let shaded = found.iter().enumerate().filter(|(_, sum)| **sum > 0.01);
    let shaded: Vec<_> = shaded.collect();
    assert!(shaded.len() > 500, "{}", shaded.len());
    for (pixel, sum) in shaded.iter().step_by(shaded.len() / 20) {
        let [p, n] = [&cubes.buffer.positions, &cubes.buffer.normals]
            .map(|texels| Vec3::from_slice(&texels[*pixel]));
        let of = |triangle: &[Vec3; 3]| {
            let corners = triangle.map(|corner| (corner - p).to_array());
            0.9 * aogrid_volume_occlusion(cubes.volume, corners, n.to_array())
        };
        let expected: f32 = triangles.iter().map(of).sum();
        let off = (*sum - expected).abs();
        assert!(off <= 36.0 * PER_TRIANGLE, "{pixel}: {sum} {expected}");
    }
}

#[test]
fn no_triangles_draw_nothing_and_those_off_screen_shade() {
    let Some(gpu) = device() else { return };
    let mut cubes = Cubes::new(perspective(), linear(0.4));
    cubes.triangles.clear();
    assert!(cubes.draw(&gpu).iter().all(|sum| *sum == 0.0));
    cubes.transforms.clear();
    assert!(cubes.draw(&gpu).iter().all(|sum| *sum == 0.0));
    // A cube behind the camera, whose volumes reach what it sees.
    let eye = perspective().inverse().project_point3(Vec3::ZERO);
    let mut behind = Cubes::new(perspective(), linear(20.0));
    behind.transforms = vec![Mat4::from_translation(1.2 * eye)];
    let (found, expected) = (behind.draw(&gpu), behind.twin());
    let shaded = expected.iter().filter(|sum| **sum > 1e-3).count();
    assert!(shaded > 500, "{shaded}");
    let differences = found.iter().zip(&expected).map(|(a, b)| (a - b).abs());
    assert!(differences.fold(0.0, f32::max) <= 12.0 * PER_TRIANGLE);
}

#[test]
fn a_hundred_frames_have_the_same_bits() {
    let Some(gpu) = device() else { return };
    let cubes = Cubes::new(perspective(), linear(0.4));
    let first = cubes.draw(&gpu);
    assert!((1..100).all(|_| cubes.draw(&gpu) == first));
}

fn descriptor(target: wgpu::TextureFormat) -> VolumePassDescriptor {
    VolumePassDescriptor {
        label: "test".into(),
        target,
        resolution: VolumeResolution::Full,
        gbuffer: GBufferFormat {
            positions: Positions::World,
            normals: Normals::Signed,
            receivers: Receivers::None,
            depth: None,
        },
        front_face: wgpu::FrontFace::Ccw,
    }
}

#[test]
fn devices_without_wide_blending_take_half_floats() {
    let Some(gpu) = gpu_with(wgpu::Features::empty()) else {
        return;
    };
    let Gpu { device, .. } = &gpu;
    let best = VolumePass::target_format(device);
    assert_eq!(best, wgpu::TextureFormat::R16Float);
    assert!(VolumePass::new(device, &descriptor(best)).is_ok());
    let wide = wgpu::TextureFormat::R32Float;
    let refused = VolumePass::new(device, &descriptor(wide)).unwrap_err();
    assert_eq!(refused, VolumePassError::Target(wide));
}

#[test]
fn devices_with_too_few_storage_buffers_are_refused() {
    let limits = wgpu::Limits {
        max_storage_buffers_per_shader_stage: 1,
        ..Default::default()
    };
    let Some(small) = gpu_with_limits(wgpu::Features::empty(), limits) else {
        return;
    };
    let target = wgpu::TextureFormat::R16Float;
    let refused = VolumePass::new(&small.device, &descriptor(target)).unwrap_err();
    assert_eq!(refused, VolumePassError::StorageBuffers(1));
    let message = refused.to_string();
    assert!(message.contains("needs 2"), "{message}");
}
