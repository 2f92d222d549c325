//! The draws of the volume pass: the uniforms of each object at a dynamic offset, and its buffers.

use std::num::NonZeroU64;

use bytemuck::{Pod, Zeroable};

use super::{VolumeFrame, VolumeFrameError, VolumeObject, VolumeResolution};
use crate::AogridVolume;
use crate::occluder::world_from_object;

/// The vertices of a prism: `prism` in the WGSL.
const CORNERS: u32 = 60;

/// The object draws of a frame, in the caller's order.
#[derive(Debug)]
pub(super) struct ObjectDraws {
    object_layout: wgpu::BindGroupLayout,
    geometry_layout: wgpu::BindGroupLayout,
    buffer: wgpu::Buffer,
    draws: Vec<ObjectDraw>,
}

/// The draw of one object.
#[derive(Debug)]
struct ObjectDraw {
    object: wgpu::BindGroup,
    geometry: wgpu::BindGroup,
    triangles: u32,
}

/// The uniforms of all objects, each at its offset.
pub(super) struct Uniforms(Vec<u8>);

/// The uniforms of one object: `Object` in the WGSL.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Object {
    pub(super) clip_from_world: [[f32; 4]; 4],
    pub(super) world_x: [f32; 4],
    pub(super) world_y: [f32; 4],
    pub(super) world_z: [f32; 4],
    pub(super) excluded: [u32; 4],
    pub(super) volume: AogridVolume,
    pub(super) layers: u32,
    pub(super) strength: f32,
    pub(super) stride: u32,
    pub(super) is_mirrored: u32,
}

impl ObjectDraws {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let uniform = wgpu::BufferBindingType::Uniform;
        let storage = wgpu::BufferBindingType::Storage { read_only: true };
        Self {
            object_layout: layout(device, &[(uniform, size_of::<Object>())]),
            geometry_layout: layout(device, &[(storage, 4), (storage, 4)]),
            buffer: uniform_buffer(device, stride(device)),
            draws: Vec::new(),
        }
    }

    /// The layouts of the second and third bind group.
    pub(super) fn layouts(&self) -> [&wgpu::BindGroupLayout; 2] {
        [&self.object_layout, &self.geometry_layout]
    }

    /// Writes the uniforms of a frame. The buffer only grows.
    pub(super) fn write(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &VolumeFrame<'_>,
        Uniforms(bytes): &Uniforms,
    ) {
        if bytes.len() as u64 > self.buffer.size() {
            self.buffer = uniform_buffer(device, bytes.len());
        }
        queue.write_buffer(&self.buffer, 0, bytes);
        // A draw without triangles would bind buffers that may be empty.
        let drawn = frame.objects.iter().enumerate();
        let drawn = drawn.filter(|(_, object)| object.triangles > 0);
        self.draws = drawn
            .map(|(idx, object)| self.object_draw(device, idx, object))
            .collect();
    }

    fn object_draw(
        &self,
        device: &wgpu::Device,
        idx: usize,
        object: &VolumeObject<'_>,
    ) -> ObjectDraw {
        let uniforms = wgpu::BufferBinding {
            buffer: &self.buffer,
            offset: (idx * stride(device)) as u64,
            size: NonZeroU64::new(size_of::<Object>() as u64),
        };
        let buffers = [object.positions, object.indices].map(wgpu::Buffer::as_entire_binding);
        let uniforms = [wgpu::BindingResource::Buffer(uniforms)];
        ObjectDraw {
            object: group(device, &self.object_layout, uniforms.into()),
            geometry: group(device, &self.geometry_layout, buffers.into()),
            triangles: object.triangles,
        }
    }

    /// Draws all objects; the caller has set the pipeline and the first bind group.
    pub(super) fn draw_all(&self, pass: &mut wgpu::RenderPass<'_>) {
        for draw in &self.draws {
            pass.set_bind_group(1, &draw.object, &[]);
            pass.set_bind_group(2, &draw.geometry, &[]);
            pass.draw(0..CORNERS, 0..draw.triangles);
        }
    }
}

impl Uniforms {
    pub(super) fn new(
        device: &wgpu::Device,
        frame: &VolumeFrame<'_>,
        resolution: VolumeResolution,
    ) -> Result<Self, VolumeFrameError> {
        let size = frame.gbuffer.positions.texture().size();
        let clip_from_world = frame.gbuffer.clip_from_world;
        let clip_from_world =
            resolution.clip_from_world(clip_from_world, [size.width, size.height]);
        let stride = stride(device);
        let count = frame.objects.len();
        if count.saturating_mul(stride) as u64 > device.limits().max_buffer_size {
            return Err(VolumeFrameError::TooMany(count));
        }
        let mut bytes = vec![0; count * stride];
        for (idx, object) in frame.objects.iter().enumerate() {
            let uniforms = Object::new(clip_from_world, idx, object)?;
            bytes[idx * stride..][..size_of::<Object>()]
                .copy_from_slice(bytemuck::bytes_of(&uniforms));
        }
        Ok(Self(bytes))
    }
}

impl Object {
    fn new(
        clip_from_world: [[f32; 4]; 4],
        idx: usize,
        object: &VolumeObject<'_>,
    ) -> Result<Self, VolumeFrameError> {
        let &VolumeObject {
            stride, triangles, ..
        } = object;
        if stride < 3 {
            let object = idx;
            return Err(VolumeFrameError::Stride { object, stride });
        }
        if u64::from(triangles) * 12 > object.indices.size() {
            let object = idx;
            return Err(VolumeFrameError::Indices { object, triangles });
        }
        let (rows, is_mirrored) = world_from_object(object.world_from_object, object.strength)
            .map_err(|source| VolumeFrameError::Object {
                object: idx,
                source,
            })?;
        let [world_x, world_y, world_z] = rows;
        Ok(Self {
            clip_from_world,
            world_x,
            world_y,
            world_z,
            excluded: object.excluded,
            volume: object.volume,
            layers: object.layers,
            strength: object.strength,
            stride,
            is_mirrored: u32::from(is_mirrored),
        })
    }
}

/// The distance between the uniforms of consecutive objects, in bytes.
fn stride(device: &wgpu::Device) -> usize {
    let alignment = device.limits().min_uniform_buffer_offset_alignment as usize;
    size_of::<Object>().next_multiple_of(alignment)
}

fn uniform_buffer(device: &wgpu::Device, size: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("aogrid volumes"),
        size: size as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: Vec<wgpu::BindingResource<'_>>,
) -> wgpu::BindGroup {
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("aogrid volumes"),
        layout,
        entries: &(0..).zip(resources).map(entry).collect::<Vec<_>>(),
    })
}

/// Returns the layout of a bind group of buffers of these types and smallest sizes.
fn layout(
    device: &wgpu::Device,
    buffers: &[(wgpu::BufferBindingType, usize)],
) -> wgpu::BindGroupLayout {
    let entry = |(binding, (ty, size)): (u32, &(wgpu::BufferBindingType, usize))| {
        let is_uniform = *ty == wgpu::BufferBindingType::Uniform;
        wgpu::BindGroupLayoutEntry {
            binding,
            visibility: match is_uniform {
                true => wgpu::ShaderStages::VERTEX_FRAGMENT,
                false => wgpu::ShaderStages::VERTEX,
            },
            ty: wgpu::BindingType::Buffer {
                ty: *ty,
                has_dynamic_offset: false,
                min_binding_size: NonZeroU64::new(*size as u64),
            },
            count: None,
        }
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aogrid volumes"),
        entries: &(0..).zip(buffers).map(entry).collect::<Vec<_>>(),
    })
}
