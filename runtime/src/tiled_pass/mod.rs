//! The tiled pass: compute dispatches in which each pixel walks the occluders near its tile.

mod buffers;
mod pipeline;

use aogrid_grid_format::Encoding;

use crate::frame::{Bindings, Normals, Positions, PrepareError, Reads, Receivers, View};
use crate::{GridAtlas, Instance, Mode, Output, PassError, tables};
use buffers::{Buffers, Contents};

pub use buffers::{AogridAtlasOccluder, AogridTiles};

/// What a [`TiledPass`] reads and writes. Everything here is compiled into its pipeline.
#[derive(Clone, Debug)]
pub struct TiledPassDescriptor {
    /// Names the pass in graphics debuggers.
    pub label: String,
    /// How a grid is shaded.
    pub mode: Mode,
    /// How occluders are combined.
    pub combine: Combine,
    /// What the target takes.
    pub output: Output,
    /// The target's format: `R32Float`, `Rgba16Float` or `Rgba32Float`, and for a transmittance alone
    /// `Rgba8Unorm`, too, as each pixel is written but once.
    pub target: wgpu::TextureFormat,
    /// What the G-buffer's positions are.
    pub positions: Positions,
    /// How the G-buffer stores normals.
    pub normals: Normals,
    /// What the G-buffer says of whose pixel it is.
    pub receivers: Receivers,
    /// The encoding of the atlases that it will be given.
    pub encoding: Encoding,
}

/// How occluders are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Combine {
    /// The product of all 1 − AO: right for objects that do not overlap as seen from the receiver,
    /// whatever their order.
    Multiply,
    /// The union of their cones, in the caller's order: for parts that touch or overlap.
    Merge,
}

/// One frame's view of the scene.
#[derive(Clone, Copy, Debug)]
pub struct TiledFrame<'a> {
    /// View and projection, in columns: perspective or orthographic, depth 0..1.
    pub clip_from_world: [[f32; 4]; 4],
    /// See [`Positions`]. Where nothing is, NaN or infinite, or the depth of a cleared buffer; such
    /// a depth, 0 or 1, keeps no occluder of the lists.
    pub positions: &'a wgpu::TextureView,
    /// See [`Normals`]; none for [`Mode::Occlusion`].
    pub normals: Option<&'a wgpu::TextureView>,
    /// See [`Receivers`].
    pub receivers: Option<&'a wgpu::TextureView>,
    /// All grids.
    pub atlas: &'a GridAtlas,
    /// All occluders, wherever they are, up to [`TiledPass::MOST_OCCLUDERS`]: the place of each
    /// one's grid in the list that the atlas was made from, and where it stands. They are walked in
    /// this order.
    pub occluders: &'a [(usize, Instance)],
    /// As large as the positions, with `STORAGE_BINDING`. Every pixel of it is written.
    pub target: &'a wgpu::TextureView,
}

/// The tiled pass. Make it once, prepare it once a frame, dispatch it in a compute pass of yours: it
/// creates no device, submits nothing and waits for nothing.
///
/// A tile is [`AOGRID_TILE`](crate::AOGRID_TILE)² pixels. It gathers the occluders whose box both
/// covers it on screen and meets the bounds of its receivers in the world, one bit each; every pixel
/// then walks them with the running cone in registers. Other shaders may walk the same lists.
///
/// It needs no feature but what an f32 grid does; limits: those of WebGPU's defaults.
#[derive(Debug)]
pub struct TiledPass {
    descriptor: TiledPassDescriptor,
    gather: wgpu::ComputePipeline,
    shade: wgpu::ComputePipeline,
    bindings: Bindings,
    buffers: Buffers,
}

/// Lanes along a side of the workgroups that shade: `SIDE` in the WGSL.
const SIDE: u32 = 8;

impl TiledPass {
    /// The most occluders of a frame.
    pub const MOST_OCCLUDERS: usize = 32 * crate::wgsl::AOGRID_TILE_WORDS as usize;

    /// Compiles the pipeline and uploads the tables.
    ///
    /// # Errors
    ///
    /// A descriptor whose parts do not fit each other.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        descriptor: TiledPassDescriptor,
    ) -> Result<Self, PassError> {
        pipeline::check(&descriptor)?;
        let whole = tables::clip_table(device, queue);
        let table = match descriptor.needs_axes() {
            true => whole.clone(),
            false => tables::transmittance_table(device, queue),
        };
        let bindings = Bindings::new(device, descriptor.reads(), table);
        let shared = tables::intersection_table(device, queue);
        let buffers = Buffers::new(device, descriptor.target, [whole, shared]);
        let pipeline = |entry_point, own| {
            let layouts = [bindings.layout(), buffers.common_layout(), own];
            pipeline::new(device, entry_point, layouts, &descriptor)
        };
        Ok(Self {
            gather: pipeline("gather_tile", buffers.gather_layout()),
            shade: pipeline("shade_pixels", buffers.shade_layout()),
            bindings,
            buffers,
            descriptor,
        })
    }

    /// Writes what [`TiledPass::dispatch`] will shade: the writes are made with the queue's next
    /// submission. The last call before a submission counts.
    ///
    /// # Errors
    ///
    /// A frame that cannot be shaded; the last one that could stays.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &TiledFrame<'_>,
    ) -> Result<(), PrepareError> {
        let view = View {
            clip_from_world: frame.clip_from_world,
            positions: frame.positions,
            normals: frame.normals,
            receivers: frame.receivers,
        };
        let checked = self.bindings.check(&view)?;
        let contents = Contents::new(device, frame, &self.descriptor)?;
        self.bindings.write(device, queue, checked);
        self.buffers.write(device, queue, frame, &contents);
        Ok(())
    }

    /// Gathers the lists of what was prepared, and shades every pixel once: two dispatches.
    pub fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>) {
        let (Some(frame), Some(groups)) = (self.bindings.group(), self.buffers.groups()) else {
            return;
        };
        pass.set_bind_group(0, frame, &[]);
        pass.set_bind_group(1, &groups.common, &[]);
        pass.set_pipeline(&self.gather);
        pass.set_bind_group(2, &groups.gather, &[]);
        let [across, down] = self.buffers.tiles().tiles();
        pass.dispatch_workgroups(across, down, 1);
        pass.set_pipeline(&self.shade);
        pass.set_bind_group(2, &groups.shade, &[]);
        let [across, down] = self.buffers.tiles().size.map(|n| n.div_ceil(SIDE));
        pass.dispatch_workgroups(across, down, 1);
    }

    /// The bind group with which [`wgsl::tile_lists`](crate::wgsl::tile_lists) reads this frame's
    /// lists, for fragment and compute shaders that run after the dispatch. None before the first
    /// frame.
    pub fn lists(&self) -> Option<&wgpu::BindGroup> {
        self.buffers.groups().map(|groups| &groups.lists)
    }

    /// The layout of that bind group.
    pub fn lists_layout(&self) -> &wgpu::BindGroupLayout {
        self.buffers.lists_layout()
    }
}

impl TiledPassDescriptor {
    fn needs_axes(&self) -> bool {
        self.combine == Combine::Merge || self.output == Output::TransmittanceAndAxis
    }

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
