//! The measured passes, prepared for one picture.

use std::time::Instant;

use aogrid_gpu_support::{Gpu, attachment, read_only_depth};
use aogrid_grid_format::TexelFormat;
use aogrid_runtime::{
    AOGRID_NO_OBJECT, AogridVolume, DepthTest, Frame, GBufferFormat, GridTexture, Instance, Mode,
    Normals, OcclusionPass, OcclusionPassDescriptor, Output, Positions, Receivers, UpsamplePass,
    UpsamplePassDescriptor, VolumeFrame, VolumeObject, VolumePass, VolumePassDescriptor,
    VolumeResolution, VolumeWeight,
};
use glam::{Mat4, Vec3};

use super::picture::Picture;
use super::{SIZE, grids};

/// The cones that are drawn over the whole picture.
const CONES: usize = 16;

const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The format of all targets.
const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// The G-buffer's textures.
pub struct Textures {
    gbuffer: [wgpu::TextureView; 2],
}

/// A pass with its target.
pub struct Prepared {
    pass: Pass,
    target: wgpu::Texture,
    depth: Option<wgpu::TextureView>,
    /// The upsampling behind it, and its target.
    upsampling: Option<(UpsamplePass, wgpu::Texture)>,
}

enum Pass {
    Volumes(VolumePass),
    Cones(OcclusionPass),
}

impl Textures {
    pub fn new(gpu: &Gpu, picture: &Picture) -> Self {
        let floats = wgpu::TextureFormat::Rgba32Float;
        let texels = [&picture.points, &picture.normals];
        Self {
            gbuffer: texels.map(|t| gpu.upload(SIZE, floats, bytemuck::cast_slice(t))),
        }
    }
}

impl Prepared {
    /// Returns the model's volumes.
    pub fn volumes(
        gpu: &Gpu,
        picture: &Picture,
        textures: &Textures,
        extent: f32,
        (resolution, is_tested): (VolumeResolution, bool),
    ) -> Self {
        let (device, queue) = (&gpu.device, &gpu.queue);
        let descriptor = VolumePassDescriptor {
            label: "bench".into(),
            target: TARGET,
            resolution,
            gbuffer: gbuffer(is_tested),
            front_face: wgpu::FrontFace::Ccw,
        };
        let mut pass = VolumePass::new(device, &descriptor).expect("its parts fit");
        let weight = VolumeWeight::Linear { exponent: 1.0 };
        let object = VolumeObject {
            positions: &gpu.storage(bytemuck::cast_slice(&picture.positions)),
            stride: 3,
            indices: &gpu.storage(bytemuck::cast_slice(&picture.triangles)),
            triangles: picture.triangles.len() as u32,
            world_from_object: Mat4::IDENTITY.to_cols_array_2d(),
            volume: AogridVolume::new(extent, weight, false).expect("it is positive"),
            strength: 1.0,
            layers: u32::MAX,
            excluded: [AOGRID_NO_OBJECT; 4],
        };
        let views = picture.frame(&textures.gbuffer);
        let frame = VolumeFrame {
            gbuffer: views,
            objects: &[object],
        };
        pass.prepare(device, queue, &frame).expect("it is whole");
        let size = resolution.target_size(SIZE);
        let target = gpu.target(size, TARGET);
        let upsampling = (resolution != VolumeResolution::Full).then(|| {
            let descriptor = UpsamplePassDescriptor {
                label: "bench".into(),
                target: TARGET,
                resolution,
                gbuffer: gbuffer(false),
            };
            let mut pass = UpsamplePass::new(device, &descriptor).expect("its parts fit");
            let reduced = target.create_view(&Default::default());
            pass.prepare(device, queue, &views, &reduced, extent)
                .expect("it is whole");
            (pass, gpu.target(SIZE, TARGET))
        });
        Self {
            pass: Pass::Volumes(pass),
            depth: is_tested.then(|| depth(gpu, picture, resolution)),
            target,
            upsampling,
        }
    }

    /// Returns cones whose boxes hold the whole picture.
    pub fn cones(gpu: &Gpu, picture: &Picture, textures: &Textures) -> Self {
        let descriptor = OcclusionPassDescriptor {
            label: "bench".into(),
            mode: Mode::Cone,
            output: Output::Transmittance,
            target: TARGET,
            gbuffer: gbuffer(false),
            front_face: wgpu::FrontFace::Ccw,
        };
        let grid = grids::faded_ball(TexelFormat::Unorm8);
        let texture = GridTexture::new(&gpu.device, &gpu.queue, &grid, "ball").expect("it fits");
        let large = Instance::at(Mat4::from_scale(Vec3::splat(2000.0)).to_cols_array_2d());
        let occluders = vec![(&texture, large); CONES];
        let (device, queue) = (&gpu.device, &gpu.queue);
        let mut pass = OcclusionPass::new(device, queue, descriptor).expect("its parts fit");
        let frame = Frame {
            gbuffer: picture.frame(&textures.gbuffer),
            occluders: &occluders,
        };
        pass.prepare(device, queue, &frame).expect("it is whole");
        Self {
            pass: Pass::Cones(pass),
            target: gpu.target(SIZE, TARGET),
            depth: None,
            upsampling: None,
        }
    }

    /// Draws and returns the milliseconds.
    pub fn time(&self, gpu: &Gpu) -> f64 {
        let start = Instant::now();
        self.draw(gpu, None);
        start.elapsed().as_secs_f64() * 1e3
    }

    /// Returns the sums at the G-buffer's size.
    pub fn sums(&self, gpu: &Gpu) -> Vec<f32> {
        self.draw(gpu, None);
        let target = match &self.upsampling {
            Some((_, target)) => target,
            None => &self.target,
        };
        bytemuck::pod_collect_to_vec(&gpu.read_texture(target))
    }

    /// Returns the fragments that the pass shades, as the device counts them, without upsampling.
    pub fn fragments(&self, gpu: &Gpu) -> u64 {
        let types = wgpu::PipelineStatisticsTypes::FRAGMENT_SHADER_INVOCATIONS;
        let set = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("fragments"),
            ty: wgpu::QueryType::PipelineStatistics(types),
            count: 1,
        });
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let buffer = gpu.buffer(usage, &[0; 8]);
        self.draw(gpu, Some((&set, &buffer)));
        let bytes = gpu.read_buffer(&buffer);
        bytes[..8].try_into().map_or(0, u64::from_le_bytes)
    }

    fn draw(&self, gpu: &Gpu, query: Option<(&wgpu::QuerySet, &wgpu::Buffer)>) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let view = self.target.create_view(&Default::default());
        let clear = match &self.pass {
            Pass::Volumes(_) => wgpu::Color::BLACK,
            Pass::Cones(pass) => pass.clear_color(),
        };
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("bench"),
            color_attachments: &[attachment(&view, wgpu::LoadOp::Clear(clear))],
            depth_stencil_attachment: self.depth.as_ref().map(read_only_depth),
            ..Default::default()
        });
        if let Some((set, _)) = query {
            render_pass.begin_pipeline_statistics_query(set, 0);
        }
        match &self.pass {
            Pass::Volumes(pass) => pass.draw(&mut render_pass),
            Pass::Cones(pass) => pass.draw(&mut render_pass),
        }
        if query.is_some() {
            render_pass.end_pipeline_statistics_query();
        }
        drop(render_pass);
        if let Some((set, buffer)) = query {
            encoder.resolve_query_set(set, 0..1, buffer, 0);
        }
        if let Some((pass, target)) = &self.upsampling {
            let view = target.create_view(&Default::default());
            let clear = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
            let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("upsampling"),
                color_attachments: &[attachment(&view, clear)],
                ..Default::default()
            });
            pass.draw(&mut render_pass);
        }
        gpu.queue.submit([encoder.finish()]);
        let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
    }
}

/// Returns the depths of the texels that a target's pixels stand for.
fn depth(gpu: &Gpu, picture: &Picture, resolution: VolumeResolution) -> wgpu::TextureView {
    let size = resolution.target_size(SIZE);
    let divisor = resolution.divisor();
    let texel = |x: u32, y: u32| picture.depths[(divisor * (y * SIZE[0] + x)) as usize];
    let rows = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| texel(x, y)));
    let depth = gpu.target_depth(size, DEPTH);
    gpu.fill_depth(&depth, &rows.collect::<Vec<_>>(), size);
    depth.create_view(&Default::default())
}

fn gbuffer(is_tested: bool) -> GBufferFormat {
    GBufferFormat {
        positions: Positions::World,
        normals: Normals::Signed,
        receivers: Receivers::None,
        depth: is_tested.then_some(DepthTest {
            format: DEPTH,
            compare: wgpu::CompareFunction::GreaterEqual,
        }),
    }
}
