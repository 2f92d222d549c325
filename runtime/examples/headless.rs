//! The smallest program that shades with a baked grid: a floor from above, by the WGSL library.
//!
//! ```sh
//! cargo xtask bake assets/robot.obj -o robot.ao.ktx2
//! cargo run -p aogrid-runtime --example headless -- robot.ao.ktx2 shadow.png
//! ```

use aogrid_gpu_support::{Gpu, attachment};
use aogrid_grid_format::Grid;
use aogrid_runtime::{AogridOccluder, GridTexture, Instance, tables, wgsl};

/// Pixels along each side.
const SIZE: u32 = 512;

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

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
    let pixels = shade(&grid)?;
    image::save_buffer(png, &pixels, SIZE, SIZE, image::ColorType::Rgba8)?;
    Ok(())
}

fn shade(grid: &Grid) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let gpu = Gpu::new(wgpu::Features::empty())?;
    let Gpu { device, queue, .. } = &gpu;
    // Provided by the library: the grid's texture, T_clip, a sampler, and the occluder's uniform.
    let texture = GridTexture::new(device, queue, grid, "grid")?;
    let table = tables::transmittance_table(device, queue);
    let sampler = tables::linear_clamp_sampler(device);
    let identity = std::array::from_fn(|c| std::array::from_fn(|r| f32::from(c == r)));
    let occluder = AogridOccluder::new(grid, &Instance::at(identity))?;
    let occluder = bytemuck::bytes_of(&occluder);
    let uniform = gpu.buffer(wgpu::BufferUsages::UNIFORM, occluder);
    // Present in any renderer: a pipeline with its bindings, and a target.
    let pipeline = pipeline(device);
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
    let target = gpu.target([SIZE; 2], FORMAT);
    let view = target.create_view(&Default::default());
    // Draw one full-screen triangle and read the image back.
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[attachment(&view, wgpu::LoadOp::Clear(wgpu::Color::BLACK))],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
    drop(pass);
    queue.submit([encoder.finish()]);
    Ok(gpu.read_texture(&target))
}

fn pipeline(device: &wgpu::Device) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("floor"),
        source: wgpu::ShaderSource::Wgsl([wgsl::SHADING, SHADER].concat().into()),
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
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
            targets: &[Some(FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
