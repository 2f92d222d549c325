//! The first bind group of the occlusion passes, which `gbuffer.wgsl` declares: camera, G-buffer,
//! T_clip.

use std::num::NonZeroU64;

use super::{GBufferError, GBufferFormat, GBufferViews, Receivers, placeholder};
use crate::occluder::world_from_clip;
use crate::tables;

/// The parts of the G-buffer that a pass reads. Compiled into its pipeline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GBufferReads {
    pub(crate) format: GBufferFormat,
    /// Whether the pass reads normals.
    pub(crate) normals: bool,
}

/// The bind group, recreated when the frame's textures change.
#[derive(Debug)]
pub(crate) struct GBufferBindings {
    reads: GBufferReads,
    layout: wgpu::BindGroupLayout,
    table: wgpu::TextureView,
    sampler: wgpu::Sampler,
    /// Placeholders for textures that are not read.
    normals_placeholder: wgpu::TextureView,
    receivers_placeholder: wgpu::TextureView,
    buffer: wgpu::Buffer,
    group: Option<(BoundViews, wgpu::BindGroup)>,
}

/// The validated views of a frame, ready to be written.
pub(crate) struct ValidatedViews {
    views: BoundViews,
    world_from_clip: [[f32; 4]; 4],
}

/// The views of a bind group: positions, normals, receivers.
#[derive(Debug, PartialEq)]
struct BoundViews([wgpu::TextureView; 3]);

impl GBufferReads {
    /// The values of the `override`s of `gbuffer.wgsl`.
    pub(crate) fn constants(&self) -> Vec<(&'static str, f64)> {
        let receiver_channels = match self.format.receivers {
            Receivers::None => 0.0,
            Receivers::Ids => 1.0,
            Receivers::IdsAndLayers => 2.0,
        };
        let mut constants = self.format.constants().to_vec();
        constants.push(("receiver_channels", receiver_channels));
        constants
    }
}

impl GBufferBindings {
    /// Creates the layout, buffer and sampler. `table` is T_clip as transmittance, or with all
    /// channels.
    pub(crate) fn new(
        device: &wgpu::Device,
        reads: GBufferReads,
        table: wgpu::TextureView,
    ) -> Self {
        Self {
            reads,
            layout: layout(device),
            table,
            sampler: tables::linear_clamp_sampler(device),
            normals_placeholder: placeholder(device, wgpu::TextureFormat::Rgba8Unorm),
            receivers_placeholder: placeholder(device, wgpu::TextureFormat::R32Uint),
            buffer: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("aogrid frame"),
                size: size_of::<[[f32; 4]; 4]>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            group: None,
        }
    }

    pub(crate) fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// The bind group; none before the first frame.
    pub(crate) fn group(&self) -> Option<&wgpu::BindGroup> {
        self.group.as_ref().map(|(_, group)| group)
    }

    /// Validates the views of a frame; nothing is written yet.
    pub(crate) fn check(&self, views: &GBufferViews<'_>) -> Result<ValidatedViews, GBufferError> {
        let normals = match (self.reads.normals, views.normals) {
            (_, Some(view)) => view,
            (false, None) => &self.normals_placeholder,
            (true, None) => return Err(GBufferError::Missing("normals")),
        };
        let receivers = match (self.reads.format.receivers, views.receivers) {
            (Receivers::None, _) => &self.receivers_placeholder,
            (_, Some(view)) => view,
            (_, None) => return Err(GBufferError::Missing("receivers")),
        };
        Ok(ValidatedViews {
            views: BoundViews([views.positions, normals, receivers].map(Clone::clone)),
            world_from_clip: world_from_clip(views.clip_from_world)
                .map_err(|_| GBufferError::Camera)?,
        })
    }

    /// Writes the validated views of a frame.
    pub(crate) fn write(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        validated: ValidatedViews,
    ) {
        let world_from_clip = bytemuck::bytes_of(&validated.world_from_clip);
        queue.write_buffer(&self.buffer, 0, world_from_clip);
        let views = validated.views;
        if self
            .group
            .as_ref()
            .is_some_and(|(previous, _)| *previous == views)
        {
            return;
        }
        let group = self.bind(device, &views);
        self.group = Some((views, group));
    }

    fn bind(&self, device: &wgpu::Device, views: &BoundViews) -> wgpu::BindGroup {
        let [positions, normals, receivers] = &views.0;
        let view = wgpu::BindingResource::TextureView;
        let resources = [
            self.buffer.as_entire_binding(),
            view(positions),
            view(normals),
            view(receivers),
            view(&self.table),
            wgpu::BindingResource::Sampler(&self.sampler),
        ];
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("aogrid frame"),
            layout: &self.layout,
            entries: &entries,
        })
    }
}

fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: NonZeroU64::new(size_of::<[[f32; 4]; 4]>() as u64),
    };
    let texture = |sample_type| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let loaded = texture(wgpu::TextureSampleType::Float { filterable: false });
    let filtered = texture(wgpu::TextureSampleType::Float { filterable: true });
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let ids = texture(wgpu::TextureSampleType::Uint);
    let types = [uniform, loaded, loaded, ids, filtered, sampler];
    let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT | wgpu::ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    let entries: Vec<_> = (0..).zip(types).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aogrid frame"),
        entries: &entries,
    })
}
