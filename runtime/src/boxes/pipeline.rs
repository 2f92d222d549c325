//! The pipeline of a pass that draws boxes.

use super::DepthTest;

/// What such pipelines differ in.
pub(crate) struct BoxPipeline<'a> {
    pub(crate) label: &'a str,
    pub(crate) wgsl: &'a str,
    /// Of all bind groups, in their order.
    pub(crate) layouts: &'a [&'a wgpu::BindGroupLayout],
    pub(crate) fragment: &'a str,
    /// The `override`s of the WGSL.
    pub(crate) constants: &'a [(&'static str, f64)],
    pub(crate) target: wgpu::ColorTargetState,
    pub(crate) depth: Option<DepthTest>,
    pub(crate) front_face: wgpu::FrontFace,
}

/// Compiles it.
pub(crate) fn pipeline(device: &wgpu::Device, what: &BoxPipeline<'_>) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(what.label),
        source: wgpu::ShaderSource::Wgsl(what.wgsl.into()),
    });
    let layouts: Vec<_> = what.layouts.iter().copied().map(Some).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(what.label),
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    let compilation_options = wgpu::PipelineCompilationOptions {
        constants: what.constants,
        ..Default::default()
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(what.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(match what.depth {
                Some(_) => "box_with_depth",
                None => "box_without_depth",
            }),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            front_face: what.front_face,
            cull_mode: Some(wgpu::Face::Front),
            unclipped_depth: what.depth.is_some()
                && device
                    .features()
                    .contains(wgpu::Features::DEPTH_CLIP_CONTROL),
            ..Default::default()
        },
        depth_stencil: what.depth.map(|test| wgpu::DepthStencilState {
            format: test.format,
            depth_write_enabled: Some(false),
            depth_compare: Some(test.compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(what.fragment),
            compilation_options,
            targets: &[Some(what.target.clone())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
