//! The tiled pass: compute dispatches in which each pixel walks the occluders near its tile.

mod buffers;
mod pipeline;

use aogrid_grid_format::Encoding;

use crate::frame::PrepareError;
use crate::gbuffer::{GBufferBindings, GBufferFormat, GBufferReads, GBufferViews};
use crate::pipelines::PipelinesByEncoding;
use crate::{GridAtlas, Instance, Mode, Output, PassError, tables};
use buffers::{Buffers, FrameData};

pub use buffers::{AogridAtlasOccluder, AogridTiles};

/// The inputs and outputs of a [`TiledPass`]. Everything here is compiled into its
/// pipelines.
#[derive(Clone, Debug)]
pub struct TiledPassDescriptor {
    /// Names the pass in graphics debuggers.
    pub label: String,
    /// The shading mode.
    pub mode: Mode,
    /// The combination of several occluders.
    pub combine: Combine,
    /// The quantities that are written to the target.
    pub output: Output,
    /// The target's format: `R32Float`, `Rgba16Float` or `Rgba32Float`; for a transmittance alone
    /// also `Rgba8Unorm`, as each pixel is written only once.
    pub target: wgpu::TextureFormat,
    /// The contents of the G-buffer.
    pub gbuffer: GBufferFormat,
}

/// The combination of several occluders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Combine {
    /// The product of all 1 − AO: correct for objects that do not overlap as seen from the
    /// receiver, in any order.
    Multiply,
    /// The union of their cones, in the caller's order: for parts that touch or overlap.
    Merge,
    /// The mean of both transmittances, in the caller's order: where some overlap and some do not.
    Mean,
}

/// The G-buffer, occluders and target of one frame.
#[derive(Clone, Copy, Debug)]
pub struct TiledFrame<'a> {
    /// The camera and the G-buffer's textures. A pixel without a surface has a position of NaN or
    /// infinity, or the depth of a cleared buffer, 0 or 1; such a pixel adds no occluder to the
    /// lists.
    pub gbuffer: GBufferViews<'a>,
    /// All grids.
    pub atlas: &'a GridAtlas,
    /// All occluders, including those off screen, up to [`TiledPass::MAX_OCCLUDERS`]: the index of
    /// each one's grid in the list from which the atlas was created, and its instance. They are
    /// processed in this order.
    pub occluders: &'a [(usize, Instance)],
    /// The target, of the size of the positions and with `STORAGE_BINDING`. Every pixel is written.
    pub target: &'a wgpu::TextureView,
}

/// The tiled pass. Create it once, prepare it once a frame, dispatch it in your own compute pass:
/// it creates no device, submits nothing and never waits.
///
/// A tile is [`AOGRID_TILE`](crate::AOGRID_TILE)² pixels. The first dispatch gathers for each tile
/// the occluders whose box both covers it on screen and meets the bounds of its receivers in world
/// space, one bit each. In the second, every pixel walks its tile's list with the running cone in
/// registers. Other shaders may walk the same lists.
///
/// It needs no features beyond those of an f32 grid; WebGPU's default limits suffice.
#[derive(Debug)]
pub struct TiledPass {
    descriptor: TiledPassDescriptor,
    gather: wgpu::ComputePipeline,
    shade: PipelinesByEncoding<wgpu::ComputePipeline>,
    /// The encoding of the prepared atlas.
    encoding: Option<Encoding>,
    bindings: GBufferBindings,
    buffers: Buffers,
}

/// The side length of a workgroup, in invocations: `SIDE` in the WGSL.
const SIDE: u32 = 8;

impl TiledPass {
    /// The maximum number of occluders in a frame.
    pub const MAX_OCCLUDERS: usize = 32 * crate::wgsl::AOGRID_TILE_WORDS as usize;

    /// Compiles the pipeline of the lists and uploads the tables. That of the shading is compiled by
    /// the first frame whose atlas needs it.
    ///
    /// # Errors
    ///
    /// If the descriptor is inconsistent.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        descriptor: TiledPassDescriptor,
    ) -> Result<Self, PassError> {
        pipeline::check(&descriptor)?;
        let clip_table_view = tables::clip_table(device, queue);
        let table = match descriptor.needs_axes() {
            true => clip_table_view.clone(),
            false => tables::transmittance_table(device, queue),
        };
        let bindings = GBufferBindings::new(device, descriptor.reads(), table);
        let overlap_table = tables::intersection_table(device, queue);
        let buffers = Buffers::new(device, descriptor.target, [clip_table_view, overlap_table]);
        let layouts = [
            bindings.layout(),
            buffers.common_layout(),
            buffers.gather_layout(),
        ];
        Ok(Self {
            gather: pipeline::gather(device, layouts, &descriptor),
            shade: PipelinesByEncoding::new(),
            encoding: None,
            bindings,
            buffers,
            descriptor,
        })
    }

    /// Writes the frame that [`TiledPass::dispatch`] will shade. The writes take effect with the
    /// queue's next submission; the last call before a submission counts.
    ///
    /// # Errors
    ///
    /// If the frame cannot be shaded; the last valid frame is kept.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &TiledFrame<'_>,
    ) -> Result<(), PrepareError> {
        let validated = self.bindings.check(&frame.gbuffer)?;
        let frame_data = FrameData::new(device, frame, self.descriptor.mode)?;
        let encoding = frame.atlas.encoding();
        self.shade.require(encoding, || {
            let layouts = [
                self.bindings.layout(),
                self.buffers.common_layout(),
                self.buffers.shade_layout(),
            ];
            pipeline::shade(device, layouts, &self.descriptor, encoding)
        });
        self.encoding = Some(encoding);
        self.bindings.write(device, queue, validated);
        self.buffers.write(device, queue, frame, &frame_data);
        Ok(())
    }

    /// Gathers the lists of the prepared frame and shades every pixel once, in two dispatches.
    pub fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>) {
        let shade = self.encoding.and_then(|encoding| self.shade.get(encoding));
        let (Some(frame), Some(groups), Some(shade)) =
            (self.bindings.group(), self.buffers.groups(), shade)
        else {
            return;
        };
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(1, &groups.common, &[]);
        pass.set_pipeline(&self.gather);
        pass.set_bind_group(2, &groups.gather, &[]);
        let [across, down] = self.buffers.tiles().tiles();
        pass.dispatch_workgroups(across, down, 1);
        pass.set_pipeline(shade);
        pass.set_bind_group(2, &groups.shade, &[]);
        let [across, down] = self.buffers.tiles().size.map(|n| n.div_ceil(SIDE));
        pass.dispatch_workgroups(across, down, 1);
    }

    /// The bind group with which [`wgsl::tile_lists`](crate::wgsl::tile_lists) reads this frame's
    /// lists, for fragment and compute shaders that run after the dispatch; none before the first
    /// frame.
    pub fn lists(&self) -> Option<&wgpu::BindGroup> {
        self.buffers.groups().map(|groups| &groups.lists)
    }

    /// The layout of the bind group that [`TiledPass::lists`] returns.
    pub fn lists_layout(&self) -> &wgpu::BindGroupLayout {
        self.buffers.lists_layout()
    }
}

impl TiledPassDescriptor {
    fn needs_axes(&self) -> bool {
        self.combine != Combine::Multiply || self.output == Output::TransmittanceAndAxis
    }

    fn reads(&self) -> GBufferReads {
        GBufferReads {
            format: self.gbuffer,
            normals: self.mode == Mode::Cone,
        }
    }
}
