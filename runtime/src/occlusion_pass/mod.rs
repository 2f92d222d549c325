//! The raster pass: the back faces of each occluder's box over a G-buffer, blended into a target
//! (RR-5779, 3.2).

mod pipeline;

use std::num::NonZeroU64;

use aogrid_grid_format::Encoding;
use bytemuck::{Pod, Zeroable};

use crate::occluder::{clip_from_box, world_from_clip};
use crate::{AogridOccluder, GridTexture, Instance, InstanceError, tables};

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

/// What the G-buffer's positions are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Positions {
    /// World positions in xyz of a float texture.
    World,
    /// Values of a depth buffer, as bound for reading, or in x of a float texture. Any
    /// projection, reversed or not, with wgpu's depth range 0..1 over the whole target.
    Depth,
}

/// How the G-buffer stores normals, which are of unit length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normals {
    /// As they are.
    Signed,
    /// (n + 1)/2, as in unorm formats.
    Unsigned,
}

/// What the G-buffer says of whose pixel it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Receivers {
    /// Nothing: every occluder shades every pixel, and none knows its own.
    None,
    /// The object's id in x of an unsigned integer texture.
    Ids,
    /// The object's id in x and its layers, a mask, in y.
    IdsAndLayers,
}

/// The depth test against the back faces of the boxes. It only saves pixels: the picture is the
/// same with and without it. The attachment is only read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthTest {
    /// The depth attachment's format.
    pub format: wgpu::TextureFormat,
    /// Which back faces lie behind what is there: `GreaterEqual` where depth grows away from
    /// the viewer, `LessEqual` where it is reversed.
    pub compare: wgpu::CompareFunction,
}

/// One frame's view of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// View and projection, in columns: perspective or orthographic, depth 0..1.
    pub clip_from_world: [[f32; 4]; 4],
    /// See [`Positions`].
    pub positions: &'a wgpu::TextureView,
    /// See [`Normals`]; none for [`Mode::Occlusion`].
    pub normals: Option<&'a wgpu::TextureView>,
    /// See [`Receivers`].
    pub receivers: Option<&'a wgpu::TextureView>,
    /// All occluders, wherever they are: those off screen shade what is on it. For the same
    /// bits each frame, in the same order each frame.
    pub occluders: &'a [(&'a GridTexture, Instance)],
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
    #[error("{format:?} cannot be the target: it must blend{need} on this device")]
    Target {
        /// The target's format.
        format: wgpu::TextureFormat,
        /// What else it must do.
        need: &'static str,
    },
}

/// Why a frame cannot be prepared.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// An occluder's transform or strength.
    #[error("occluder {occluder}: {source}")]
    Instance {
        /// Its place in [`Frame::occluders`].
        occluder: usize,
        /// What is wrong.
        source: InstanceError,
    },
    /// The camera's matrix has no inverse.
    #[error("clip_from_world cannot be inverted")]
    Camera,
    /// A grid of another encoding than the pass was made for.
    #[error("occluder {0}: its grid's encoding is not the one that the pass was made for")]
    Encoding(usize),
    /// A texture that the pass was made to read.
    #[error("the pass was made to read {0}, which the frame does not bring")]
    Missing(&'static str),
    /// More occluders than a buffer of the device holds.
    #[error("{0} occluders are more than a buffer of the device holds")]
    TooMany(usize),
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
    layouts: pipeline::Layouts,
    table: wgpu::TextureView,
    sampler: wgpu::Sampler,
    /// Stand in for textures that the descriptor leaves out.
    no_normals: wgpu::TextureView,
    no_receivers: wgpu::TextureView,
    frame_buffer: wgpu::Buffer,
    draw_buffer: wgpu::Buffer,
    draw_group: wgpu::BindGroup,
    frame_group: Option<(FrameViews, wgpu::BindGroup)>,
    draws: Vec<(wgpu::BindGroup, u32)>,
}

/// What the frame's bind group was made from.
#[derive(Debug, PartialEq)]
struct FrameViews([wgpu::TextureView; 3]);

/// The uniforms of one draw: `Draw` in the WGSL.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct Draw {
    clip_from_box: [[f32; 4]; 4],
    occluder: AogridOccluder,
}

/// Corners of the strip: `box_corner` in the WGSL.
const CORNERS: u32 = 14;

/// How many draws the first buffer holds.
const FIRST_DRAWS: usize = 16;

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
        let layouts = pipeline::Layouts::new(device);
        let draw_buffer = draw_buffer(device, FIRST_DRAWS);
        Ok(Self {
            pipeline: pipeline::new(device, &layouts, &descriptor),
            table: match descriptor.output {
                Output::Transmittance => tables::transmittance_table(device, queue),
                Output::TransmittanceAndAxis => tables::clip_table(device, queue),
            },
            sampler: tables::linear_clamp_sampler(device),
            no_normals: pipeline::nothing(device, wgpu::TextureFormat::Rgba8Unorm),
            no_receivers: pipeline::nothing(device, wgpu::TextureFormat::R32Uint),
            frame_buffer: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("aogrid frame"),
                size: size_of::<[[f32; 4]; 4]>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            draw_group: draw_group(device, &layouts, &draw_buffer),
            draw_buffer,
            frame_group: None,
            draws: Vec::new(),
            layouts,
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
        let views = self.views(frame)?;
        let world_from_clip =
            world_from_clip(frame.clip_from_world).map_err(|_| PrepareError::Camera)?;
        let draws = self.uniforms(device, frame)?;
        queue.write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&world_from_clip));
        self.write_draws(device, queue, &draws);
        self.bind_frame(device, views);
        let stride = stride(device) as u32;
        let grids = frame.occluders.iter().map(|(grid, _)| grid.bind_group());
        self.draws = (0..)
            .map(|idx: u32| idx * stride)
            .zip(grids)
            .map(|(offset, grid)| (grid.clone(), offset))
            .collect();
        Ok(())
    }

    /// Draws all occluders that were prepared. The render pass has the target as its only
    /// colour attachment, and the depth attachment, to be read only, if there is a depth test.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let Some((_, frame_group)) = &self.frame_group else {
            return;
        };
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, frame_group, &[]);
        let mut bound = None;
        for (grid, offset) in &self.draws {
            pass.set_bind_group(1, &self.draw_group, &[*offset]);
            if bound != Some(grid) {
                pass.set_bind_group(2, grid, &[]);
                bound = Some(grid);
            }
            pass.draw(0..CORNERS, 0..1);
        }
    }

    fn views(&self, frame: &Frame<'_>) -> Result<FrameViews, PrepareError> {
        let normals = match (self.descriptor.mode, frame.normals) {
            (_, Some(view)) => view,
            (Mode::Occlusion, None) => &self.no_normals,
            (Mode::Cone, None) => return Err(PrepareError::Missing("normals")),
        };
        let receivers = match (self.descriptor.receivers, frame.receivers) {
            (Receivers::None, _) => &self.no_receivers,
            (_, Some(view)) => view,
            (_, None) => return Err(PrepareError::Missing("receivers")),
        };
        Ok(FrameViews(
            [frame.positions, normals, receivers].map(Clone::clone),
        ))
    }

    /// The bytes of all draws, each at its dynamic offset.
    fn uniforms(&self, device: &wgpu::Device, frame: &Frame<'_>) -> Result<Vec<u8>, PrepareError> {
        let stride = stride(device);
        let count = frame.occluders.len();
        if count.saturating_mul(stride) as u64 > most_bytes(device) {
            return Err(PrepareError::TooMany(count));
        }
        let mut bytes = vec![0; count * stride];
        for (idx, (grid, instance)) in frame.occluders.iter().enumerate() {
            if grid.encoding() != self.descriptor.encoding {
                return Err(PrepareError::Encoding(idx));
            }
            let draw = Draw::new(frame.clip_from_world, grid, instance).map_err(|source| {
                PrepareError::Instance {
                    occluder: idx,
                    source,
                }
            })?;
            bytes[idx * stride..][..size_of::<Draw>()].copy_from_slice(bytemuck::bytes_of(&draw));
        }
        Ok(bytes)
    }

    fn write_draws(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, bytes: &[u8]) {
        if bytes.len() as u64 > self.draw_buffer.size() {
            let wanted = (bytes.len() / stride(device)).next_power_of_two();
            let most = most_bytes(device) as usize / stride(device);
            self.draw_buffer = draw_buffer(device, wanted.min(most));
            self.draw_group = draw_group(device, &self.layouts, &self.draw_buffer);
        }
        queue.write_buffer(&self.draw_buffer, 0, bytes);
    }

    fn bind_frame(&mut self, device: &wgpu::Device, views: FrameViews) {
        if self
            .frame_group
            .as_ref()
            .is_some_and(|(old, _)| *old == views)
        {
            return;
        }
        let [positions, normals, receivers] = &views.0;
        let view = wgpu::BindingResource::TextureView;
        let resources = [
            self.frame_buffer.as_entire_binding(),
            view(positions),
            view(normals),
            view(receivers),
            view(&self.table),
            wgpu::BindingResource::Sampler(&self.sampler),
        ];
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("aogrid frame"),
            layout: &self.layouts.frame,
            entries: &entries,
        });
        self.frame_group = Some((views, group));
    }
}

impl Draw {
    fn new(
        clip_from_world: [[f32; 4]; 4],
        grid: &GridTexture,
        instance: &Instance,
    ) -> Result<Self, InstanceError> {
        Ok(Self {
            clip_from_box: clip_from_box(clip_from_world, grid.spec(), instance)?,
            occluder: AogridOccluder::new(grid.spec(), grid.format(), instance)?,
        })
    }
}

/// Bytes from one draw's uniforms to the next's.
fn stride(device: &wgpu::Device) -> usize {
    let alignment = device.limits().min_uniform_buffer_offset_alignment as usize;
    size_of::<Draw>().next_multiple_of(alignment)
}

/// The largest buffer whose every byte a dynamic offset, 32 bits, reaches.
fn most_bytes(device: &wgpu::Device) -> u64 {
    device.limits().max_buffer_size.min(u64::from(u32::MAX))
}

fn draw_buffer(device: &wgpu::Device, draws: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("aogrid occluders"),
        size: (draws * stride(device)) as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn draw_group(
    device: &wgpu::Device,
    layouts: &pipeline::Layouts,
    buffer: &wgpu::Buffer,
) -> wgpu::BindGroup {
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("aogrid occluders"),
        layout: &layouts.draw,
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer,
                offset: 0,
                size: NonZeroU64::new(size_of::<Draw>() as u64),
            }),
        }],
    })
}
