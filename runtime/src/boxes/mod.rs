//! The draws of the raster passes: a box per occluder, its uniforms at a dynamic offset, its grid.

mod pipeline;

use std::num::NonZeroU64;

use aogrid_grid_format::Encoding;
use bytemuck::{Pod, Zeroable};

use crate::frame::{Frame, PrepareError};
use crate::occluder::clip_from_box;
use crate::{AogridOccluder, GridTexture, Instance, InstanceError, grid_texture};

pub(crate) use pipeline::{BoxPipelineDescriptor, pipeline};

/// The depth test against the back faces of the boxes. It only saves work: the image is the same
/// with and without it. The attachment is read-only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthTest {
    /// The depth attachment's format.
    pub format: wgpu::TextureFormat,
    /// The comparison that passes back faces behind the stored depth: `GreaterEqual` if depth grows
    /// away from the viewer, `LessEqual` if it is reversed.
    pub compare: wgpu::CompareFunction,
}

/// The occluder draws of a frame, in the caller's order.
#[derive(Debug)]
pub(crate) struct OccluderDraws {
    draw_layout: wgpu::BindGroupLayout,
    grid_layout: wgpu::BindGroupLayout,
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
    draws: Vec<(wgpu::BindGroup, u32)>,
}

/// The uniforms of all draws, each at its dynamic offset.
pub(crate) struct Uniforms(Vec<u8>);

/// The uniforms of one draw: `Draw` in the WGSL.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Draw {
    clip_from_box: [[f32; 4]; 4],
    occluder: AogridOccluder,
}

/// The vertices of the triangle strip: `box_corner` in the WGSL.
const CORNERS: u32 = 14;

/// The capacity of the first buffer, in draws.
const INITIAL_DRAW_CAPACITY: usize = 16;

impl OccluderDraws {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let draw_layout = draw_layout(device);
        let buffer = draw_buffer(device, INITIAL_DRAW_CAPACITY);
        Self {
            group: draw_group(device, &draw_layout, &buffer),
            grid_layout: grid_texture::layout(device),
            draw_layout,
            buffer,
            draws: Vec::new(),
        }
    }

    /// The layouts of the second and third bind group.
    pub(crate) fn layouts(&self) -> [&wgpu::BindGroupLayout; 2] {
        [&self.draw_layout, &self.grid_layout]
    }

    /// The number of draws.
    pub(crate) fn len(&self) -> usize {
        self.draws.len()
    }

    /// Writes the uniforms of a frame. The buffer only grows.
    pub(crate) fn write(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Frame<'_>,
        Uniforms(bytes): &Uniforms,
    ) {
        let stride = stride(device);
        if bytes.len() as u64 > self.buffer.size() {
            let new_capacity = (bytes.len() / stride).next_power_of_two();
            let max_capacity = max_buffer_bytes(device) as usize / stride;
            self.buffer = draw_buffer(device, new_capacity.min(max_capacity));
            self.group = draw_group(device, &self.draw_layout, &self.buffer);
        }
        queue.write_buffer(&self.buffer, 0, bytes);
        let grids = frame.occluders.iter().map(|(grid, _)| grid.bind_group());
        self.draws = (0..)
            .map(|idx: u32| idx * stride as u32)
            .zip(grids)
            .map(|(offset, grid)| (grid.clone(), offset))
            .collect();
    }

    /// Draws all occluders; the caller has set the pipeline and the first bind group.
    pub(crate) fn draw_all(&self, pass: &mut wgpu::RenderPass<'_>) {
        // Consecutive instances of a grid share its bind group.
        let mut bound = None;
        for (grid, offset) in &self.draws {
            pass.set_bind_group(1, &self.group, &[*offset]);
            if bound != Some(grid) {
                pass.set_bind_group(2, grid, &[]);
                bound = Some(grid);
            }
            pass.draw(0..CORNERS, 0..1);
        }
    }

    /// Draws one occluder; the caller has set the pipeline and the first bind group.
    pub(crate) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, idx: usize) {
        let (grid, offset) = &self.draws[idx];
        pass.set_bind_group(1, &self.group, &[*offset]);
        pass.set_bind_group(2, grid, &[]);
        pass.draw(0..CORNERS, 0..1);
    }
}

impl Uniforms {
    pub(crate) fn new(
        device: &wgpu::Device,
        frame: &Frame<'_>,
        encoding: Encoding,
    ) -> Result<Self, PrepareError> {
        let stride = stride(device);
        let count = frame.occluders.len();
        if count.saturating_mul(stride) as u64 > max_buffer_bytes(device) {
            return Err(PrepareError::TooMany(count));
        }
        let mut bytes = vec![0; count * stride];
        for (idx, (grid, instance)) in frame.occluders.iter().enumerate() {
            if grid.encoding() != encoding {
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
        Ok(Self(bytes))
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

/// The distance between the uniforms of consecutive draws, in bytes.
fn stride(device: &wgpu::Device) -> usize {
    let alignment = device.limits().min_uniform_buffer_offset_alignment as usize;
    size_of::<Draw>().next_multiple_of(alignment)
}

/// The size of the largest buffer in which 32-bit dynamic offsets reach every byte.
fn max_buffer_bytes(device: &wgpu::Device) -> u64 {
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
    layout: &wgpu::BindGroupLayout,
    buffer: &wgpu::Buffer,
) -> wgpu::BindGroup {
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("aogrid occluders"),
        layout,
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

fn draw_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aogrid occluders"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: true,
                min_binding_size: NonZeroU64::new(size_of::<Draw>() as u64),
            },
            count: None,
        }],
    })
}
