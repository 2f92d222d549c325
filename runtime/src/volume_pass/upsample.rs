//! The pass that brings a volume pass's smaller target to the G-buffer's size.

use super::pipeline::is_float;
use super::{VolumePassError, VolumeResolution};
use crate::gbuffer::{
    GBufferBindings, GBufferError, GBufferFormat, GBufferReads, GBufferViews, placeholder,
};
use crate::wgsl;

/// The distance from a receiver's plane at which a neighbor no longer counts, relative to the extent of
/// the volumes, over which occlusion changes.
const TOLERANCE: f32 = 0.1;

/// The inputs and outputs of an [`UpsamplePass`]. Everything here is compiled into its pipeline.
#[derive(Clone, Debug)]
pub struct UpsamplePassDescriptor {
    /// Names the pass in graphics debuggers.
    pub label: String,
    /// The target's format: one or more float channels, each of which receives the sum.
    pub target: wgpu::TextureFormat,
    /// The resolution of the volume pass.
    pub resolution: VolumeResolution,
    /// The contents of the G-buffer, without a depth test.
    pub gbuffer: GBufferFormat,
}

/// The pass behind a [`VolumePass`](super::VolumePass) of half or quarter resolution: each texel of the
/// G-buffer takes the occlusion of the four pixels around it that are near its plane and face as it does.
/// Things thinner than their distance are lost.
#[derive(Debug)]
pub struct UpsamplePass {
    pipeline: wgpu::RenderPipeline,
    bindings: GBufferBindings,
    layout: wgpu::BindGroupLayout,
    tolerance: wgpu::Buffer,
    group: Option<(wgpu::TextureView, wgpu::BindGroup)>,
}

impl UpsamplePass {
    /// Compiles the pipeline.
    ///
    /// # Errors
    ///
    /// The target's format does not hold floats.
    pub fn new(
        device: &wgpu::Device,
        descriptor: &UpsamplePassDescriptor,
    ) -> Result<Self, VolumePassError> {
        if !is_float(descriptor.target) {
            return Err(VolumePassError::Target(descriptor.target));
        }
        let reads = GBufferReads {
            format: descriptor.gbuffer,
            normals: true,
        };
        let no_table = placeholder(device, wgpu::TextureFormat::Rgba8Unorm);
        let bindings = GBufferBindings::new(device, reads, no_table);
        let layout = layout(device);
        Ok(Self {
            pipeline: pipeline(device, &[bindings.layout(), &layout], descriptor, &reads),
            bindings,
            layout,
            tolerance: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("aogrid upsampling"),
                size: size_of::<[f32; 4]>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            group: None,
        })
    }

    /// Writes the frame that [`UpsamplePass::draw`] will draw: the G-buffer, the target of the volume pass,
    /// and the largest extent of its volumes.
    ///
    /// # Errors
    ///
    /// The pass cannot read the G-buffer; the last valid frame is kept.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        gbuffer: &GBufferViews<'_>,
        reduced: &wgpu::TextureView,
        extent: f32,
    ) -> Result<(), GBufferError> {
        let validated = self.bindings.check(gbuffer)?;
        self.bindings.write(device, queue, validated);
        let tolerance = [TOLERANCE * extent, 0.0, 0.0, 0.0];
        queue.write_buffer(&self.tolerance, 0, bytemuck::bytes_of(&tolerance));
        if self.group.as_ref().is_none_or(|(view, _)| view != reduced) {
            let resources = [
                wgpu::BindingResource::TextureView(reduced),
                self.tolerance.as_entire_binding(),
            ];
            let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("aogrid upsampling"),
                layout: &self.layout,
                entries: &(0..).zip(resources).map(entry).collect::<Vec<_>>(),
            });
            self.group = Some((reduced.clone(), group));
        }
        Ok(())
    }

    /// Writes every pixel of the render pass's only color attachment, which has the G-buffer's size.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let (Some(frame), Some((_, reduced))) = (self.bindings.group(), &self.group) else {
            return;
        };
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(1, reduced, &[]);
        pass.draw(0..3, 0..1);
    }
}

fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: false },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aogrid upsampling"),
        entries: &[entry(0, texture), entry(1, uniform)],
    })
}

fn pipeline(
    device: &wgpu::Device,
    layouts: &[&wgpu::BindGroupLayout],
    descriptor: &UpsamplePassDescriptor,
    reads: &GBufferReads,
) -> wgpu::RenderPipeline {
    let label = Some(descriptor.label.as_str());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label,
        source: wgpu::ShaderSource::Wgsl(wgsl::UPSAMPLE_PASS.into()),
    });
    let layouts: Vec<_> = layouts.iter().copied().map(Some).collect();
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label,
        bind_group_layouts: &layouts,
        immediate_size: 0,
    });
    let mut constants = reads.constants();
    constants.push(("divisor", descriptor.resolution.divisor().into()));
    let compilation_options = wgpu::PipelineCompilationOptions {
        constants: &constants,
        ..Default::default()
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("whole_target"),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("upsampled"),
            compilation_options,
            targets: &[Some(descriptor.target.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
