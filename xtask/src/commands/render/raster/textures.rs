//! A picture's G-buffer as textures, and textures back as numbers.

use aogrid_baker_gpu::Context;
use aogrid_runtime::{AOGRID_NO_OBJECT, wgpu};
use wgpu::{TextureFormat, TextureUsages};

use super::super::Job;
use super::super::casters::layers;
use crate::scene::GBuffer;

/// What the passes read of a picture.
pub(super) struct Views {
    pub positions: wgpu::TextureView,
    pub normals: wgpu::TextureView,
    pub receivers: wgpu::TextureView,
}

impl Views {
    /// What the twin reads, too: receivers are where rays would start.
    pub(super) fn new(job: &Job<'_>, gpu: &Context, gbuffer: &GBuffer, pixels: &[usize]) -> Self {
        let layers = layers(job);
        // NaN is in no box.
        let mut positions = vec![[f32::NAN; 4]; gbuffer.ids.len()];
        let mut normals = vec![[0.0; 4]; gbuffer.ids.len()];
        let mut receivers = vec![[AOGRID_NO_OBJECT, 0]; gbuffer.ids.len()];
        for (idx, &pixel) in pixels.iter().enumerate() {
            let receiver = &job.target.receivers[idx];
            let id = job.target.ids[idx];
            let xyz0 = |[x, y, z]: [f64; 3]| [x as f32, y as f32, z as f32, 0.0];
            positions[pixel] = xyz0(receiver.position);
            normals[pixel] = xyz0(receiver.normal);
            receivers[pixel] = [id, layers(id)];
        }
        let view = |label, format, texels: &[u8]| {
            let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
            let texture = texture(gpu, label, gbuffer.size, format, usage);
            write(gpu, &texture, texels);
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let floats = TextureFormat::Rgba32Float;
        Self {
            positions: view("positions", floats, bytemuck::cast_slice(&positions)),
            normals: view("normals", floats, bytemuck::cast_slice(&normals)),
            receivers: view(
                "receivers",
                TextureFormat::Rg32Uint,
                bytemuck::cast_slice(&receivers),
            ),
        }
    }
}

pub(super) fn texture(
    gpu: &Context,
    label: &str,
    [width, height]: [u32; 2],
    format: TextureFormat,
    usage: TextureUsages,
) -> wgpu::Texture {
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// Fills a texture, row by row from the top.
pub(super) fn write(gpu: &Context, texture: &wgpu::Texture, texels: &[u8]) {
    let size = texture.size();
    let layout = wgpu::TexelCopyBufferLayout {
        bytes_per_row: Some(texels.len() as u32 / size.height),
        ..Default::default()
    };
    let whole = texture.as_image_copy();
    gpu.queue().write_texture(whole, texels, layout, size);
}

/// A target that is cleared first.
pub(super) fn attachment(
    view: &wgpu::TextureView,
    clear: wgpu::Color,
) -> wgpu::RenderPassColorAttachment<'_> {
    wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load: wgpu::LoadOp::Clear(clear),
            store: wgpu::StoreOp::Store,
        },
    }
}

/// Submits what was recorded and copies a texture of half or single floats out, row by row;
/// channels that it has not are 0.
pub(super) fn texels(
    gpu: &Context,
    mut encoder: wgpu::CommandEncoder,
    texture: &wgpu::Texture,
) -> anyhow::Result<Vec<[f32; 4]>> {
    let (size, format) = (texture.size(), texture.format());
    let texel = format.block_copy_size(None).unwrap_or(4);
    let row = size.width * texel;
    let stride = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: u64::from(stride) * u64::from(size.height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let info = wgpu::TexelCopyBufferInfo {
        buffer: &buffer,
        layout: wgpu::TexelCopyBufferLayout {
            bytes_per_row: Some(stride),
            ..Default::default()
        },
    };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), info, size);
    gpu.queue().submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.device().poll(wgpu::PollType::wait_indefinitely())?;
    let bytes = buffer.get_mapped_range(..)?;
    let rows = bytes.chunks_exact(stride as usize);
    let texels = rows.flat_map(|bytes| bytes[..row as usize].chunks_exact(texel as usize));
    let channels = usize::from(format.components());
    Ok(texels.map(|texel| floats(texel, channels)).collect())
}

fn floats(texel: &[u8], channels: usize) -> [f32; 4] {
    let mut found = [0.0; 4];
    let channel = texel.chunks_exact(texel.len() / channels);
    for (value, bytes) in found.iter_mut().zip(channel) {
        *value = match *bytes {
            [a, b] => half::f16::from_le_bytes([a, b]).to_f32(),
            [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
            _ => unreachable!("channels of 16 or 32 bits"),
        };
    }
    found
}
