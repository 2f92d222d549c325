//! T_clip and T_merge on the GPU.

use aogrid_tables::{ClipTable, Format, MergeTable};

/// Uploads T_clip as transmittance, 1 − AO: one channel, 8 KiB. For your own shaders; the passes
/// upload theirs.
pub fn transmittance_table(device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::TextureView {
    let texels = aogrid_tables::transmittance_texels(Format::F16);
    let format = wgpu::TextureFormat::R16Float;
    upload(device, queue, "aogrid T_clip", clip_size(), format, &texels)
}

/// Uploads T_clip with all channels: AO, a′, f, 1 in 32 KiB.
pub fn clip_table(device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::TextureView {
    let texels = aogrid_tables::clip_texels(Format::F16);
    let format = wgpu::TextureFormat::Rgba16Float;
    upload(device, queue, "aogrid T_clip", clip_size(), format, texels)
}

/// Uploads the overlap table of T_merge: the fraction that two cones share, in one channel of a 3D
/// texture, 144 KiB.
pub fn intersection_table(device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::TextureView {
    let texels = aogrid_tables::intersection_texels(Format::F16);
    let format = wgpu::TextureFormat::R16Float;
    let size = MergeTable::SIZE.map(|n| n as u32);
    upload(device, queue, "aogrid T_merge", size, format, &texels)
}

/// Creates the sampler for grids and tables: linear, clamped.
pub fn linear_clamp_sampler(device: &wgpu::Device) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("aogrid linear clamp"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    })
}

fn clip_size() -> [u32; 3] {
    let [width, height] = ClipTable::SIZE.map(|n| n as u32);
    [width, height, 1]
}

/// Uploads a table; one of depth 1 becomes a 2D texture.
fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    label: &str,
    [width, height, depth]: [u32; 3],
    format: wgpu::TextureFormat,
    texels: &[u8],
) -> wgpu::TextureView {
    let size = wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: depth,
    };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: match depth {
            1 => wgpu::TextureDimension::D2,
            _ => wgpu::TextureDimension::D3,
        },
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(texels.len() as u32 / (height * depth)),
        rows_per_image: Some(height),
    };
    queue.write_texture(texture.as_image_copy(), texels, layout, size);
    texture.create_view(&wgpu::TextureViewDescriptor {
        label: Some(label),
        ..Default::default()
    })
}
