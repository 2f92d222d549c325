//! Volumes on a GPU: the runtime's volume pass over the picture's G-buffer.

use aogrid_runtime::{
    AogridVolume, VolumeFrame, VolumeObject, VolumePass, VolumePassDescriptor, VolumeResolution,
    wgpu,
};
use glam::DVec3;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BufferUsages, TextureUsages};

use super::super::casters::describe;
use super::super::triangles::Triangle;
use super::super::{Gpu, ShadeInput};
use super::textures::{cleared_attachment, create_texture, read_back};
use super::{FORMAT, Picture, catch_out_of_memory, excluded};
use crate::Instance;
use crate::error::{Context, Result, ensure};

/// An instance's triangles on the GPU, in world space.
struct Uploaded<'a> {
    instance: &'a Instance,
    positions: wgpu::Buffer,
    indices: wgpu::Buffer,
    triangles: u32,
    excluded: [u32; 4],
}

/// Returns the AO of triangles for each receiver; those of an instance are consecutive.
pub(in super::super) fn volume_occlusion(
    input: &ShadeInput<'_>,
    gpu: &Gpu<'_>,
    triangles: &[Triangle<'_>],
    volume: AogridVolume,
) -> Result<Vec<f32>> {
    catch_out_of_memory(gpu, || {
        let of_instance = |a: &Triangle<'_>, b: &Triangle<'_>| a.instance.id == b.instance.id;
        let objects = triangles.chunk_by(of_instance);
        let objects = objects.map(|triangles| Uploaded::new(input, gpu, triangles));
        let objects = objects.collect::<Result<Vec<_>>>()?;
        let picture = Picture::new(input, gpu, &[])?;
        let sums = picture.volumes(&objects, volume)?;
        let pixels = picture.pixels.iter();
        Ok(pixels.map(|&pixel| sums[pixel][0].min(1.0)).collect())
    })
}

impl<'a> Uploaded<'a> {
    fn new(input: &ShadeInput<'_>, gpu: &Gpu<'_>, triangles: &[Triangle<'a>]) -> Result<Self> {
        let instance = triangles[0].instance;
        let named = || describe(input, instance);
        let origin = DVec3::from(input.target.origin);
        let corners = triangles.iter().flat_map(|triangle| triangle.corners);
        let positions: Vec<[f32; 3]> = corners
            .map(|corner| (corner - origin).as_vec3().to_array())
            .collect();
        let largest = gpu.device.limits().max_storage_buffer_binding_size;
        ensure!(
            size_of_val(&positions[..]) as u64 <= largest,
            "{}: its {} triangles are more than a buffer of the GPU holds: use --backend cpu",
            named(),
            triangles.len()
        );
        let indices: Vec<u32> = (0..positions.len() as u32).collect();
        let buffer = |contents: &[u8]| {
            gpu.device.create_buffer_init(&BufferInitDescriptor {
                label: Some(&instance.name),
                contents,
                usage: BufferUsages::STORAGE,
            })
        };
        Ok(Self {
            instance,
            positions: buffer(bytemuck::cast_slice(&positions)),
            indices: buffer(bytemuck::cast_slice(&indices)),
            triangles: triangles.len() as u32,
            excluded: excluded(&instance.excludes).with_context(named)?,
        })
    }

    fn object(&self, volume: AogridVolume) -> VolumeObject<'_> {
        VolumeObject {
            positions: &self.positions,
            stride: 3,
            indices: &self.indices,
            triangles: self.triangles,
            world_from_object: glam::Mat4::IDENTITY.to_cols_array_2d(),
            volume,
            strength: self.instance.strength,
            layers: self.instance.casts_on,
            excluded: self.excluded,
        }
    }
}

impl Picture<'_> {
    /// Returns the sum of the triangles' occlusion at each pixel, in the first channel.
    fn volumes(&self, objects: &[Uploaded<'_>], volume: AogridVolume) -> Result<Vec<[f32; 4]>> {
        let (device, queue) = (self.gpu.device, self.gpu.queue);
        let descriptor = VolumePassDescriptor {
            label: "render".into(),
            target: VolumePass::target_format(device),
            resolution: VolumeResolution::Full,
            gbuffer: FORMAT,
            front_face: wgpu::FrontFace::Ccw,
        };
        let mut pass = VolumePass::new(device, &descriptor)?;
        let objects: Vec<_> = objects.iter().map(|object| object.object(volume)).collect();
        let frame = VolumeFrame {
            gbuffer: self.gbuffer()?,
            objects: &objects,
        };
        pass.prepare(device, queue, &frame)?;
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
        let target = create_texture(self.gpu, "volumes", self.size, descriptor.target, usage);
        let view = target.create_view(&Default::default());
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("volumes"),
            color_attachments: &[Some(cleared_attachment(&view, wgpu::Color::BLACK))],
            ..Default::default()
        });
        pass.draw(&mut render_pass);
        drop(render_pass);
        read_back(self.gpu, encoder, &target)
    }
}
