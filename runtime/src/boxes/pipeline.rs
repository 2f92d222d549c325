//! The pipeline of a pass that draws boxes.

use crate::gbuffer::DepthTest;

/// The parameters of a pipeline that draws boxes.
pub(crate) struct BoxPipelineDescriptor<'a> {
    pub(crate) label: &'a str,
    pub(crate) wgsl: &'a str,
    /// The layouts of all bind groups, in their order.
    pub(crate) layouts: &'a [&'a wgpu::BindGroupLayout],
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
            entry_point: Some(descriptor.fragment),
            compilation_options,
            targets: &[Some(descriptor.target.clone())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
