use aogrid_gpu_support::{Gpu, attachment};
use aogrid_runtime::volumes::{aogrid_upsample_weight, aogrid_upsampled};
use aogrid_runtime::{
    GBufferFormat, GBufferViews, Normals, Positions, Receivers, UpsamplePass,
    UpsamplePassDescriptor, VolumePassError, VolumeResolution,
};

use crate::scene::{SIZE, orthographic, perspective};
use crate::volumes::{Cubes, PER_TRIANGLE, device, linear};

const EXTENT: f32 = 0.4;

const REDUCED: [VolumeResolution; 2] = [VolumeResolution::Half, VolumeResolution::Quarter];

/// The distance from a receiver's plane at which a neighbor no longer counts, as the pass has it.
const TOLERANCE: f32 = 0.1 * EXTENT;

fn reduced(camera: glam::Mat4, resolution: VolumeResolution) -> Cubes {
    Cubes {
        resolution,
        ..Cubes::new(camera, linear(EXTENT))
    }
}

fn descriptor(resolution: VolumeResolution) -> UpsamplePassDescriptor {
    UpsamplePassDescriptor {
        label: "test".into(),
        target: wgpu::TextureFormat::R32Float,
        resolution,
        gbuffer: GBufferFormat {
            positions: Positions::World,
            normals: Normals::Signed,
            receivers: Receivers::None,
            depth: None,
        },
    }
}

/// Returns the texel of the G-buffer that each pixel of a smaller target stands for.
fn texels(resolution: VolumeResolution) -> Vec<usize> {
    let [width, height] = resolution.target_size(SIZE);
    let divisor = resolution.divisor();
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    let texel = |[x, y]: [u32; 2]| (divisor * (y * SIZE[0] + x)) as usize;
    pixels.map(texel).collect()
}

#[test]
fn pixels_of_smaller_targets_are_those_of_their_texels() {
    let Some(gpu) = device() else { return };
    for camera in [perspective(), orthographic()] {
        for resolution in REDUCED {
            let cubes = reduced(camera, resolution);
            let (found, expected) = (cubes.draw(&gpu), cubes.twin());
            let texels = texels(resolution);
            assert_eq!(found.len(), texels.len());
            let pairs = found
                .iter()
                .zip(&texels)
                .map(|(sum, at)| (sum, expected[*at]));
            let shaded = pairs.clone().filter(|(_, sum)| *sum > 0.01).count();
            assert!(shaded > 100, "{shaded}");
            let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            println!("{resolution:?}: off by at most {worst}");
            assert!(worst <= 36.0 * PER_TRIANGLE, "{resolution:?}: {worst}");
        }
    }
}

/// Returns what the pass makes of a smaller target.
fn upsampled(gpu: &Gpu, cubes: &Cubes, sums: &[f32]) -> Vec<f32> {
    let Gpu { device, queue, .. } = gpu;
    let format = wgpu::TextureFormat::R32Float;
    let floats = wgpu::TextureFormat::Rgba32Float;
    let size = cubes.resolution.target_size(SIZE);
    let sums = gpu.upload(size, format, bytemuck::cast_slice(sums));
    let positions = gpu.upload(SIZE, floats, bytemuck::cast_slice(&cubes.buffer.positions));
    let normals = gpu.upload(SIZE, floats, bytemuck::cast_slice(&cubes.buffer.normals));
    let views = GBufferViews {
        clip_from_world: cubes.camera.to_cols_array_2d(),
        positions: &positions,
        normals: Some(&normals),
        receivers: None,
    };
    let mut pass = UpsamplePass::new(device, &descriptor(cubes.resolution)).unwrap();
    pass.prepare(device, queue, &views, &sums, EXTENT).unwrap();
    let target = gpu.target(SIZE, format);
    let view = target.create_view(&Default::default());
    let mut encoder = device.create_command_encoder(&Default::default());
    let clear = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
    let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("test"),
        color_attachments: &[attachment(&view, clear)],
        ..Default::default()
    });
    pass.draw(&mut render_pass);
    drop(render_pass);
    queue.submit([encoder.finish()]);
    bytemuck::pod_collect_to_vec(&gpu.read_texture(&target))
}

/// Returns what the twin makes of a smaller target at a texel.
fn twin(cubes: &Cubes, sums: &[f32], [x, y]: [u32; 2]) -> f32 {
    let divisor = cubes.resolution.divisor();
    let [width, height] = cubes.resolution.target_size(SIZE);
    let point = |x: u32, y: u32| {
        let at = (y * SIZE[0] + x) as usize;
        [cubes.buffer.positions[at], cubes.buffer.normals[at]].map(|[x, y, z, _]| [x, y, z])
    };
    let along = [x, y].map(|v| (v % divisor) as f32 / divisor as f32);
    let (mut values, mut shares, mut weights) = ([0.0; 4], [0.0; 4], [0.0; 4]);
    for i in 0..4_u32 {
        let step = [i & 1, i >> 1];
        let column = (x / divisor + step[0]).min(width - 1);
        let row = (y / divisor + step[1]).min(height - 1);
        let share = [0, 1].map(|axis| match step[axis] {
            1 => along[axis],
            _ => 1.0 - along[axis],
        });
        let idx = i as usize;
        values[idx] = sums[(row * width + column) as usize];
        shares[idx] = share[0] * share[1];
        let neighbor = point(divisor * column, divisor * row);
        weights[idx] = aogrid_upsample_weight(point(x, y), neighbor, TOLERANCE);
    }
    aogrid_upsampled(values, shares, weights)
}

#[test]
fn upsampling_is_that_of_the_twin_and_near_the_full_resolution() {
    /// The rounding of some twenty operations with numbers up to 1.
    const ROUNDING: f32 = 1e-5;
    /// The errors of a picture of 128 by 96 pixels, whose neighbors are far apart.
    const MAX_RMSE: [f32; 2] = [0.03, 0.06];
    let Some(gpu) = device() else { return };
    let full = Cubes::new(perspective(), linear(EXTENT)).twin();
    for (resolution, max_rmse) in REDUCED.into_iter().zip(MAX_RMSE) {
        let cubes = reduced(perspective(), resolution);
        let sums = cubes.draw(&gpu);
        let found = upsampled(&gpu, &cubes, &sums);
        for (texel, sum) in texels(resolution).into_iter().zip(&sums) {
            assert_eq!(found[texel], *sum, "{resolution:?}: {texel}");
        }
        let (mut worst, mut squares, mut seen) = (0.0_f32, 0.0, 0.0);
        for (at, value) in found.iter().enumerate() {
            let texel = [at as u32 % SIZE[0], at as u32 / SIZE[0]];
            worst = worst.max((value - twin(&cubes, &sums, texel)).abs());
            if cubes.buffer.receivers[at][0] != 0 {
                squares += (value - full[at]).powi(2);
                seen += 1.0;
            }
        }
        let rmse = (squares / seen).sqrt();
        println!("{resolution:?}: off the twin by {worst:.1e}, rmse {rmse:.4}");
        assert!(worst <= ROUNDING, "{resolution:?}: {worst}");
        assert!(rmse <= max_rmse, "{resolution:?}: {rmse}");
    }
    let bytes = wgpu::TextureFormat::Rgba8Unorm;
    let refused = UpsamplePassDescriptor {
        target: bytes,
        ..descriptor(VolumeResolution::Half)
    };
    let refused = UpsamplePass::new(&gpu.device, &refused).unwrap_err();
    assert_eq!(refused, VolumePassError::Target(bytes));
}
