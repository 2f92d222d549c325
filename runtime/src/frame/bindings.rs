//! The first bind group of every pass: camera, G-buffer, T_clip. `frame.wgsl` is its other side.

use std::num::NonZeroU64;

use super::{Normals, Positions, PrepareError, Receivers, View};
use crate::occluder::world_from_clip;
use crate::tables;

/// What a pass reads of the G-buffer. Compiled into its pipeline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reads {
    pub(crate) positions: Positions,
    /// None: no normals are read.
    pub(crate) normals: Option<Normals>,
    pub(crate) receivers: Receivers,
}

/// The bind group, made anew when the frame's textures are others.
#[derive(Debug)]
pub(crate) struct Bindings {
    reads: Reads,
    layout: wgpu::BindGroupLayout,
    table: wgpu::TextureView,
    sampler: wgpu::Sampler,
    /// Stand in for textures that are not read.
    no_normals: wgpu::TextureView,
    no_receivers: wgpu::TextureView,
    buffer: wgpu::Buffer,
    group: Option<(Views, wgpu::BindGroup)>,
}

/// A frame that can be written.
pub(crate) struct Checked {
    views: Views,
    world_from_clip: [[f32; 4]; 4],
}

/// Positions, normals and receivers: what the bind group was made from.
#[derive(Debug, PartialEq)]
struct Views([wgpu::TextureView; 3]);

impl Reads {
    /// The `override`s of `frame.wgsl`.
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

impl Bindings {
    /// `table`: T_clip, as transmittance or the whole of it.
    pub(crate) fn new(device: &wgpu::Device, reads: Reads, table: wgpu::TextureView) -> Self {
        Self {
            reads,
            layout: layout(device),
            table,
            sampler: tables::linear_clamp_sampler(device),
            no_normals: nothing(device, wgpu::TextureFormat::Rgba8Unorm),
            no_receivers: nothing(device, wgpu::TextureFormat::R32Uint),
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

    /// None before the first frame.
    pub(crate) fn group(&self) -> Option<&wgpu::BindGroup> {
        self.group.as_ref().map(|(_, group)| group)
    }

    pub(crate) fn check(&self, view: &View<'_>) -> Result<Checked, PrepareError> {
        let normals = match (self.reads.normals, view.normals) {
            (_, Some(view)) => view,
            (None, None) => &self.no_normals,
            (Some(_), None) => return Err(PrepareError::Missing("normals")),
        };
        let receivers = match (self.reads.receivers, view.receivers) {
            (Receivers::None, _) => &self.no_receivers,
            (_, Some(view)) => view,
            (_, None) => return Err(PrepareError::Missing("receivers")),
        };
        Ok(Checked {
            views: Views([view.positions, normals, receivers].map(Clone::clone)),
            world_from_clip: world_from_clip(view.clip_from_world)
                .map_err(|_| PrepareError::Camera)?,
        })
    }

    pub(crate) fn write(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, checked: Checked) {
        let world_from_clip = bytemuck::bytes_of(&checked.world_from_clip);
        queue.write_buffer(&self.buffer, 0, world_from_clip);
        let views = checked.views;
        if self.group.as_ref().is_some_and(|(old, _)| *old == views) {
            return;
        }
        let group = self.bind(device, &views);
        self.group = Some((views, group));
    }

    fn bind(&self, device: &wgpu::Device, views: &Views) -> wgpu::BindGroup {
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

/// A texture with nothing in it, for a binding that no shader will read.
fn nothing(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("aogrid nothing"),
        size: wgpu::Extent3d::default(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor {
        label: Some("aogrid nothing"),
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
