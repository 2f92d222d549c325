//! A prefiltered environment on the GPU.

use crate::EnvironmentMap;

/// The texture of an [`EnvironmentMap`], 1.4 MiB, and its sampler. Clones share them.
#[derive(Clone, Debug)]
pub struct EnvironmentTexture {
    view: wgpu::TextureView,
    sampler: wgpu::Sampler,
}

impl EnvironmentTexture {
    /// Uploads a map. The writes take effect with the queue's next submission. `label` names the
    /// texture in graphics debuggers. Every device can hold and filter it.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        map: &EnvironmentMap,
        label: &str,
    ) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: extent(0),
            mip_level_count: EnvironmentMap::LEVELS as u32,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        for level in 0..EnvironmentMap::LEVELS {
            write(queue, &texture, map, level);
        }
        Self {
            view: texture.create_view(&wgpu::TextureViewDescriptor {
                label: Some(label),
                ..Default::default()
            }),
            sampler: sampler(device),
        }
    }

    /// A view of all levels, for your own shaders.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// The sampler: linear, repeating horizontally, clamped vertically.
    pub fn sampler(&self) -> &wgpu::Sampler {
        &self.sampler
    }
}

fn extent(level: usize) -> wgpu::Extent3d {
    let [width, height] = EnvironmentMap::level_size(level).map(|n| n as u32);
    wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: 1,
    }
}

fn write(queue: &wgpu::Queue, texture: &wgpu::Texture, map: &EnvironmentMap, level: usize) {
    let size = extent(level);
    let texels = map.texels(level);
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(texels.len() as u32 / size.height),
        rows_per_image: None,
    };
    let destination = wgpu::TexelCopyTextureInfo {
        mip_level: level as u32,
        ..texture.as_image_copy()
    };
    queue.write_texture(destination, texels, layout, size);
}

fn sampler(device: &wgpu::Device) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("aogrid environment"),
        address_mode_u: wgpu::AddressMode::Repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    })
}
