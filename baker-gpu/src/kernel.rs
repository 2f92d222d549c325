//! A compute pipeline and its bind groups.

use std::num::NonZeroU64;

use wgpu::{BindGroup, BindGroupLayout, Buffer, ComputePipeline, Device};

use crate::shaders::Shader;

/// The kind of a binding. Bindings after the chunk are listed in the order of their numbers.
#[derive(Clone, Copy)]
pub(crate) enum Binding {
    Uniform,
    Read,
    Write,
}

/// A compiled entry point.
pub(crate) struct Kernel {
    pub pipeline: ComputePipeline,
    layout: BindGroupLayout,
}

/// The stride in bytes of `Chunk`s in their buffer: WebGPU's alignment of dynamic offsets.
pub(crate) const CHUNK_STRIDE: u64 = 256;

/// The bytes of a `Chunk` that are bound to a shader.
const CHUNK_SIZE: u64 = 16;

impl Kernel {
    pub(crate) fn new(device: &Device, shader: &Shader, bindings: &[Binding]) -> Self {
        let label = Some(shader.name);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label,
            source: wgpu::ShaderSource::Wgsl(shader.source.as_str().into()),
        });
        let entries: Vec<_> = (0..).zip(bindings).map(|(i, b)| entry(i + 1, *b)).collect();
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label,
            entries: &[&[chunk_entry()], &entries[..]].concat(),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label,
            bind_group_layouts: &[Some(&layout)],
            ..Default::default()
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label,
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some(shader.entry_point),
            compilation_options: Default::default(),
            cache: None,
        });
        Self { pipeline, layout }
    }

    /// Binds the chunks and these buffers, in the order of the bindings.
    pub(crate) fn bind(&self, device: &Device, chunks: &Buffer, buffers: &[&Buffer]) -> BindGroup {
        let chunk = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: chunks,
            offset: 0,
            size: NonZeroU64::new(CHUNK_SIZE),
        });
        let resources = buffers.iter().map(|buffer| buffer.as_entire_binding());
        let entries: Vec<_> = (0..)
            .zip(std::iter::once(chunk).chain(resources))
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &entries,
        })
    }
}

fn chunk_entry() -> wgpu::BindGroupLayoutEntry {
    let mut entry = entry(0, Binding::Uniform);
    entry.ty = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: true,
        min_binding_size: NonZeroU64::new(CHUNK_SIZE),
    };
    entry
}

fn entry(binding: u32, kind: Binding) -> wgpu::BindGroupLayoutEntry {
    let ty = match kind {
        Binding::Uniform => wgpu::BufferBindingType::Uniform,
        Binding::Read => wgpu::BufferBindingType::Storage { read_only: true },
        Binding::Write => wgpu::BufferBindingType::Storage { read_only: false },
    };
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}
