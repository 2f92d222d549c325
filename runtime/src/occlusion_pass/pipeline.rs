//! What the raster pass compiles: layouts, blending, constants.

use std::num::NonZeroU64;

use aogrid_grid_format::Encoding;

use super::{
    Draw, Mode, Normals, OcclusionPassDescriptor, Output, PassError, Positions, Receivers,
};
use crate::{grid_texture, wgsl};

/// The layouts of the pass's bind groups, in their order; the third is the grid's own.
#[derive(Debug)]
pub(super) struct Layouts {
    pub(super) frame: wgpu::BindGroupLayout,
    pub(super) draw: wgpu::BindGroupLayout,
    grid: wgpu::BindGroupLayout,
}

impl Layouts {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        Self {
            frame: frame_layout(device),
            draw: draw_layout(device),
            grid: grid_texture::layout(device),
        }
    }
}

/// Refuses what could not be compiled or would come out wrong.
pub(super) fn check(
    device: &wgpu::Device,
    descriptor: &OcclusionPassDescriptor,
) -> Result<(), PassError> {
    if descriptor.mode == Mode::Cone && descriptor.encoding == Encoding::Occlusion {
        return Err(PassError::NoCones);
    }
    let with_axis = descriptor.output == Output::TransmittanceAndAxis;
    if with_axis && descriptor.mode == Mode::Occlusion {
        return Err(PassError::NoAxis);
    }
    let format = descriptor.target;
    let allowed = format.guaranteed_format_features(device.features());
    let blends = allowed
        .flags
        .contains(wgpu::TextureFormatFeatureFlags::BLENDABLE);
    let renders = allowed
        .allowed_usages
        .contains(wgpu::TextureUsages::RENDER_ATTACHMENT);
    let four_floats = [
        wgpu::TextureFormat::Rgba16Float,
        wgpu::TextureFormat::Rgba32Float,
    ];
    if !blends || !renders {
        return Err(PassError::Target { format, need: "" });
    }
    if with_axis && !four_floats.contains(&format) {
        let need = " and hold four signed floats";
        return Err(PassError::Target { format, need });
    }
    Ok(())
}

pub(super) fn new(
    device: &wgpu::Device,
    layouts: &Layouts,
    descriptor: &OcclusionPassDescriptor,
) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("aogrid occlusion pass"),
        source: wgpu::ShaderSource::Wgsl(wgsl::OCCLUSION_PASS.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("aogrid occlusion pass"),
        bind_group_layouts: &[
            Some(&layouts.frame),
            Some(&layouts.draw),
            Some(&layouts.grid),
        ],
        immediate_size: 0,
    });
    let constants = constants(descriptor);
    let compilation_options = wgpu::PipelineCompilationOptions {
        constants: &constants,
        ..Default::default()
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(&descriptor.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(match descriptor.depth {
                Some(_) => "box_with_depth",
                None => "box_without_depth",
            }),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            front_face: descriptor.front_face,
            cull_mode: Some(wgpu::Face::Front),
            unclipped_depth: descriptor.depth.is_some()
                && device
                    .features()
                    .contains(wgpu::Features::DEPTH_CLIP_CONTROL),
            ..Default::default()
        },
        depth_stencil: descriptor.depth.map(|test| wgpu::DepthStencilState {
            format: test.format,
            depth_write_enabled: Some(false),
            depth_compare: Some(test.compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(match (descriptor.mode, descriptor.output) {
                (Mode::Occlusion, _) => "occlusion",
                (Mode::Cone, Output::Transmittance) => "cone",
                (Mode::Cone, Output::TransmittanceAndAxis) => "cone_with_axis",
            }),
            compilation_options,
            targets: &[Some(target(descriptor))],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// A texture with nothing in it, for a binding that no shader will read.
pub(super) fn nothing(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("aogrid nothing"),
        size: wgpu::Extent3d::default(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor {
        label: Some("aogrid nothing"),
        ..Default::default()
    })
}

/// The `override`s of the WGSL.
fn constants(descriptor: &OcclusionPassDescriptor) -> [(&'static str, f64); 5] {
    let flag = |yes| if yes { 1.0 } else { 0.0 };
    let [scale, offset] = match descriptor.normals {
        Normals::Signed => [1.0, 0.0],
        Normals::Unsigned => [2.0, -1.0],
    };
    [
        (
            "positions_are_depths",
            flag(descriptor.positions == Positions::Depth),
        ),
        ("normal_scale", scale),
        ("normal_offset", offset),
        (
            "receiver_channels",
            match descriptor.receivers {
                Receivers::None => 0.0,
                Receivers::Ids => 1.0,
                Receivers::IdsAndLayers => 2.0,
            },
        ),
        (
            "grids_hold_cones",
            flag(descriptor.encoding == Encoding::Cone),
        ),
    ]
}

fn target(descriptor: &OcclusionPassDescriptor) -> wgpu::ColorTargetState {
    use wgpu::BlendFactor::{One, Src, SrcAlpha, Zero};
    let blend = |src_factor, dst_factor| wgpu::BlendComponent {
        src_factor,
        dst_factor,
        operation: wgpu::BlendOperation::Add,
    };
    let (color, alpha, write_mask) = match descriptor.output {
        // Whoever multiplies straight into a picture keeps its alpha.
        Output::Transmittance => (blend(Zero, Src), blend(Zero, One), wgpu::ColorWrites::COLOR),
        Output::TransmittanceAndAxis => (
            blend(One, One),
            blend(Zero, SrcAlpha),
            wgpu::ColorWrites::ALL,
        ),
    };
    wgpu::ColorTargetState {
        format: descriptor.target,
        blend: Some(wgpu::BlendState { color, alpha }),
        write_mask,
    }
}

fn frame_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: NonZeroU64::new(size_of::<[[f32; 4]; 4]>() as u64),
    };
    let texture = |sample_type| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let loaded = texture(wgpu::TextureSampleType::Float { filterable: false });
    let filtered = texture(wgpu::TextureSampleType::Float { filterable: true });
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let ids = texture(wgpu::TextureSampleType::Uint);
    let types = [uniform, loaded, loaded, ids, filtered, sampler];
    let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let entries: Vec<_> = (0..).zip(types).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aogrid frame"),
        entries: &entries,
    })
}

fn draw_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aogrid occluders"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: true,
                min_binding_size: NonZeroU64::new(size_of::<Draw>() as u64),
            },
            count: None,
        }],
    })
}
