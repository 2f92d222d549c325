//! Textures and buffers: creation, upload, read-back.

use wgpu::util::DeviceExt;
use wgpu::{TextureFormat, TextureUsages};

use crate::Gpu;

fn descriptor(
    [width, height]: [u32; 2],
    format: TextureFormat,
    usage: TextureUsages,
) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        label: None,
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
    }
}

impl Gpu {
    /// Returns an empty 2D texture.
    pub fn texture(
        &self,
        size: [u32; 2],
        format: TextureFormat,
        usage: TextureUsages,
    ) -> wgpu::Texture {
        self.device.create_texture(&descriptor(size, format, usage))
    }

    /// Returns a view of a 2D texture with tightly packed `texels`.
    pub fn upload(
        &self,
        size: [u32; 2],
        format: TextureFormat,
        texels: &[u8],
    ) -> wgpu::TextureView {
        let descriptor = descriptor(size, format, TextureUsages::TEXTURE_BINDING);
        let order = wgpu::util::TextureDataOrder::LayerMajor;
        self.device
            .create_texture_with_data(&self.queue, &descriptor, order, texels)
            .create_view(&Default::default())
    }

    /// Returns a target that can be drawn into, bound and read back.
    pub fn target(&self, size: [u32; 2], format: TextureFormat) -> wgpu::Texture {
        let usage = TextureUsages::RENDER_ATTACHMENT
            | TextureUsages::TEXTURE_BINDING
            | TextureUsages::COPY_SRC;
        self.texture(size, format, usage)
    }

    /// Returns a target that compute shaders write, and that can be bound and read back.
    pub fn storage_target(&self, size: [u32; 2], format: TextureFormat) -> wgpu::Texture {
        let usage = TextureUsages::STORAGE_BINDING
            | TextureUsages::TEXTURE_BINDING
            | TextureUsages::COPY_SRC;
        self.texture(size, format, usage)
    }

    /// Returns a depth attachment.
    pub fn target_depth(&self, size: [u32; 2], format: TextureFormat) -> wgpu::Texture {
        self.texture(size, format, TextureUsages::RENDER_ATTACHMENT)
    }

    /// Returns a buffer with these contents.
    pub fn buffer(&self, usage: wgpu::BufferUsages, contents: &[u8]) -> wgpu::Buffer {
        let descriptor = wgpu::util::BufferInitDescriptor {
            label: None,
            contents,
            usage,
        };
        self.device.create_buffer_init(&descriptor)
    }

    /// Returns a buffer that shaders read, as a uniform or as storage, or write.
    pub fn storage(&self, contents: &[u8]) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::UNIFORM
            | wgpu::BufferUsages::COPY_SRC;
        self.buffer(usage, contents)
    }

    /// Returns the texels of a texture, tightly packed.
    ///
    /// # Panics
    ///
    /// If the format cannot be copied, or the device is lost.
    pub fn read_texture(&self, texture: &wgpu::Texture) -> Vec<u8> {
        let texel = texture
            .format()
            .block_copy_size(None)
            .expect("a color format");
        let row_bytes = texture.width() * texel;
        let padded_bytes = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(padded_bytes * texture.height()),
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let rows = wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                bytes_per_row: Some(padded_bytes),
                ..Default::default()
            },
        };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(texture.as_image_copy(), rows, texture.size());
        self.queue.submit([encoder.finish()]);
        // Drop the padding at the end of each row.
        let bytes = self.read_buffer(&buffer);
        let rows = bytes.chunks_exact(padded_bytes as usize);
        rows.flat_map(|row| &row[..row_bytes as usize])
            .copied()
            .collect()
    }

    /// Returns the contents of a buffer.
    ///
    /// # Panics
    ///
    /// If the device is lost.
    pub fn read_buffer(&self, buffer: &wgpu::Buffer) -> Vec<u8> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: buffer.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        self.queue.submit([encoder.finish()]);
        staging.map_async(wgpu::MapMode::Read, .., |result| result.expect("it maps"));
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .expect("the device answers");
        let range = staging.get_mapped_range(..).expect("it is mapped");
        range.to_vec()
    }
}

/// Returns a color attachment that is stored.
pub fn attachment(
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    Some(wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load,
            store: wgpu::StoreOp::Store,
        },
    })
}

/// Returns a depth attachment that is tested and not written.
pub fn read_only_depth(view: &wgpu::TextureView) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: None,
        stencil_ops: None,
    }
}
