//! Upload of a picture's G-buffer to textures, and read-back of textures.

use aogrid_runtime::{AOGRID_NO_OBJECT, wgpu};
use wgpu::{TextureFormat, TextureUsages};

use super::super::{Gpu, ShadeInput};
use crate::GBuffer;
use crate::error::Result;

/// The G-buffer textures that the passes read.
pub(super) struct Views {
    pub positions: wgpu::TextureView,
    pub normals: wgpu::TextureView,
    pub receivers: wgpu::TextureView,
}

impl Views {
    /// Uploads the same points that the CPU twin shades, which are lifted off their surfaces.
    pub(super) fn new(
        input: &ShadeInput<'_>,
        gpu: &Gpu<'_>,
        gbuffer: &GBuffer,
        pixels: &[usize],
    ) -> Self {
        // Pixels without a surface get NaN, which lies in no occluder's box.
        let mut positions = vec![[f32::NAN; 4]; gbuffer.ids.len()];
        let mut normals = vec![[0.0; 4]; gbuffer.ids.len()];
        let mut receivers = vec![[AOGRID_NO_OBJECT, 0]; gbuffer.ids.len()];
        for (idx, &pixel) in pixels.iter().enumerate() {
            let receiver = &input.target.receivers[idx];
            let id = input.target.ids[idx];
            let xyz0 = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
            let [position, normal] = input.target.singles(receiver);
            positions[pixel] = xyz0(position);
            normals[pixel] = xyz0(normal);
            receivers[pixel] = [id, input.instances.layers(id)];
        }
        let view = |label, format, texels: &[u8]| {
            let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
            let texture = create_texture(gpu, label, gbuffer.size, format, usage);
            upload(gpu, &texture, texels);
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

pub(super) fn create_texture(
    gpu: &Gpu<'_>,
    label: &str,
    [width, height]: [u32; 2],
    format: TextureFormat,
    usage: TextureUsages,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
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

/// Fills a texture with rows from the top.
pub(super) fn upload(gpu: &Gpu<'_>, texture: &wgpu::Texture, texels: &[u8]) {
    let size = texture.size();
    let layout = wgpu::TexelCopyBufferLayout {
        bytes_per_row: Some(texels.len() as u32 / size.height),
        ..Default::default()
    };
    let whole = texture.as_image_copy();
    gpu.queue.write_texture(whole, texels, layout, size);
}

/// Returns a color attachment that is cleared first.
pub(super) fn cleared_attachment(
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

/// Submits the recorded commands and reads a texture of half or single floats back, row by row.
/// Missing channels are 0.
pub(super) fn read_back(
    gpu: &Gpu<'_>,
    mut encoder: wgpu::CommandEncoder,
    texture: &wgpu::Texture,
) -> Result<Vec<[f32; 4]>> {
    // Rows in a buffer are padded to wgpu's alignment; the padding is skipped below.
    let (size, format) = (texture.size(), texture.format());
    let texel = format.block_copy_size(None).unwrap_or(4);
    let row = size.width * texel;
    let stride = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
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
    gpu.queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
    let bytes = buffer.get_mapped_range(..)?;
    let rows = bytes.chunks_exact(stride as usize);
    let texels = rows.flat_map(|bytes| bytes[..row as usize].chunks_exact(texel as usize));
    let channels = usize::from(format.components());
    Ok(texels.map(|texel| floats(texel, channels)).collect())
}

/// Decodes a texel of half or single floats.
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
