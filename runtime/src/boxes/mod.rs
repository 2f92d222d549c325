//! The draws of the raster passes: a box per occluder, its uniforms at a dynamic offset, its grid.

mod pipeline;

use std::num::NonZeroU64;

use aogrid_grid_format::Encoding;
use bytemuck::{Pod, Zeroable};

use crate::frame::{Frame, PrepareError};
use crate::occluder::clip_from_box;
use crate::pipelines::PipelinesByEncoding;
use crate::{AogridOccluder, GridTexture, Instance, InstanceError, grid_texture};

pub(crate) use pipeline::{BoxPipelineDescriptor, ProxyShape, pipeline};

/// The occluder draws of a frame, in the caller's order.
#[derive(Debug)]
pub(crate) struct OccluderDraws {
    draw_layout: wgpu::BindGroupLayout,
    grid_layout: wgpu::BindGroupLayout,
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
    draws: Vec<BoxDraw>,
}

/// The draw of one box.
#[derive(Debug)]
struct BoxDraw {
    grid: wgpu::BindGroup,
    encoding: Encoding,
    /// The offset of its uniforms in bytes.
    offset: u32,
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
        let box_draw = |(idx, (grid, _)): (u32, &(&GridTexture, Instance))| BoxDraw {
            grid: grid.bind_group().clone(),
            encoding: grid.encoding(),
            offset: idx * stride as u32,
        };
        self.draws = (0..).zip(frame.occluders).map(box_draw).collect();
    }

    /// Draws all occluders with the pipelines of their grids' encodings; the caller has set the
    /// first bind group.
    pub(crate) fn draw_all(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipelines: &PipelinesByEncoding<wgpu::RenderPipeline>,
    ) {
        // Consecutive instances of a grid share its bind group, and most grids an encoding.
        let (mut bound, mut compiled_for) = (None, None);
        for BoxDraw {
            grid,
            encoding,
            offset,
        } in &self.draws
        {
            if compiled_for != Some(*encoding) {
                let Some(pipeline) = pipelines.get(*encoding) else {
                    continue;
                };
                pass.set_pipeline(pipeline);
                compiled_for = Some(*encoding);
            }
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
        let BoxDraw { grid, offset, .. } = &self.draws[idx];
        pass.set_bind_group(1, &self.group, &[*offset]);
        pass.set_bind_group(2, grid, &[]);
        pass.draw(0..CORNERS, 0..1);
    }
}

impl Uniforms {
    pub(crate) fn new(device: &wgpu::Device, frame: &Frame<'_>) -> Result<Self, PrepareError> {
        let stride = stride(device);
        let count = frame.occluders.len();
        if count.saturating_mul(stride) as u64 > max_buffer_bytes(device) {
            return Err(PrepareError::TooMany(count));
        }
        let mut bytes = vec![0; count * stride];
        for (idx, (grid, instance)) in frame.occluders.iter().enumerate() {
            let camera = frame.gbuffer.clip_from_world;
            let draw =
                Draw::new(camera, grid, instance).map_err(|source| PrepareError::Instance {
                    occluder: idx,
                    source,
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
            clip_from_box: clip_from_box(clip_from_world, grid.facts(), instance)?,
            occluder: grid.occluder(instance)?,
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
