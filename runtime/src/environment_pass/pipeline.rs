//! The pipeline of the environment pass: its layout and constants.

use std::num::NonZeroU64;

use super::{EnvironmentPassDescriptor, EnvironmentPassError, Reflection, Uniforms};
use crate::wgsl;

/// Rejects a target that cannot be drawn into.
pub(super) fn check(
    device: &wgpu::Device,
    descriptor: &EnvironmentPassDescriptor,
) -> Result<(), EnvironmentPassError> {
    let format = descriptor.target;
    let allowed = format.guaranteed_format_features(device.features());
    let renders = allowed
        .allowed_usages
        .contains(wgpu::TextureUsages::RENDER_ATTACHMENT);
    let floats = matches!(
        format.sample_type(None, None),
        Some(wgpu::TextureSampleType::Float { .. })
    );
    if !renders || !floats {
        return Err(EnvironmentPassError::Target { format, need: "" });
    }
    let blends = allowed
        .flags
        .contains(wgpu::TextureFormatFeatureFlags::BLENDABLE);
    if descriptor.blend.is_some() && !blends {
        let need = " and blend";
        return Err(EnvironmentPassError::Target { format, need });
    }
    Ok(())
}

pub(super) fn new(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    descriptor: &EnvironmentPassDescriptor,
) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("aogrid environment pass"),
        source: wgpu::ShaderSource::Wgsl(wgsl::ENVIRONMENT_PASS.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("aogrid environment pass"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let constants = descriptor.gbuffer.constants();
    let compilation_options = wgpu::PipelineCompilationOptions {
        constants: &constants,
        ..Default::default()
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(&descriptor.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("whole_target"),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: descriptor.depth_stencil.clone(),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(match descriptor.reflection {
                Reflection::Lambertian => "lambertian",
                Reflection::Glossy => "glossy",
            }),
            compilation_options,
            targets: &[Some(wgpu::ColorTargetState {
                format: descriptor.target,
                blend: descriptor.blend,
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

pub(super) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: NonZeroU64::new(size_of::<Uniforms>() as u64),
    };
    let texture = |filterable| wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let loaded = texture(false);
    let types = [uniform, loaded, loaded, loaded, texture(true), sampler];
    let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty,
        count: None,
    };
    let entries: Vec<_> = (0..).zip(types).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aogrid environment"),
        entries: &entries,
    })
}
