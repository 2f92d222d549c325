//! The raster pass: draws the back faces of each occluder's box over a G-buffer, blended into a
//! target (RR-5779, 3.2).

mod pipeline;

use crate::boxes::{OccluderDraws, Uniforms};
use crate::frame::{Frame, PrepareError};
use crate::gbuffer::{GBufferBindings, GBufferFormat, GBufferReads};
use crate::pipelines::PipelinesByEncoding;
use crate::tables;

/// The inputs and outputs of an [`OcclusionPass`]. Everything here is compiled into its
/// pipelines.
#[derive(Clone, Debug)]
pub struct OcclusionPassDescriptor {
    /// Names the pass in graphics debuggers.
    pub label: String,
    /// The shading mode.
    pub mode: Mode,
    /// The quantities that the target accumulates.
    pub output: Output,
    /// The target's format: blendable, and wider than 8 bits if many occluders overlap.
    pub target: wgpu::TextureFormat,
    /// The contents of the G-buffer.
    pub gbuffer: GBufferFormat,
    /// The winding of faces seen from outside in your right-handed pipelines; `Ccw` unless your
    /// projection mirrors the image.
    pub front_face: wgpu::FrontFace,
}

/// The shading mode of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Occlusion alone, independent of the receiver's normal: the cheapest mode, but it leaks
    /// through walls (RR-5779, 4). Accepts grids of either encoding.
    Occlusion,
    /// The cone, clipped by the receiver's tangent plane (RR-5779, 5.1). Accepts only grids with
    /// cones.
    Cone,
}

/// The quantities that the target accumulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// The product of all 1 − AO, in every color channel of the target. Clear it to 1.
    Transmittance,
    /// The same in alpha, and the sum of all (AO/2) d′ in rgb (RR-5779, 5.2.1), which points
    /// towards the occluded directions: for environment light. Clear it to 0, alpha to 1.
    TransmittanceAndAxis,
}

/// The reasons why a pass cannot be created.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PassError {
    /// Axes are requested without cone shading.
    #[error("axes come from cones: use Mode::Cone")]
    NoAxis,
    /// The target's format cannot hold or blend the output.
    #[error("{format:?} cannot be the target: it must{need} on this device")]
    Target {
        /// The target's format.
        format: wgpu::TextureFormat,
        /// The missing capability.
        need: &'static str,
    },
}

/// The raster pass. Create it once, prepare it once a frame, draw it in your own render pass: it
/// creates no device, submits nothing and never waits.
///
/// It needs no features beyond those of the chosen formats; with `DEPTH_CLIP_CONTROL` the depth
/// test also keeps boxes that reach beyond the far plane. WebGPU's default limits suffice.
#[derive(Debug)]
pub struct OcclusionPass {
    descriptor: OcclusionPassDescriptor,
    pipelines: PipelinesByEncoding<wgpu::RenderPipeline>,
    bindings: GBufferBindings,
    draws: OccluderDraws,
}

impl OcclusionPass {
    /// Uploads T_clip. Pipelines are compiled by the first frame whose grids need them.
    ///
    /// # Errors
    ///
    /// If the descriptor is inconsistent, or the device does not support the target.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        descriptor: OcclusionPassDescriptor,
    ) -> Result<Self, PassError> {
        pipeline::check(device, &descriptor)?;
        let table = match descriptor.output {
            Output::Transmittance => tables::transmittance_table(device, queue),
            Output::TransmittanceAndAxis => tables::clip_table(device, queue),
        };
        Ok(Self {
            pipelines: PipelinesByEncoding::new(),
            bindings: GBufferBindings::new(device, descriptor.reads(), table),
            draws: OccluderDraws::new(device),
            descriptor,
        })
    }

    /// The color to which the target must be cleared before the draw.
    pub fn clear_color(&self) -> wgpu::Color {
        match self.descriptor.output {
            Output::Transmittance => wgpu::Color::WHITE,
            Output::TransmittanceAndAxis => wgpu::Color::BLACK,
        }
    }

    /// Writes the frame that [`OcclusionPass::draw`] will draw. The writes take effect with the
    /// queue's next submission; the last call before a submission counts.
    ///
    /// # Errors
    ///
    /// If the frame cannot be drawn; the last valid frame is kept.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Frame<'_>,
    ) -> Result<(), PrepareError> {
        let validated = self.bindings.check(&frame.gbuffer)?;
        if self.descriptor.mode == Mode::Cone {
            frame.require_cones()?;
        }
        let uniforms = Uniforms::new(device, frame)?;
        for (grid, _) in frame.occluders {
            let encoding = grid.encoding();
            self.pipelines.require(encoding, || {
                pipeline::new(
                    device,
                    &self.bindings,
                    &self.draws,
                    &self.descriptor,
                    encoding,
                )
            });
        }
        self.bindings.write(device, queue, validated);
        self.draws.write(device, queue, frame, &uniforms);
        Ok(())
    }

    /// Draws all prepared occluders. The render pass has the target as its only color attachment
    /// and, if there is a depth test, a read-only depth attachment.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let Some(frame) = self.bindings.group() else {
            return;
        };
        pass.set_bind_group(0, frame, &[]);
        self.draws.draw_all(pass, &self.pipelines);
    }
}

impl OcclusionPassDescriptor {
    fn reads(&self) -> GBufferReads {
        GBufferReads {
            format: self.gbuffer,
            normals: self.mode == Mode::Cone,
        }
    }
}
