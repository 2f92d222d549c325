use std::io::{Write, stderr};
use std::sync::Mutex;

use wgpu::util::DeviceExt;

/// The environment variable that makes a missing adapter a failure.
const VARIABLE: &str = "AOGRID_GPU";

/// A lock that makes tests take turns: a software rasterizer uses all cores for one draw.
static TURN: Mutex<()> = Mutex::new(());

/// A shader that copies a float texture into a depth attachment.
const DEPTH_COPY: &str = "
@group(0) @binding(0) var depths: texture_2d<f32>;
@vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}
@fragment fn copy(@builtin(position) at: vec4f) -> @builtin(frag_depth) f32 {
    return textureLoad(depths, vec2u(at.xy), 0).x;
}
";

pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    adapter: wgpu::DeviceType,
    _turn: std::sync::MutexGuard<'static, ()>,
}

/// Returns a device, or `None` with a note if there is no adapter. Nothing captures the library's
/// validation errors, so they panic.
pub fn gpu() -> Option<Gpu> {
    gpu_with(wgpu::Features::FLOAT32_FILTERABLE | wgpu::Features::FLOAT32_BLENDABLE)
}

/// Returns a device with those of `features` that the adapter supports.
pub fn gpu_with(features: wgpu::Features) -> Option<Gpu> {
    let turn = TURN.lock().unwrap_or_else(|poison| poison.into_inner());
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = match pollster::block_on(instance.request_adapter(&Default::default())) {
        Ok(adapter) => adapter,
        Err(error) => return skip(&error.to_string()),
    };
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: features & adapter.features(),
        ..Default::default()
    }))
    .expect("the adapter makes a device");
    Some(Gpu {
        device,
        queue,
        adapter: adapter.get_info().device_type,
        _turn: turn,
    })
}

fn skip(why: &str) -> Option<Gpu> {
    let demanded = std::env::var(VARIABLE).is_ok_and(|v| v == "require");
    assert!(!demanded, "{VARIABLE}=require, but: {why}");
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    let _ = writeln!(
        stderr(),
        "SKIPPED {test}: no GPU adapter ({VARIABLE}): {why}"
    );
    None
}

impl Gpu {
    /// Returns the largest error of a filter's weight along one axis. Texture units weight texels
    /// with 8 bits or more (`subTexelPrecisionBits` is 8 on all devices that matter), rounded or
    /// truncated; Mesa's software rasterizer does so for 8-bit texels, and filters float texels in
    /// single precision.
    pub fn weight_error(&self, eight_bit_texels: bool) -> f32 {
        match self.adapter == wgpu::DeviceType::Cpu && !eight_bit_texels {
            true => 0.0,
            false => 1.0 / 256.0,
        }
    }

    pub fn storage(&self, contents: &[u8]) -> wgpu::Buffer {
        self.device
            .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("test"),
                contents,
                usage: wgpu::BufferUsages::STORAGE
                    | wgpu::BufferUsages::UNIFORM
                    | wgpu::BufferUsages::COPY_SRC,
            })
    }

    /// Returns a view of a 2D texture with tightly packed `texels`.
    pub fn texture(
        &self,
        [width, height]: [u32; 2],
        format: wgpu::TextureFormat,
        texels: &[u8],
    ) -> wgpu::TextureView {
        let descriptor = wgpu::TextureDescriptor {
            label: Some("test"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        };
        let order = wgpu::util::TextureDataOrder::LayerMajor;
        self.device
            .create_texture_with_data(&self.queue, &descriptor, order, texels)
            .create_view(&Default::default())
    }

    pub fn target(&self, [width, height]: [u32; 2], format: wgpu::TextureFormat) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("test target"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    }

    /// Returns a target that compute shaders write.
    pub fn storage_target(
        &self,
        [width, height]: [u32; 2],
        format: wgpu::TextureFormat,
    ) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("test target"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        })
    }

    pub fn target_depth(
        &self,
        [width, height]: [u32; 2],
        format: wgpu::TextureFormat,
    ) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("test depth"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        })
    }

    /// Draws depths into a depth texture, which copies may not write.
    pub fn fill_depth(&self, target: &wgpu::Texture, depths: &[f32], size: [u32; 2]) {
        let module = self
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("test depth"),
                source: wgpu::ShaderSource::Wgsl(DEPTH_COPY.into()),
            });
        let pipeline = self
            .device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("test depth"),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("corner"),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: Default::default(),
                depth_stencil: Some(wgpu::DepthStencilState {
                    format: target.format(),
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::Always),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("copy"),
                    compilation_options: Default::default(),
                    targets: &[],
                }),
                multiview_mask: None,
                cache: None,
            });
        // The shader reads the depths as a float texture and writes them as fragment depths.
        let source = self.texture(
            size,
            wgpu::TextureFormat::R32Float,
            bytemuck::cast_slice(depths),
        );
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("test depth"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&source),
            }],
        });
        let view = target.create_view(&Default::default());
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        self.queue.submit([encoder.finish()]);
    }

    /// Returns the texels of a texture, tightly packed.
    pub fn read_texture(&self, texture: &wgpu::Texture) -> Vec<u8> {
        let texel = texture
            .format()
            .block_copy_size(None)
            .expect("a color format");
        let row_bytes = texture.width() * texel;
        let padded_bytes = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("test"),
            size: u64::from(padded_bytes * texture.height()),
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded_bytes),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        self.queue.submit([encoder.finish()]);
        // Drop the padding at the end of each row.
        let rows = self.read_buffer(&buffer);
        let rows = rows.chunks_exact(padded_bytes as usize);
        rows.flat_map(|row| &row[..row_bytes as usize])
            .copied()
            .collect()
    }

    pub fn read_buffer(&self, buffer: &wgpu::Buffer) -> Vec<u8> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("test"),
            size: buffer.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        self.queue.submit([encoder.finish()]);
        staging.map_async(wgpu::MapMode::Read, .., |result| result.expect("it maps"));
        self.device
            .poll(wgpu::PollType::Wait {
                submission_index: None,
                timeout: None,
            })
            .expect("the device answers");
        let range = staging.get_mapped_range(..).expect("it is mapped");
        range.to_vec()
    }
}
