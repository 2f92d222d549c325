//! The pipelines of the tiled pass.

use aogrid_grid_format::Encoding;

use super::{Combine, TiledPassDescriptor};
use crate::{Mode, Output, PassError, wgsl};

/// Rejects descriptors that do not compile or would give wrong results.
pub(super) fn check(descriptor: &TiledPassDescriptor) -> Result<(), PassError> {
    use wgpu::TextureFormat as F;
    if descriptor.mode == Mode::Occlusion && descriptor.needs_axes() {
        return Err(PassError::NoAxis);
    }
    let format = descriptor.target;
    let (formats, need): (&[F], _) = match descriptor.output {
        Output::Transmittance => (
            &[F::R32Float, F::Rgba16Float, F::Rgba32Float, F::Rgba8Unorm],
            " be one that every device can write from a shader: R32Float, Rgba16Float, \
             Rgba32Float or Rgba8Unorm",
        ),
        Output::TransmittanceAndAxis => (
            &[F::Rgba16Float, F::Rgba32Float],
            " hold four signed floats: Rgba16Float or Rgba32Float",
        ),
    };
    match formats.contains(&format) {
        true => Ok(()),
        false => Err(PassError::Target { format, need }),
    }
}

/// Compiles the pipeline that gathers the lists, which reads no grid.
pub(super) fn gather(
    device: &wgpu::Device,
    layouts: [&wgpu::BindGroupLayout; 3],
    descriptor: &TiledPassDescriptor,
) -> wgpu::ComputePipeline {
    new(device, "gather_tile", layouts, descriptor, Encoding::Cone)
}

/// Compiles the pipeline that shades pixels with grids of an encoding.
pub(super) fn shade(
    device: &wgpu::Device,
    layouts: [&wgpu::BindGroupLayout; 3],
    descriptor: &TiledPassDescriptor,
    encoding: Encoding,
) -> wgpu::ComputePipeline {
    new(device, "shade_pixels", layouts, descriptor, encoding)
}

fn new(
    device: &wgpu::Device,
    entry_point: &str,
    layouts: [&wgpu::BindGroupLayout; 3],
    descriptor: &TiledPassDescriptor,
    encoding: Encoding,
) -> wgpu::ComputePipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(&descriptor.label),
        source: wgpu::ShaderSource::Wgsl(wgsl::tiled_pass(name(descriptor.target)).into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(&descriptor.label),
        bind_group_layouts: &layouts.map(Some),
        immediate_size: 0,
    });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(&descriptor.label),
        layout: Some(&layout),
        module: &module,
        entry_point: Some(entry_point),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants: &constants(descriptor, encoding),
            // The kernel clears its workgroup memory itself.
            zero_initialize_workgroup_memory: false,
        },
        cache: None,
    })
}

/// The format's name in WGSL.
fn name(format: wgpu::TextureFormat) -> &'static str {
    use wgpu::TextureFormat as F;
    match format {
        F::Rgba16Float => "rgba16float",
        F::Rgba32Float => "rgba32float",
        F::Rgba8Unorm => "rgba8unorm",
        _ => "r32float",
    }
}

/// The values of the `override`s of the WGSL.
fn constants(descriptor: &TiledPassDescriptor, encoding: Encoding) -> Vec<(&'static str, f64)> {
    let flag = |yes: bool| f64::from(u8::from(yes));
    let shading = match (descriptor.mode, descriptor.combine, descriptor.output) {
        (Mode::Occlusion, _, _) => 0.0,
        (Mode::Cone, Combine::Multiply, Output::Transmittance) => 1.0,
        (Mode::Cone, Combine::Multiply, Output::TransmittanceAndAxis) => 2.0,
        (Mode::Cone, Combine::Merge, _) => 3.0,
        (Mode::Cone, Combine::Mean, _) => 4.0,
    };
    let writes_axis = descriptor.output == Output::TransmittanceAndAxis;
    let own = [
        ("shading", shading),
        ("writes_axis", flag(writes_axis)),
        ("grids_hold_cones", flag(encoding.has_direction())),
    ];
    [&descriptor.reads().constants()[..], &own].concat()
}
