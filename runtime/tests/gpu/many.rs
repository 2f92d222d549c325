use aogrid_gpu_support::Gpu;
use aogrid_grid_format::{Encoding, Grid, TexelFormat};
use aogrid_runtime::shading::*;
use aogrid_runtime::{
    AogridOccluder, Combine, CpuTexture, DepthTest, Frame, GBufferFormat, GBufferViews, GridAtlas,
    GridTexture, Instance, MergePass, MergePassDescriptor, Mode, Output, Positions, TiledFrame,
    TiledPass, TiledPassDescriptor,
};
use glam::Mat4;

use crate::grids::{ball_in, faded_ball_in, flattened, other_spec, spec};
use crate::raster::world_and_signed;
use crate::scene::{GBuffer, gbuffer_of, surfaces, transforms};

/// A scene of occluders with several grids, over a G-buffer.
pub struct ManyOccluders {
    pub size: [u32; 2],
    pub camera: Mat4,
    pub buffer: GBuffer,
    pub grids: Vec<Grid>,
    /// The index of each occluder's grid, and its instance.
    pub occluders: Vec<(usize, Instance)>,
}

/// The G-buffer on the device.
pub struct Views {
    pub positions: wgpu::TextureView,
    pub depths: wgpu::TextureView,
    pub normals: wgpu::TextureView,
    pub receivers: wgpu::TextureView,
}

pub fn merge_descriptor() -> MergePassDescriptor {
    MergePassDescriptor {
        label: "test".into(),
        format: wgpu::TextureFormat::Rgba32Float,
        mean: false,
        gbuffer: world_and_signed(),
        front_face: wgpu::FrontFace::Ccw,
    }
}

pub fn tiled_descriptor() -> TiledPassDescriptor {
    TiledPassDescriptor {
        label: "test".into(),
        mode: Mode::Cone,
        combine: Combine::Merge,
        output: Output::TransmittanceAndAxis,
        target: wgpu::TextureFormat::Rgba32Float,
        gbuffer: world_and_signed(),
    }
}

impl ManyOccluders {
    /// Returns three balls with two grids.
    pub fn new(size: [u32; 2], camera: Mat4) -> Self {
        let format = TexelFormat::F16;
        Self {
            size,
            camera,
            buffer: gbuffer_of(size, camera, &surfaces()),
            grids: [spec(), other_spec()]
                .map(|spec| faded_ball_in(spec, format))
                .to_vec(),
            occluders: (0..)
                .zip(transforms())
                .map(|(i, transform)| (i % 2, Instance::at(transform.to_cols_array_2d())))
                .collect(),
        }
    }

    /// Returns three balls of moments with far fields that end within the picture, each with the id
    /// of its own: the first is the ball in the picture, the second goes for the floor.
    pub fn with_far_fields(size: [u32; 2], camera: Mat4) -> Self {
        let mut many = Self::new(size, camera);
        many.grids = [spec(), other_spec()]
            .map(|spec| flattened(&ball_in(spec, Encoding::Moment, TexelFormat::F16)))
            .to_vec();
        for ((_, instance), object_id) in many.occluders.iter_mut().zip([3, 1, 18]) {
            instance.object_id = object_id;
            instance.far_field = Some(0.05);
        }
        many
    }

    pub fn views(&self, gpu: &Gpu) -> Views {
        use wgpu::TextureFormat::{R32Float, Rg32Uint, Rgba32Float};
        let buffer = &self.buffer;
        let texture = |format, texels| gpu.upload(self.size, format, texels);
        Views {
            positions: texture(Rgba32Float, bytemuck::cast_slice(&buffer.positions)),
            depths: texture(R32Float, bytemuck::cast_slice(&buffer.depths)),
            normals: texture(Rgba32Float, bytemuck::cast_slice(&buffer.normals)),
            receivers: texture(Rg32Uint, bytemuck::cast_slice(&buffer.receivers)),
        }
    }

    /// Returns the result of the raster pass: bytes of the descriptor's format.
    pub fn merge(&self, gpu: &Gpu, descriptor: &MergePassDescriptor) -> Vec<u8> {
        let Gpu { device, queue, .. } = gpu;
        let views = self.views(gpu);
        let grids = self.grids.iter();
        let grids: Vec<_> = grids
            .map(|grid| GridTexture::new(device, queue, grid, "ball").unwrap())
            .collect();
        let occluders = self.occluders.iter();
        let occluders: Vec<_> = occluders.map(|(grid, i)| (&grids[*grid], *i)).collect();
        let mut pass = MergePass::new(device, queue, descriptor.clone()).unwrap();
        let frame = Frame {
            gbuffer: views.gbuffer(self.camera, &descriptor.gbuffer),
            occluders: &occluders,
        };
        pass.prepare(device, queue, &frame).unwrap();
        let depth = descriptor.gbuffer.depth.map(|test| self.depth(gpu, test));
        let mut encoder = device.create_command_encoder(&Default::default());
        pass.record(&mut encoder, depth.as_ref());
        queue.submit([encoder.finish()]);
        gpu.read_texture(pass.result().unwrap().texture())
    }

    fn depth(&self, gpu: &Gpu, test: DepthTest) -> wgpu::TextureView {
        let target = gpu.target_depth(self.size, test.format);
        let depths = self.buffer.depths.iter();
        let depths: Vec<f32> = depths.map(|d| if d.is_nan() { 0.5 } else { *d }).collect();
        gpu.fill_depth(&target, &depths, self.size);
        target.create_view(&Default::default())
    }

    /// Returns the result of a new tiled pass: bytes of the descriptor's target.
    pub fn tiled(&self, gpu: &Gpu, descriptor: &TiledPassDescriptor) -> Vec<u8> {
        let mut pass = TiledPass::new(&gpu.device, &gpu.queue, descriptor.clone()).unwrap();
        self.dispatch(gpu, descriptor, &mut pass)
    }

    /// Returns the result of an existing tiled pass.
    pub fn dispatch(
        &self,
        gpu: &Gpu,
        descriptor: &TiledPassDescriptor,
        pass: &mut TiledPass,
    ) -> Vec<u8> {
        let Gpu { device, queue, .. } = gpu;
        let views = self.views(gpu);
        let target = gpu.storage_target(self.size, descriptor.target);
        let grids: Vec<_> = self.grids.iter().collect();
        let atlas = GridAtlas::new(device, queue, &grids, "balls").unwrap();
        let frame = TiledFrame {
            gbuffer: views.gbuffer(self.camera, &descriptor.gbuffer),
            atlas: &atlas,
            occluders: &self.occluders,
            target: &target.create_view(&Default::default()),
        };
        pass.prepare(device, queue, &frame).unwrap();
        let mut encoder = device.create_command_encoder(&Default::default());
        pass.dispatch(&mut encoder.begin_compute_pass(&Default::default()));
        queue.submit([encoder.finish()]);
        gpu.read_texture(&target)
    }

    /// Returns the CPU twin's image, every occluder for every pixel.
    pub fn twin_image(&self, combine: Combine) -> Vec<[f32; 4]> {
        let twin = self.cpu_twin();
        let pixels = 0..self.buffer.positions.len();
        pixels
            .map(|pixel| {
                let [x, y, z, _] = self.buffer.positions[pixel];
                let [nx, ny, nz, _] = self.buffer.normals[pixel];
                let object = self.buffer.receivers[pixel];
                twin.shade([x, y, z], [nx, ny, nz], object, combine)
            })
            .collect()
    }

    /// Returns the CPU twin of the passes.
    pub fn cpu_twin(&self) -> CpuTwin {
        let occluder = |(grid, instance): &(usize, Instance)| {
            let baked = &self.grids[*grid];
            (*grid, AogridOccluder::new(baked, instance).unwrap())
        };
        CpuTwin {
            occluders: self.occluders.iter().map(occluder).collect(),
            textures: self.grids.iter().map(CpuTexture::of_grid).collect(),
            clip: CpuTexture::clip_table(),
            overlaps: CpuTexture::intersection_table(),
        }
    }
}

impl Views {
    /// Returns the views of a frame in a format.
    pub fn gbuffer(&self, camera: Mat4, format: &GBufferFormat) -> GBufferViews<'_> {
        GBufferViews {
            clip_from_world: camera.to_cols_array_2d(),
            positions: match format.positions {
                Positions::World => &self.positions,
                Positions::Depth => &self.depths,
            },
            normals: Some(&self.normals),
            receivers: Some(&self.receivers),
        }
    }
}

/// The CPU twin of the passes: occluders, textures and tables.
pub struct CpuTwin {
    occluders: Vec<(usize, AogridOccluder)>,
    textures: Vec<CpuTexture>,
    clip: CpuTexture,
    overlaps: CpuTexture,
}

impl CpuTwin {
    /// Returns the combined axis and transmittance at a receiver.
    pub fn shade(&self, p: [f32; 3], n: [f32; 3], object: [u32; 2], combine: Combine) -> [f32; 4] {
        let shading = self.occluders.iter().filter(|(_, o)| {
            aogrid_lookup(o, p).is_reached && aogrid_shades(o, object[0], object[1])
        });
        shading.fold([0.0, 0.0, 0.0, 1.0], |before, (grid, o)| {
            let lookup = match aogrid_is_on_itself(o, object[0]) {
                true => aogrid_lookup_on_itself(o, p, n),
                false => aogrid_lookup(o, p),
            };
            let one = aogrid_cone_with_axis_at(o, &self.textures[*grid], &self.clip, lookup, n);
            match combine {
                Combine::Merge => aogrid_merge(before, one, &self.overlaps),
                Combine::Mean => aogrid_mean(before, one, &self.overlaps),
                Combine::Multiply => aogrid_multiply(before, one),
            }
        })
    }
}

/// Returns four floats per pixel.
pub fn vectors(bytes: &[u8]) -> Vec<[f32; 4]> {
    bytemuck::pod_collect_to_vec(bytes)
}

/// Returns four floats per pixel of half floats.
pub fn halves(bytes: &[u8]) -> Vec<[f32; 4]> {
    let half = |bytes: &[u8]| half::f16::from_le_bytes([bytes[0], bytes[1]]).to_f32();
    let texels = bytes.chunks_exact(8);
    texels
        .map(|texel| std::array::from_fn(|c| half(&texel[2 * c..])))
        .collect()
}

/// Returns the largest difference of any component. Asserts that enough pixels are in shadow.
pub fn max_difference(found: &[[f32; 4]], expected: &[[f32; 4]]) -> f32 {
    assert_eq!(found.len(), expected.len());
    let shaded = expected.iter().filter(|v| v[3] < 0.9).count();
    assert!(shaded > 100, "only {shaded} pixels are in shadow");
    let pairs = found.as_flattened().iter().zip(expected.as_flattened());
    let worst = pairs.fold(0.0_f32, |worst, (a, b)| {
        assert!(!(a - b).is_nan());
        worst.max((a - b).abs())
    });
    println!("off by at most {worst}, {shaded} pixels in shadow");
    worst
}
