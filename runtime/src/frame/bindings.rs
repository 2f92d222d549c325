//! The first bind group of every pass, which `frame.wgsl` declares: camera, G-buffer, T_clip.

use std::num::NonZeroU64;

use super::{FrameInputs, Normals, Positions, PrepareError, Receivers};
use crate::occluder::world_from_clip;
use crate::tables;

/// The parts of the G-buffer that a pass reads. Compiled into its pipeline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GBufferReads {
    pub(crate) positions: Positions,
    /// The encoding of the normals; none if no normals are read.
    pub(crate) normals: Option<Normals>,
    pub(crate) receivers: Receivers,
}

/// The bind group, recreated when the frame's textures change.
#[derive(Debug)]
pub(crate) struct FrameBindings {
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

/// A validated frame, ready to be written.
pub(crate) struct ValidatedFrame {
    views: BoundViews,
    world_from_clip: [[f32; 4]; 4],
}

/// The views of a bind group: positions, normals, receivers.
#[derive(Debug, PartialEq)]
struct BoundViews([wgpu::TextureView; 3]);

impl GBufferReads {
    /// The values of the `override`s of `frame.wgsl`.
    pub(crate) fn constants(&self) -> [(&'static str, f64); 4] {
        let [scale, offset] = match self.normals {
            Some(Normals::Signed) | None => [1.0, 0.0],
            Some(Normals::Unsigned) => [2.0, -1.0],
        };
        let receiver_channels = match self.receivers {
            Receivers::None => 0.0,
            Receivers::Ids => 1.0,
            Receivers::IdsAndLayers => 2.0,
        };
        let are_depths = self.positions == Positions::Depth;
        [
            ("positions_are_depths", f64::from(u8::from(are_depths))),
            ("normal_scale", scale),
            ("normal_offset", offset),
            ("receiver_channels", receiver_channels),
        ]
    }
}

impl FrameBindings {
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

    /// Validates a frame; nothing is written yet.
    pub(crate) fn check(&self, view: &FrameInputs<'_>) -> Result<ValidatedFrame, PrepareError> {
        let normals = match (self.reads.normals, view.normals) {
            (_, Some(view)) => view,
            (None, None) => &self.normals_placeholder,
            (Some(_), None) => return Err(PrepareError::Missing("normals")),
        };
        let receivers = match (self.reads.receivers, view.receivers) {
            (Receivers::None, _) => &self.receivers_placeholder,
            (_, Some(view)) => view,
            (_, None) => return Err(PrepareError::Missing("receivers")),
        };
        Ok(ValidatedFrame {
            views: BoundViews([view.positions, normals, receivers].map(Clone::clone)),
            world_from_clip: world_from_clip(view.clip_from_world)
                .map_err(|_| PrepareError::Camera)?,
        })
    }

    /// Writes a validated frame.
    pub(crate) fn write(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        validated: ValidatedFrame,
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

/// A texture of one texel, for a binding that no shader reads.
fn placeholder(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("aogrid placeholder"),
        size: wgpu::Extent3d::default(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor {
        label: Some("aogrid placeholder"),
        ..Default::default()
    })
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
