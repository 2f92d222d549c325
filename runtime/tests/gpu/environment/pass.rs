use std::f32::consts::FRAC_PI_2;

use aogrid_gpu_support::{Gpu, attachment, gpu};
use aogrid_runtime::environment::*;
use aogrid_runtime::{
    AogridEnvironment, EnvironmentFrame, EnvironmentFrameError, EnvironmentPass,
    EnvironmentPassDescriptor, EnvironmentPassError, EnvironmentTexture, GBufferError,
    GBufferFormat, GBufferViews, Normals, Positions, Reflection, Up,
};
use glam::{Mat4, Vec3};

use super::harness::{ARC_TANGENT_ERROR, Harness, receivers, sky, xyz};
use crate::raster::world_and_signed;
use crate::scene::{GBuffer, SIZE, gbuffer, orthographic, perspective, reversed, surfaces};

fn descriptor(reflection: Reflection) -> EnvironmentPassDescriptor {
    EnvironmentPassDescriptor {
        label: "test".into(),
        reflection,
        target: wgpu::TextureFormat::Rgba32Float,
        blend: None,
        depth_stencil: None,
        gbuffer: world_and_signed(),
    }
}

/// The inputs of both the pass and the CPU twin.
struct Scene {
    camera: Mat4,
    eye: [f32; 4],
    buffer: GBuffer,
    combined: Vec<[f32; 4]>,
}

/// The position of the cameras of `scene.rs`.
const EYE: Vec3 = Vec3::new(3.0, 2.5, 4.0);

const LOBE_HALF_ANGLE: f32 = 0.4;

impl Scene {
    fn new(camera: Mat4) -> Self {
        let mut surfaces = surfaces();
        // An infinite floor and wall fill the image: every pixel shows a surface.
        surfaces[1].shape = crate::scene::Shape::Plane {
            point: Vec3::new(0.0, 0.0, -2.5),
            normal: Vec3::Z,
        };
        let buffer = gbuffer(camera, &surfaces);
        let combined = |(idx, n): (usize, &[f32; 4])| {
            let [_, combined, ..] = receivers()[idx % 512];
            let sum = Vec3::from(xyz(combined));
            let n = Vec3::from(xyz(*n));
            let above = (sum + 0.6 * sum.length() * n).normalize_or_zero() * sum.length();
            // Mirror the axis to the side of the normal.
            let above = if above.dot(n) < 0.0 {
                above - 2.0 * above.dot(n) * n
            } else {
                above
            };
            above.extend(combined[3]).to_array()
        };
        let combined = buffer.normals.iter().enumerate().map(combined).collect();
        let eye = match camera == orthographic() {
            true => EYE.extend(0.0),
            false => EYE.extend(1.0),
        };
        Self {
            camera,
            eye: eye.to_array(),
            buffer,
            combined,
        }
    }

    fn draw(&self, harness: &Harness<'_>, descriptor: EnvironmentPassDescriptor) -> Vec<[f32; 4]> {
        let Gpu { device, queue, .. } = harness.gpu;
        let target = harness.gpu.target(SIZE, descriptor.target);
        let mut pass = EnvironmentPass::new(device, descriptor.clone()).unwrap();
        let floats = |texels: &[[f32; 4]]| {
            let format = wgpu::TextureFormat::Rgba32Float;
            harness
                .gpu
                .upload(SIZE, format, bytemuck::cast_slice(texels))
        };
        let positions = match descriptor.gbuffer.positions {
            Positions::World => floats(&self.buffer.positions),
            Positions::Depth => harness.gpu.upload(
                SIZE,
                wgpu::TextureFormat::R32Float,
                bytemuck::cast_slice(&self.buffer.depths),
            ),
        };
        let normals = self
            .buffer
            .normals
            .iter()
            .map(|n| match descriptor.gbuffer.normals {
                Normals::Signed => *n,
                // The format of normals without signed texels.
                Normals::Unsigned => n.map(|x| 0.5 * x + 0.5),
            });
        let normals = floats(&normals.collect::<Vec<_>>());
        let occlusion = floats(&self.combined);
        let map = EnvironmentTexture::new(device, queue, &harness.map, "sky");
        let frame = EnvironmentFrame {
            gbuffer: GBufferViews {
                clip_from_world: self.camera.to_cols_array_2d(),
                positions: &positions,
                normals: Some(&normals),
                receivers: None,
            },
            eye: self.eye,
            lobe_half_angle: LOBE_HALF_ANGLE,
            environment: harness.environment,
            map: &map,
            occlusion: &occlusion,
        };
        pass.prepare(device, queue, &frame).unwrap();
        let view = target.create_view(&Default::default());
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("test"),
            color_attachments: &[attachment(&view, wgpu::LoadOp::Clear(wgpu::Color::BLACK))],
            ..Default::default()
        });
        pass.draw(&mut render_pass);
        drop(render_pass);
        queue.submit([encoder.finish()]);
        bytemuck::pod_collect_to_vec(&harness.gpu.read_texture(&target))
    }

    fn twin_pixel(&self, harness: &Harness<'_>, reflection: Reflection, pixel: usize) -> [f32; 3] {
        let (n, combined) = (xyz(self.buffer.normals[pixel]), self.combined[pixel]);
        match reflection {
            Reflection::Lambertian => {
                aogrid_lambertian(&harness.environment, &harness.map, combined, n)
            }
            Reflection::Glossy => {
                let p = xyz(self.buffer.positions[pixel]);
                let mirrored = aogrid_mirrored(self.eye, p, n);
                let lobe = 0.5 * (1.0 - LOBE_HALF_ANGLE.cos());
                aogrid_glossy(
                    &harness.environment,
                    &harness.map,
                    combined,
                    n,
                    mirrored,
                    lobe,
                )
            }
        }
    }

    /// Returns the largest difference between the pass's pixels and the CPU twin's.
    fn max_difference(&self, harness: &Harness<'_>, descriptor: EnvironmentPassDescriptor) -> f32 {
        let found = self.draw(harness, descriptor.clone());
        let (mut worst, mut lit, mut seen) = (0.0_f32, 0, 0);
        for (pixel, found) in found.iter().enumerate() {
            if self.buffer.receivers[pixel] == [0, 0] {
                continue;
            }
            let expected = self.twin_pixel(harness, descriptor.reflection, pixel);
            for c in 0..3 {
                let difference = (found[c] - expected[c]).abs();
                assert!(!difference.is_nan(), "{pixel}: {found:?}");
                worst = worst.max(difference);
            }
            assert_eq!(found[3], 1.0);
            seen += 1;
            lit += u32::from(expected[0] > 0.1);
        }
        println!("off by at most {worst}, {lit} of {seen} pixels are lit");
        assert!(
            lit > 5000 && seen > lit,
            "only {lit} of {seen} pixels are lit"
        );
        worst
    }
}

#[test]
fn images_of_the_pass_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu);
    // The tolerance is that of the single functions; positions are a few units large.
    let tolerance = 2.0 * (harness.filter_error() + 1.5 * 20.0 / 0.17 * ARC_TANGENT_ERROR / 100.0);
    for camera in [perspective(), reversed(), orthographic()] {
        let scene = Scene::new(camera);
        for reflection in [Reflection::Lambertian, Reflection::Glossy] {
            let worst = scene.max_difference(&harness, descriptor(reflection));
            assert!(worst <= tolerance, "{reflection:?}: {worst}");
        }
        let from_depth = EnvironmentPassDescriptor {
            gbuffer: GBufferFormat {
                positions: Positions::Depth,
                normals: Normals::Unsigned,
                ..world_and_signed()
            },
            ..descriptor(Reflection::Glossy)
        };
        // A depth step is 2e-5 of a unit here, negligible for a viewer four units away.
        let worst = scene.max_difference(&harness, from_depth);
        assert!(worst <= 2.0 * tolerance, "{worst}");
    }
}

#[test]
fn unsuitable_descriptors_are_rejected() {
    let Some(gpu) = gpu() else { return };
    for (target, blend) in [
        (wgpu::TextureFormat::R32Uint, None),
        (wgpu::TextureFormat::Rgba8Snorm, None),
        (
            wgpu::TextureFormat::Rgba16Sint,
            Some(wgpu::BlendState::ALPHA_BLENDING),
        ),
    ] {
        let descriptor = EnvironmentPassDescriptor {
            target,
            blend,
            ..descriptor(Reflection::Lambertian)
        };
        let refusal = EnvironmentPass::new(&gpu.device, descriptor).unwrap_err();
        assert!(matches!(refusal, EnvironmentPassError::Target { .. }));
    }
}

#[test]
fn unsuitable_frames_are_rejected() {
    let Some(gpu) = gpu() else { return };
    let Gpu { device, queue, .. } = &gpu;
    let view = gpu.upload(SIZE, wgpu::TextureFormat::Rgba32Float, &[0; 128 * 96 * 16]);
    let map = EnvironmentTexture::new(device, queue, &sky(), "sky");
    let frame = EnvironmentFrame {
        gbuffer: GBufferViews {
            clip_from_world: [[0.0; 4]; 4],
            positions: &view,
            normals: Some(&view),
            receivers: None,
        },
        eye: [0.0, 1.0, 0.0, 1.0],
        lobe_half_angle: 0.3,
        environment: AogridEnvironment::new(Up::Y, 0.0),
        map: &map,
        occlusion: &view,
    };
    // Diffuse reflection needs no camera.
    let mut diffuse = EnvironmentPass::new(device, descriptor(Reflection::Lambertian)).unwrap();
    diffuse.prepare(device, queue, &frame).unwrap();
    let from_depth = EnvironmentPassDescriptor {
        gbuffer: GBufferFormat {
            positions: Positions::Depth,
            ..world_and_signed()
        },
        ..descriptor(Reflection::Glossy)
    };
    let mut pass = EnvironmentPass::new(device, from_depth).unwrap();
    let mut prepare = |frame| pass.prepare(device, queue, &frame).unwrap_err();
    assert_eq!(prepare(frame), GBufferError::Camera.into());
    let no_normals = EnvironmentFrame {
        gbuffer: GBufferViews {
            normals: None,
            ..frame.gbuffer
        },
        ..frame
    };
    let missing = GBufferError::Missing("normals");
    assert_eq!(prepare(no_normals), missing.into());
    for lobe_half_angle in [0.0, -1.0, FRAC_PI_2 + 1e-3, f32::NAN] {
        let refusal = prepare(EnvironmentFrame {
            lobe_half_angle,
            ..frame
        });
        assert!(matches!(refusal, EnvironmentFrameError::Lobe(_)));
    }
}
