//! The pipeline of the volume pass.

use super::draws::ObjectDraws;
use super::{VolumePassDescriptor, VolumePassError};
use crate::boxes::{self, BoxPipelineDescriptor, ProxyShape};
use crate::gbuffer::{GBufferBindings, GBufferReads};
use crate::pipelines::can_blend;
use crate::wgsl;

/// The storage buffers of the vertex stage: positions and indices.
const STORAGE_BUFFERS: u32 = 2;

/// Rejects targets and devices that do not work.
pub(super) fn check(
    device: &wgpu::Device,
    target: wgpu::TextureFormat,
) -> Result<(), VolumePassError> {
    let buffers = device.limits().max_storage_buffers_per_shader_stage;
    if buffers < STORAGE_BUFFERS {
        return Err(VolumePassError::StorageBuffers(buffers));
    }
    match is_float(target) && can_blend(device, target) {
        true => Ok(()),
        false => Err(VolumePassError::Target(target)),
    }
}

/// Whether a format holds floats.
pub(super) fn is_float(format: wgpu::TextureFormat) -> bool {
    [
        wgpu::TextureFormat::R16Float,
        wgpu::TextureFormat::R32Float,
        wgpu::TextureFormat::Rg16Float,
        wgpu::TextureFormat::Rg32Float,
        wgpu::TextureFormat::Rgba16Float,
        wgpu::TextureFormat::Rgba32Float,
    ]
    .contains(&format)
}

/// Compiles the pipeline.
pub(super) fn new(
    device: &wgpu::Device,
    bindings: &GBufferBindings,
    draws: &ObjectDraws,
    descriptor: &VolumePassDescriptor,
    reads: &GBufferReads,
) -> wgpu::RenderPipeline {
    let [object, geometry] = draws.layouts();
    let mut constants = reads.constants();
    constants.push(("divisor", descriptor.resolution.divisor().into()));
    let sum = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    let prism_pipeline = BoxPipelineDescriptor {
        label: &descriptor.label,
        wgsl: wgsl::VOLUME_PASS,
        layouts: &[bindings.layout(), object, geometry],
        shape: ProxyShape::Prism,
        fragment: "occlusion",
        constants: &constants,
        target: wgpu::ColorTargetState {
            format: descriptor.target,
            blend: Some(wgpu::BlendState {
                color: sum,
                alpha: sum,
            }),
            write_mask: wgpu::ColorWrites::ALL,
        },
        depth: descriptor.gbuffer.depth,
        front_face: descriptor.front_face,
    };
    boxes::pipeline(device, &prism_pipeline)
}
