//! The pipeline of a pass that draws proxy shapes: boxes around occluders, prisms around triangles.

use crate::gbuffer::DepthTest;

/// The shape that a pass draws in place of what casts.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ProxyShape {
    /// A triangle strip: `box_with_depth` and `box_without_depth` in the WGSL.
    Box,
    /// A list of triangles: `prism_with_depth` and `prism_without_depth`.
    Prism,
}

impl ProxyShape {
    fn vertex_stage(self, with_depth: bool) -> &'static str {
        match (self, with_depth) {
            (Self::Box, true) => "box_with_depth",
            (Self::Box, false) => "box_without_depth",
            (Self::Prism, true) => "prism_with_depth",
            (Self::Prism, false) => "prism_without_depth",
        }
    }

    fn topology(self) -> wgpu::PrimitiveTopology {
        match self {
            Self::Box => wgpu::PrimitiveTopology::TriangleStrip,
            Self::Prism => wgpu::PrimitiveTopology::TriangleList,
        }
    }
}

/// The parameters of a pipeline that draws proxy shapes.
pub(crate) struct BoxPipelineDescriptor<'a> {
    pub(crate) label: &'a str,
    pub(crate) wgsl: &'a str,
    /// The layouts of all bind groups, in their order.
    pub(crate) layouts: &'a [&'a wgpu::BindGroupLayout],
    pub(crate) shape: ProxyShape,
    pub(crate) fragment: &'a str,
    /// The `override`s of the WGSL.
    pub(crate) constants: &'a [(&'static str, f64)],
    pub(crate) target: wgpu::ColorTargetState,
    pub(crate) depth: Option<DepthTest>,
    pub(crate) front_face: wgpu::FrontFace,
}

/// Compiles the pipeline.
pub(crate) fn pipeline(
    device: &wgpu::Device,
    descriptor: &BoxPipelineDescriptor<'_>,
) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(descriptor.label),
        source: wgpu::ShaderSource::Wgsl(descriptor.wgsl.into()),
    });
    let layouts: Vec<_> = descriptor.layouts.iter().copied().map(Some).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(descriptor.label),
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    let compilation_options = wgpu::PipelineCompilationOptions {
        constants: descriptor.constants,
        ..Default::default()
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(descriptor.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(descriptor.shape.vertex_stage(descriptor.depth.is_some())),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: descriptor.shape.topology(),
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
            entry_point: Some(descriptor.fragment),
            compilation_options,
            targets: &[Some(descriptor.target.clone())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
