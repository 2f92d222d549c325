//! Glass among objects, shaded with the lists of the tiled pass. The glass is not in the G-buffer.
//!
//! ```sh
//! cargo run --release -p aogrid-runtime --example transparent -- glass.png
//! ```

mod models;

use std::error::Error;

use aogrid_gpu_support::{Gpu, attachment};
use aogrid_grid_format::Grid;
use aogrid_runtime::{
    Combine, GBufferFormat, GBufferViews, GridAtlas, Instance, Mode, Normals, Output, Positions,
    Receivers, TiledFrame, TiledPass, TiledPassDescriptor, wgsl,
};
use glam::camera::rh::{proj::directx, view};
use glam::{Mat4, Vec3};
use models::{Vertex, models, pane};

/// The image's width and height.
const SIZE: [u32; 2] = [640, 400];

const FLOATS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
const HALVES: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const PICTURE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

const CLEAR: wgpu::LoadOp<wgpu::Color> = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args()
        .nth(1)
        .ok_or("usage: transparent OUT.png")?;
    let pixels = draw()?;
    image::save_buffer(path, &pixels, SIZE[0], SIZE[1], image::ColorType::Rgba8)?;
    Ok(())
}

fn draw() -> Result<Vec<u8>, Box<dyn Error>> {
    let gpu = Gpu::new(wgpu::Features::empty())?;
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let clip_from_world = directx::perspective(0.46, aspect, 0.1, 30.0)
        * view::look_at_mat4(Vec3::new(1.6, 2.3, 5.2), Vec3::new(0.0, 0.35, 0.2), Vec3::Y);
    let (grids, occluders, vertices) = models()?;

    // Present in any renderer: a G-buffer of the opaque surfaces.
    let view = |texture: wgpu::Texture| texture.create_view(&Default::default());
    let targets = Targets {
        positions: view(gpu.target(SIZE, FLOATS)),
        normals: view(gpu.target(SIZE, HALVES)),
        depth: view(gpu.target_depth(SIZE, DEPTH)),
        occlusion: view(gpu.storage_target(SIZE, HALVES)),
    };
    let tiled = prepare(&gpu, &targets, clip_from_world, &grids, &occluders)?;
    let lists = tiled.lists().ok_or("nothing was prepared")?;

    let pipelines = Pipelines::new(&gpu.device, tiled.lists_layout());
    let camera = bytemuck::bytes_of(&clip_from_world);
    let camera = gpu.buffer(wgpu::BufferUsages::UNIFORM, camera);
    let vertex_buffer = |vertices: &[Vertex]| {
        gpu.buffer(wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(vertices))
    };
    let picture = gpu.target(SIZE, PICTURE);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let opaque = vertex_buffer(&vertices);
    pipelines.draw_gbuffer(&gpu, &mut encoder, &targets, &camera, &opaque);
    // Between the G-buffer and the shading that reads its result.
    tiled.dispatch(&mut encoder.begin_compute_pass(&Default::default()));
    {
        let depth = Some(depth_attachment(&targets.depth, wgpu::LoadOp::Load));
        let view = picture.create_view(&Default::default());
        let mut pass = render_pass(&mut encoder, &[attachment(&view, CLEAR)], depth);
        let views = [&targets.occlusion, &targets.normals];
        pass.set_bind_group(0, &pipelines.all(&gpu.device, &camera, views), &[]);
        pass.set_bind_group(1, lists, &[]);
        pass.set_pipeline(&pipelines.opaque);
        pass.draw(0..3, 0..1);
        // The glass is blended over the opaque image and tested against its depth.
        pass.set_pipeline(&pipelines.glass);
        pass.set_vertex_buffer(0, vertex_buffer(&pane()).slice(..));
        pass.draw(0..6, 0..1);
    }
    gpu.queue.submit([encoder.finish()]);
    Ok(gpu.read_texture(&picture))
}

/// The G-buffer, and the output of the tiled pass.
struct Targets {
    positions: wgpu::TextureView,
    normals: wgpu::TextureView,
    depth: wgpu::TextureView,
    occlusion: wgpu::TextureView,
}

/// Returns the tiled pass, which shades the G-buffer and keeps its lists.
fn prepare(
    gpu: &Gpu,
    targets: &Targets,
    clip_from_world: Mat4,
    grids: &[Grid],
    occluders: &[(usize, Instance)],
) -> Result<TiledPass, Box<dyn Error>> {
    let Gpu { device, queue, .. } = gpu;
    let descriptor = TiledPassDescriptor {
        label: "proximity shadows".into(),
        mode: Mode::Cone,
        combine: Combine::Merge,
        output: Output::TransmittanceAndAxis,
        target: HALVES,
        gbuffer: GBufferFormat {
            positions: Positions::World,
            normals: Normals::Signed,
            receivers: Receivers::None,
            depth: None,
        },
    };
    let mut tiled = TiledPass::new(device, queue, descriptor)?;
    let grids: Vec<_> = grids.iter().collect();
    let frame = TiledFrame {
        gbuffer: GBufferViews {
            clip_from_world: clip_from_world.to_cols_array_2d(),
            positions: &targets.positions,
            normals: Some(&targets.normals),
            receivers: None,
        },
        atlas: &GridAtlas::new(device, queue, &grids, "grids")?,
        occluders,
        target: &targets.occlusion,
    };
    tiled.prepare(device, queue, &frame)?;
    Ok(tiled)
}

struct Pipelines {
    gbuffer: wgpu::RenderPipeline,
    opaque: wgpu::RenderPipeline,
    glass: wgpu::RenderPipeline,
    camera: wgpu::BindGroupLayout,
    all: wgpu::BindGroupLayout,
}

impl Pipelines {
    fn new(device: &wgpu::Device, lists: &wgpu::BindGroupLayout) -> Self {
        let own_source = include_str!("transparent.wgsl");
        let source = [wgsl::SHADING, &wgsl::tile_lists(1), own_source].concat();
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let entries = [uniform_entry(0), texture_entry(1), texture_entry(2)];
        let (camera, all) = (layout(device, &entries[..1]), layout(device, &entries));
        let pipeline = |layouts: &[&wgpu::BindGroupLayout], entry_points, targets: &[_], depth| {
            pipeline(device, &module, layouts, entry_points, targets, depth)
        };
        let plain = |format: wgpu::TextureFormat| Some(format.into());
        let glass = wgpu::ColorTargetState {
            blend: Some(wgpu::BlendState::ALPHA_BLENDING),
            ..PICTURE.into()
        };
        use wgpu::CompareFunction::{Always, Less};
        Self {
            gbuffer: pipeline(
                &[&camera],
                ["surface", "gbuffer"],
                &[plain(FLOATS), plain(HALVES)],
                depth_state(Less, true),
            ),
            opaque: pipeline(
                &[&all],
                ["whole_screen", "opaque"],
                &[plain(PICTURE)],
                depth_state(Always, false),
            ),
            glass: pipeline(
                &[&all, lists],
                ["surface", "glass"],
                &[Some(glass)],
                depth_state(Less, false),
            ),
            camera,
            all,
        }
    }

    fn draw_gbuffer(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets,
        camera: &wgpu::Buffer,
        opaque: &wgpu::Buffer,
    ) {
        let depth = Some(depth_attachment(&targets.depth, wgpu::LoadOp::Clear(1.0)));
        let colors = [&targets.positions, &targets.normals];
        let colors = colors.map(|view| attachment(view, CLEAR));
        let mut pass = render_pass(encoder, &colors, depth);
        pass.set_pipeline(&self.gbuffer);
        pass.set_bind_group(0, &self.camera(&gpu.device, camera), &[]);
        pass.set_vertex_buffer(0, opaque.slice(..));
        let count = opaque.size() / size_of::<Vertex>() as u64;
        pass.draw(0..count as u32, 0..1);
    }

    fn camera(&self, device: &wgpu::Device, camera: &wgpu::Buffer) -> wgpu::BindGroup {
        group(device, &self.camera, [camera.as_entire_binding()])
    }

    fn all(
        &self,
        device: &wgpu::Device,
        camera: &wgpu::Buffer,
        views: [&wgpu::TextureView; 2],
    ) -> wgpu::BindGroup {
        let [occlusion, normals] = views.map(wgpu::BindingResource::TextureView);
        group(
            device,
            &self.all,
            [camera.as_entire_binding(), occlusion, normals],
        )
    }
}

fn depth_state(compare: wgpu::CompareFunction, writes: bool) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(writes),
        depth_compare: Some(compare),
        stencil: Default::default(),
        bias: Default::default(),
    }
}

/// Compiles a pipeline from the entry points of its vertex and fragment shaders.
fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layouts: &[&wgpu::BindGroupLayout],
    [vertex, fragment]: [&str; 2],
    targets: &[Option<wgpu::ColorTargetState>],
    depth: wgpu::DepthStencilState,
) -> wgpu::RenderPipeline {
    let layouts: Vec<_> = layouts.iter().copied().map(Some).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: Default::default(),
            buffers: match vertex {
                "surface" => &[VERTICES],
                _ => &[],
            },
        },
        primitive: Default::default(),
        depth_stencil: Some(depth),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: Default::default(),
            targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

const VERTICES: Option<wgpu::VertexBufferLayout<'static>> = Some(wgpu::VertexBufferLayout {
    array_stride: size_of::<Vertex>() as u64,
    step_mode: wgpu::VertexStepMode::Vertex,
    attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3],
});

fn uniform_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}

fn texture_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    }
}

fn layout(device: &wgpu::Device, entries: &[wgpu::BindGroupLayoutEntry]) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries,
    })
}

fn group<const N: usize>(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: [wgpu::BindingResource<'_>; N],
) -> wgpu::BindGroup {
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout,
        entries: &entries,
    })
}

fn depth_attachment(
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<f32>,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    let store = wgpu::StoreOp::Store;
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load, store }),
        stencil_ops: None,
    }
}

fn render_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    color_attachments: &[Option<wgpu::RenderPassColorAttachment<'_>>],
    depth_stencil_attachment: Option<wgpu::RenderPassDepthStencilAttachment<'_>>,
) -> wgpu::RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments,
        depth_stencil_attachment,
        ..Default::default()
    })
}
