//! The smallest program that shades with a baked grid: a floor from above, by the WGSL library.
//!
//! ```sh
//! cargo xtask bake assets/robot.obj -o robot.ao.ktx2
//! cargo run -p aogrid-runtime --example headless -- robot.ao.ktx2 shadow.png
//! ```

use aogrid_grid_format::Grid;
use aogrid_runtime::{AogridOccluder, GridTexture, Instance, tables, wgsl};
use wgpu::util::DeviceExt;

/// Pixels along each side. Texture-to-buffer copies need rows of a multiple of 256 bytes.
const SIZE: u32 = 512;

const SHADER: &str = "
@group(0) @binding(0) var<uniform> occluder: AogridOccluder;
@group(0) @binding(1) var grid: texture_3d<f32>;
@group(0) @binding(2) var table: texture_2d<f32>;
@group(0) @binding(3) var linear_clamp: sampler;

@vertex
fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn floor_from_above(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let position = vec3f(pixel.x / 128.0 - 2.0, 0.0, pixel.y / 128.0 - 2.0);
    let normal = vec3f(0.0, 1.0, 0.0);
    let t = aogrid_cone(occluder, grid, table, linear_clamp, position, normal);
    return vec4f(vec3f(0.80, 0.82, 0.85) * t, 1.0);
}
";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let (Some(grid), Some(png)) = (args.next(), args.next()) else {
        return Err("usage: headless GRID.ao.ktx2 OUT.png".into());
    };
    let grid = Grid::from_bytes(&std::fs::read(grid)?)?;
    let pixels = pollster::block_on(shade(&grid))?;
    image::save_buffer(png, &pixels, SIZE, SIZE, image::ColorType::Rgba8)?;
    Ok(())
}

async fn shade(grid: &Grid) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = instance.request_adapter(&Default::default()).await?;
    let (device, queue) = &adapter.request_device(&Default::default()).await?;

    // Provided by the library: the grid's texture, T_clip, a sampler, and the occluder's uniform.
    let texture = GridTexture::new(device, queue, grid, "grid")?;
    let table = tables::transmittance_table(device, queue);
    let sampler = tables::linear_clamp_sampler(device);
    let identity = std::array::from_fn(|c| std::array::from_fn(|r| f32::from(c == r)));
    let occluder = AogridOccluder::new(grid.spec(), grid.format(), &Instance::at(identity))?;
    let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: bytemuck::bytes_of(&occluder),
        usage: wgpu::BufferUsages::UNIFORM,
    });
    // Present in any renderer: a pipeline with its bindings, and a target.
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("floor"),
        source: wgpu::ShaderSource::Wgsl([wgsl::SHADING, SHADER].concat().into()),
    });
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("floor"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("floor_from_above"),
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let resources = [
        uniform.as_entire_binding(),
        wgpu::BindingResource::TextureView(texture.view()),
        wgpu::BindingResource::TextureView(&table),
        wgpu::BindingResource::Sampler(&sampler),
    ];
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("floor"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &(0..).zip(resources).map(entry).collect::<Vec<_>>(),
    });
    let size = wgpu::Extent3d {
        width: SIZE,
        height: SIZE,
        depth_or_array_layers: 1,
    };
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("picture"),
        size: u64::from(4 * SIZE * SIZE),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    // Draw one full-screen triangle, then copy the image to a buffer that can be mapped.
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &target.create_view(&Default::default()),
            depth_slice: None,
            resolve_target: None,
            ops: Default::default(),
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
    drop(pass);
    let layout = wgpu::TexelCopyBufferLayout {
        bytes_per_row: Some(4 * SIZE),
        ..Default::default()
    };
    let buffer_rows = wgpu::TexelCopyBufferInfo {
        buffer: &buffer,
        layout,
    };
    encoder.copy_texture_to_buffer(target.as_image_copy(), buffer_rows, size);
    queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(buffer.get_mapped_range(..)?.to_vec())
}
