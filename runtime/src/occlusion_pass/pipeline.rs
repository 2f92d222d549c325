//! The pipeline of the raster pass: its target, blending and constants.

use aogrid_grid_format::Encoding;

use super::{Mode, OcclusionPassDescriptor, Output, PassError};
use crate::boxes::{self, BoxPipelineDescriptor, OccluderDraws, ProxyShape};
use crate::gbuffer::GBufferBindings;
use crate::pipelines::can_blend;
use crate::wgsl;

/// Rejects descriptors that do not compile or would give wrong results.
pub(super) fn check(
    device: &wgpu::Device,
    descriptor: &OcclusionPassDescriptor,
) -> Result<(), PassError> {
    let with_axis = descriptor.output == Output::TransmittanceAndAxis;
    if with_axis && descriptor.mode == Mode::Occlusion {
        return Err(PassError::NoAxis);
    }
    let format = descriptor.target;
    let four_floats = [
        wgpu::TextureFormat::Rgba16Float,
        wgpu::TextureFormat::Rgba32Float,
    ];
    if !can_blend(device, format) {
        let need = " blend";
        return Err(PassError::Target { format, need });
    }
    if with_axis && !four_floats.contains(&format) {
        let need = " blend and hold four signed floats";
        return Err(PassError::Target { format, need });
    }
    Ok(())
}

/// Compiles the pipeline for grids of an encoding.
pub(super) fn new(
    device: &wgpu::Device,
    bindings: &GBufferBindings,
    draws: &OccluderDraws,
    descriptor: &OcclusionPassDescriptor,
    encoding: Encoding,
) -> wgpu::RenderPipeline {
    let [draw, grid] = draws.layouts();
    let grids_hold_cones = f64::from(u8::from(encoding.has_direction()));
    let mut constants = descriptor.reads().constants();
    constants.push(("grids_hold_cones", grids_hold_cones));
    let box_pipeline = BoxPipelineDescriptor {
        label: &descriptor.label,
        wgsl: wgsl::OCCLUSION_PASS,
        layouts: &[bindings.layout(), draw, grid],
        shape: ProxyShape::Box,
        fragment: match (descriptor.mode, descriptor.output) {
            (Mode::Occlusion, _) => "occlusion",
            (Mode::Cone, Output::Transmittance) => "cone",
            (Mode::Cone, Output::TransmittanceAndAxis) => "cone_with_axis",
        },
        constants: &constants,
        target: target(descriptor),
        depth: descriptor.gbuffer.depth,
        front_face: descriptor.front_face,
    };
    boxes::pipeline(device, &box_pipeline)
}

fn target(descriptor: &OcclusionPassDescriptor) -> wgpu::ColorTargetState {
    use wgpu::BlendFactor::{One, Src, SrcAlpha, Zero};
    let blend = |src_factor, dst_factor| wgpu::BlendComponent {
        src_factor,
        dst_factor,
        operation: wgpu::BlendOperation::Add,
    };
    let (color, alpha, write_mask) = match descriptor.output {
        // Only colors are written: multiplying directly into an image keeps its alpha.
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
