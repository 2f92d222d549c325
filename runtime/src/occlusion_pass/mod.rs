//! The raster pass: the back faces of each occluder's box over a G-buffer, blended into a target
//! (RR-5779, 3.2).

mod pipeline;

use aogrid_grid_format::Encoding;

use crate::boxes::{Boxes, DepthTest, Uniforms};
use crate::frame::{Bindings, Frame, Normals, Positions, PrepareError, Reads, Receivers};
use crate::tables;

/// What an [`OcclusionPass`] reads and writes. Everything here is compiled into its pipeline.
#[derive(Clone, Debug)]
pub struct OcclusionPassDescriptor {
    /// Names the pass in graphics debuggers.
    pub label: String,
    /// How a grid is shaded.
    pub mode: Mode,
    /// What the target accumulates.
    pub output: Output,
    /// The target's format: one that blends, wider than 8 bits wherever many occluders overlap.
    pub target: wgpu::TextureFormat,
    /// What the G-buffer's positions are.
    pub positions: Positions,
    /// How the G-buffer stores normals.
    pub normals: Normals,
    /// What the G-buffer says of whose pixel it is.
    pub receivers: Receivers,
    /// Skips pixels whose receiver lies behind an occluder's box; none: no depth buffer.
    pub depth: Option<DepthTest>,
    /// The winding of faces seen from outside in your right-handed pipelines; `Ccw` unless your
    /// projection mirrors the picture.
    pub front_face: wgpu::FrontFace,
    /// The encoding of all the grids that it will be given.
    pub encoding: Encoding,
}

/// How a grid is shaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Without regard to the receiver's normal: cheapest, and it leaks through walls
    /// (RR-5779, 4). Of either encoding.
    Occlusion,
    /// The cone, clipped by the receiver's tangent plane (RR-5779, 5.1). Grids with cones only.
    Cone,
}

/// What the target accumulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// The product of all 1 − AO, in every colour channel that the target has. Clear it to 1.
    Transmittance,
    /// The same in alpha, and in the others the sum of all (AO/2) d′ (RR-5779, 5.2.1), which
    /// points to what is occluded: for light from an environment. Clear it to 0, alpha to 1.
    TransmittanceAndAxis,
}

/// Why a pass cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PassError {
    /// Cones are asked of grids without.
    #[error("grids with occlusion alone cannot be shaded as cones: bake with --encoding cone")]
    NoCones,
    /// Axes are signed, and there are none without a cone.
    #[error("axes come from cones: use Mode::Cone")]
    NoAxis,
    /// The target cannot hold or blend what is written.
    #[error("{format:?} cannot be the target: it must{need} on this device")]
    Target {
        /// The target's format.
        format: wgpu::TextureFormat,
        /// What else it must do.
        need: &'static str,
    },
}

/// The raster pass. Make it once, prepare it once a frame, draw it in a render pass of yours:
/// it creates no device, submits nothing and waits for nothing.
///
/// It needs no feature but what the chosen formats do; with `DEPTH_CLIP_CONTROL` the depth test
/// also keeps boxes that reach beyond the far plane. Limits: those of WebGPU's defaults.
#[derive(Debug)]
pub struct OcclusionPass {
    descriptor: OcclusionPassDescriptor,
    pipeline: wgpu::RenderPipeline,
    bindings: Bindings,
    boxes: Boxes,
}

impl OcclusionPass {
    /// Compiles the pipeline and uploads T_clip.
    ///
    /// # Errors
    ///
    /// A descriptor whose parts do not fit each other or the device.
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
        let bindings = Bindings::new(device, descriptor.reads(), table);
        let boxes = Boxes::new(device);
        Ok(Self {
            pipeline: pipeline::new(device, &bindings, &boxes, &descriptor),
            bindings,
            boxes,
            descriptor,
        })
    }

    /// What the target is to be cleared to before the draw.
    pub fn clear_color(&self) -> wgpu::Color {
        match self.descriptor.output {
            Output::Transmittance => wgpu::Color::WHITE,
            Output::TransmittanceAndAxis => wgpu::Color::BLACK,
        }
    }

    /// Writes what [`OcclusionPass::draw`] will draw: the writes are made with the queue's next
    /// submission. The last call before a submission counts.
    ///
    /// # Errors
    ///
    /// A frame that cannot be drawn; the last one that could stays.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Frame<'_>,
    ) -> Result<(), PrepareError> {
        let checked = self.bindings.check(&frame.view())?;
        let uniforms = Uniforms::new(device, frame, self.descriptor.encoding)?;
        self.bindings.write(device, queue, checked);
        self.boxes.write(device, queue, frame, &uniforms);
        Ok(())
    }

    /// Draws all occluders that were prepared. The render pass has the target as its only
    /// colour attachment, and the depth attachment, to be read only, if there is a depth test.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let Some(frame) = self.bindings.group() else {
            return;
        };
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, frame, &[]);
        self.boxes.draw_all(pass);
    }
}

impl OcclusionPassDescriptor {
    fn reads(&self) -> Reads {
        Reads {
            positions: self.positions,
            normals: match self.mode {
                Mode::Occlusion => None,
                Mode::Cone => Some(self.normals),
            },
            receivers: self.receivers,
        }
    }
}
