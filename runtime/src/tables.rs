//! T_clip on the GPU.

use aogrid_tables::{ClipTable, Format};

/// T_clip as transmittance, 1 − AO: one channel, 8 KiB. For a shader of your own; the passes
/// make theirs.
pub fn transmittance_table(device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::TextureView {
    let texels = aogrid_tables::transmittance_texels(Format::F16);
    upload(device, queue, wgpu::TextureFormat::R16Float, &texels)
}

/// The whole T_clip: AO, a′, f, 1 in 32 KiB.
pub fn clip_table(device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::TextureView {
    let texels = aogrid_tables::clip_texels(Format::F16);
    upload(device, queue, wgpu::TextureFormat::Rgba16Float, texels)
}

/// The sampler that grids and tables ask for: linear, clamped.
pub fn linear_clamp_sampler(device: &wgpu::Device) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("aogrid linear clamp"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    })
}

fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    format: wgpu::TextureFormat,
    texels: &[u8],
) -> wgpu::TextureView {
    let [width, height] = ClipTable::SIZE.map(|n| n as u32);
    let size = wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: 1,
    };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("aogrid T_clip"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(texels.len() as u32 / height),
        rows_per_image: None,
    };
    queue.write_texture(texture.as_image_copy(), texels, layout, size);
    texture.create_view(&wgpu::TextureViewDescriptor {
        label: Some("aogrid T_clip"),
        ..Default::default()
    })
}
