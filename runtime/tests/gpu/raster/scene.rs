use aogrid_gpu_support::{Gpu, attachment, read_only_depth};
use aogrid_grid_format::{Grid, TexelFormat};
use aogrid_runtime::shading::*;
use aogrid_runtime::{
    AogridOccluder, CpuTexture, Frame, GBufferFormat, GBufferViews, GridTexture, Instance, Mode,
    Normals, OcclusionPass, OcclusionPassDescriptor, Output, Positions, Receivers,
};
use glam::Mat4;

use crate::grids::faded_ball;
use crate::scene::{GBuffer, SIZE, gbuffer, surfaces, transforms};

/// Returns the G-buffer format that the tests vary.
pub fn world_and_signed() -> GBufferFormat {
    GBufferFormat {
        positions: Positions::World,
        normals: Normals::Signed,
        receivers: Receivers::None,
        depth: None,
    }
}

/// Returns the descriptor that the tests of this module vary.
pub fn descriptor() -> OcclusionPassDescriptor {
    OcclusionPassDescriptor {
        label: "test".into(),
        mode: Mode::Cone,
        output: Output::Transmittance,
        target: wgpu::TextureFormat::R32Float,
        gbuffer: world_and_signed(),
        front_face: wgpu::FrontFace::Ccw,
    }
}

/// The inputs of both the pass and the CPU twin.
pub struct Scene {
    pub(super) camera: Mat4,
    pub(super) buffer: GBuffer,
    pub(super) grid: Grid,
    pub instances: Vec<Instance>,
}

impl Scene {
    pub fn new(camera: Mat4, grid: Grid) -> Self {
        Self {
            camera,
            buffer: gbuffer(camera, &surfaces()),
            grid,
            instances: transforms()
                .map(|transform| Instance::at(transform.to_cols_array_2d()))
                .to_vec(),
        }
    }

    /// Returns the texels of the target after the pass.
    pub(super) fn texels(&self, gpu: &Gpu, descriptor: OcclusionPassDescriptor) -> Vec<u8> {
        let grid = GridTexture::new(&gpu.device, &gpu.queue, &self.grid, "ball").unwrap();
        let occluders: Vec<_> = self.instances.iter().map(|i| (&grid, *i)).collect();
        self.draw(gpu, descriptor, &occluders)
    }

    /// Returns the texels of the target after the pass has drawn these occluders.
    pub(super) fn draw(
        &self,
        gpu: &Gpu,
        descriptor: OcclusionPassDescriptor,
        occluders: &[(&GridTexture, Instance)],
    ) -> Vec<u8> {
        let Gpu { device, queue, .. } = gpu;
        let target = gpu.target(SIZE, descriptor.target);
        let depth = descriptor.gbuffer.depth.map(|_| self.depth(gpu));
        let mut pass = OcclusionPass::new(device, queue, descriptor.clone()).unwrap();
        let floats = wgpu::TextureFormat::Rgba32Float;
        let positions = match descriptor.gbuffer.positions {
            Positions::World => {
                gpu.upload(SIZE, floats, bytemuck::cast_slice(&self.buffer.positions))
            }
            Positions::Depth => gpu.upload(
                SIZE,
                wgpu::TextureFormat::R32Float,
                bytemuck::cast_slice(&self.buffer.depths),
            ),
        };
        let normals = gpu.upload(SIZE, floats, bytemuck::cast_slice(&self.buffer.normals));
        let receivers = gpu.upload(
            SIZE,
            wgpu::TextureFormat::Rg32Uint,
            bytemuck::cast_slice(&self.buffer.receivers),
        );
        let frame = Frame {
            gbuffer: GBufferViews {
                clip_from_world: self.camera.to_cols_array_2d(),
                positions: &positions,
                normals: Some(&normals),
                receivers: Some(&receivers),
            },
            occluders,
        };
        pass.prepare(device, queue, &frame).unwrap();
        let view = target.create_view(&Default::default());
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("test"),
            color_attachments: &[attachment(&view, wgpu::LoadOp::Clear(pass.clear_color()))],
            depth_stencil_attachment: depth.as_ref().map(read_only_depth),
            ..Default::default()
        });
        pass.draw(&mut render_pass);
        drop(render_pass);
        queue.submit([encoder.finish()]);
        gpu.read_texture(&target)
    }

    pub fn transmittances(&self, gpu: &Gpu, descriptor: OcclusionPassDescriptor) -> Vec<f32> {
        bytemuck::pod_collect_to_vec(&self.texels(gpu, descriptor))
    }

    /// Returns the depths in a depth texture. They are drawn, since copies may not write one.
    fn depth(&self, gpu: &Gpu) -> wgpu::TextureView {
        let target = gpu.target_depth(SIZE, wgpu::TextureFormat::Depth32Float);
        let depths: Vec<f32> = self
            .buffer
            .depths
            .iter()
            .map(|d| if d.is_nan() { 0.5 } else { *d })
            .collect();
        gpu.fill_depth(&target, &depths, SIZE);
        target.create_view(&Default::default())
    }

    /// Returns the CPU twin's image: for each pixel's position, normal and ids the product of its
    /// occluders' transmittances.
    pub fn twin_image(&self, mode: Mode) -> Vec<f32> {
        let table = CpuTexture::transmittance_table();
        let texture = CpuTexture::of_grid(&self.grid);
        let occluders = self.instances.iter();
        let occluders: Vec<_> = occluders
            .map(|i| AogridOccluder::new(&self.grid, i).unwrap())
            .collect();
        let pixels = 0..self.buffer.positions.len();
        pixels
            .map(|pixel| {
                let receiver = self.buffer.receivers[pixel];
                occluders
                    .iter()
                    .filter(|o| aogrid_shades(o, receiver[0], receiver[1]))
                    .map(|o| {
                        let [x, y, z, _] = self.buffer.positions[pixel];
                        let [nx, ny, nz, _] = self.buffer.normals[pixel];
                        let (p, n) = ([x, y, z], [nx, ny, nz]);
                        match mode {
                            Mode::Cone => aogrid_cone(o, &texture, &table, p, n),
                            Mode::Occlusion => {
                                let itself = receiver[0] == o.object_id;
                                aogrid_occlusion_of_cone(o, &texture, p, itself)
                            }
                        }
                    })
                    .product()
            })
            .collect()
    }
}

/// Returns the largest difference. Asserts that enough pixels are in shadow.
pub fn max_difference(found: &[f32], expected: &[f32]) -> f32 {
    assert_eq!(found.len(), expected.len());
    let shaded = expected.iter().filter(|t| **t < 0.9).count();
    assert!(shaded > 200, "only {shaded} pixels are in shadow");
    let differences = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
    let worst = differences.fold(0.0_f32, |worst, d| {
        assert!(!d.is_nan());
        worst.max(d)
    });
    println!("off by at most {worst}, {shaded} pixels in shadow");
    worst
}

pub fn faded() -> Grid {
    faded_ball(TexelFormat::F16)
}
