use std::io::{Write, stderr};
use std::sync::Mutex;

use wgpu::util::DeviceExt;

/// Makes a missing adapter a failure.
const VARIABLE: &str = "AOGRID_GPU";

/// Software adapters use all cores for one draw: tests take turns.
static TURN: Mutex<()> = Mutex::new(());

/// Copies a float texture into a depth attachment.
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

/// A device, or none, with a note, if there is no adapter. What the library does wrong with it is
/// not captured by anyone, and so a panic.
pub fn gpu() -> Option<Gpu> {
    gpu_with(wgpu::Features::FLOAT32_FILTERABLE | wgpu::Features::FLOAT32_BLENDABLE)
}

/// A device with those features that the adapter has.
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
    /// The largest error of a filter's weight along one axis. Texture units weigh texels with 8
    /// bits or more (`subTexelPrecisionBits` is 8 on all that matter), rounded or cut off; Mesa's
    /// software rasteriser does so for 8-bit texels, and filters floats in single floats.
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

    /// A 2D texture of tightly packed texels.
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

    /// A target that compute shaders write.
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

    /// Draws depths into a depth texture, as copies may not write one.
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

    /// The texels of a texture, tightly packed.
    pub fn read_texture(&self, texture: &wgpu::Texture) -> Vec<u8> {
        let texel = texture.format().block_copy_size(None).expect("a colour");
        let used = texture.width() * texel;
        let row = used.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("test"),
            size: u64::from(row * texture.height()),
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
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        self.queue.submit([encoder.finish()]);
        let rows = self.read_buffer(&buffer);
        let rows = rows.chunks_exact(row as usize);
        rows.flat_map(|row| &row[..used as usize])
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
