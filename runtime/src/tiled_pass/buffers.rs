//! The bindings of the tiled pass besides the frame: occluders, grids, lists, the target.

use aogrid_grid_format::Encoding;
use bytemuck::{Pod, Zeroable};

use super::TiledFrame;
use crate::frame::PrepareError;
use crate::grid_atlas::AtlasRegion;
use crate::occluder::clip_from_box;
use crate::wgsl::AOGRID_TILE;
use crate::{AogridOccluder, Instance, InstanceError, Mode, TiledPass, tables};

/// The shader data of an occluder whose grid is a region of an atlas: the struct of the same name
/// in the WGSL library, 272 bytes, for a storage buffer.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct AogridAtlasOccluder {
    /// The occluder.
    pub occluder: AogridOccluder,
    /// Half a cell, in \[0,1\]³ of the grid's box; the fourth component is unused, here and below.
    pub half_cell: [f32; 4],
    /// The scale of atlas coordinates: scale · position + offset.
    pub atlas_scale: [f32; 4],
    /// The offset of atlas coordinates.
    pub atlas_offset: [f32; 4],
    /// The pixels that its reach covers: minimum x and y, maximum x and y.
    pub pixels: [f32; 4],
}

/// The size of the target and of the lists: the struct of the same name in the WGSL library, 16
/// bytes, for a uniform buffer.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct AogridTiles {
    /// The target's size in pixels.
    pub size: [u32; 2],
    /// The number of words in a list, with one bit for each of 32 occluders.
    pub words: u32,
    /// The number of occluders.
    pub occluders: u32,
}

impl AogridAtlasOccluder {
    /// Builds an occluder with a region of an atlas, seen by a camera whose image has `size`
    /// pixels.
    fn new(
        region: &AtlasRegion,
        instance: &Instance,
        clip_from_world: [[f32; 4]; 4],
        size: [u32; 2],
    ) -> Result<Self, InstanceError> {
        let padded = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
        let [scale, offset] = region.scale_and_offset();
        Ok(Self {
            occluder: AogridOccluder::of(&region.facts, instance)?,
            half_cell: padded(region.half_cell()),
            atlas_scale: padded(scale),
            atlas_offset: padded(offset),
            pixels: pixels(clip_from_world, region, instance, size)?,
        })
    }
}

impl AogridTiles {
    /// The number of tiles across and down.
    pub fn tiles(&self) -> [u32; 2] {
        self.size.map(|n| n.div_ceil(AOGRID_TILE))
    }

    /// The number of words in all lists of all tiles: two lists each.
    fn all_words(&self) -> u64 {
        let [across, down] = self.tiles().map(u64::from);
        across * down * 2 * u64::from(self.words)
    }
}

/// A validated frame, ready to be written.
pub(super) struct FrameData {
    tiles: AogridTiles,
    occluders: Vec<AogridAtlasOccluder>,
    list_words: u64,
}

impl FrameData {
    pub(super) fn new(
        device: &wgpu::Device,
        frame: &TiledFrame<'_>,
        mode: Mode,
    ) -> Result<Self, PrepareError> {
        let count = frame.occluders.len();
        if count > TiledPass::MAX_OCCLUDERS {
            return Err(PrepareError::TooMany(count));
        }
        let [target, positions] =
            [frame.target, frame.gbuffer.positions].map(|v| v.texture().size());
        if target != positions {
            return Err(PrepareError::TargetSize);
        }
        let tiles = AogridTiles {
            size: [positions.width, positions.height],
            words: count.div_ceil(32) as u32,
            occluders: count as u32,
        };
        let list_words = tiles.all_words();
        if 4 * list_words > device.limits().max_storage_buffer_binding_size {
            return Err(PrepareError::TooMany(count));
        }
        let occluders = (0..).zip(frame.occluders).map(|(idx, (grid, instance))| {
            if mode == Mode::Cone && frame.atlas.encoding() == Encoding::Occlusion {
                return Err(PrepareError::NoCones(idx));
            }
            let region = frame.atlas.region(*grid);
            let region = region.ok_or(PrepareError::NoSuchGrid(idx))?;
            let camera = frame.gbuffer.clip_from_world;
            AogridAtlasOccluder::new(region, instance, camera, tiles.size).map_err(|source| {
                PrepareError::Instance {
                    occluder: idx,
                    source,
                }
            })
        });
        Ok(Self {
            occluders: occluders.collect::<Result<_, _>>()?,
            tiles,
            list_words,
        })
    }
}

/// The buffers, and the bind groups, which are recreated when their resources change.
#[derive(Debug)]
pub(super) struct Buffers {
    layouts: Layouts,
    /// T_clip with all channels, and the overlap table of T_merge.
    tables: [wgpu::TextureView; 2],
    sampler: wgpu::Sampler,
    tiles_buffer: wgpu::Buffer,
    occluders: wgpu::Buffer,
    lists: wgpu::Buffer,
    tiles: AogridTiles,
    groups: Option<BindGroups>,
}

#[derive(Debug)]
pub(super) struct BindGroups {
    /// Atlas and target.
    views: [wgpu::TextureView; 2],
    pub(super) common: wgpu::BindGroup,
    pub(super) gather: wgpu::BindGroup,
    pub(super) shade: wgpu::BindGroup,
    /// The group for other shaders.
    pub(super) lists: wgpu::BindGroup,
}

impl Buffers {
    pub(super) fn new(
        device: &wgpu::Device,
        target: wgpu::TextureFormat,
        tables: [wgpu::TextureView; 2],
    ) -> Self {
        let empty_tiles = AogridTiles {
            size: [0; 2],
            words: 0,
            occluders: 0,
        };
        Self {
            layouts: Layouts::new(device, target),
            tables,
            sampler: tables::linear_clamp_sampler(device),
            tiles_buffer: buffer(
                device,
                wgpu::BufferUsages::UNIFORM,
                size_of::<AogridTiles>(),
            ),
            occluders: occluder_buffer(device, 1),
            lists: list_buffer(device, 1),
            tiles: empty_tiles,
            groups: None,
        }
    }

    pub(super) fn common_layout(&self) -> &wgpu::BindGroupLayout {
        &self.layouts.common
    }

    pub(super) fn gather_layout(&self) -> &wgpu::BindGroupLayout {
        &self.layouts.gather
    }

    pub(super) fn shade_layout(&self) -> &wgpu::BindGroupLayout {
        &self.layouts.shade
    }

    pub(super) fn lists_layout(&self) -> &wgpu::BindGroupLayout {
        &self.layouts.lists
    }

    /// The bind groups; none before the first frame.
    pub(super) fn groups(&self) -> Option<&BindGroups> {
        self.groups.as_ref()
    }

    pub(super) fn tiles(&self) -> &AogridTiles {
        &self.tiles
    }

    pub(super) fn write(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &TiledFrame<'_>,
        frame_data: &FrameData,
    ) {
        // Buffers only grow; new ones invalidate the bind groups.
        let bytes: &[u8] = bytemuck::cast_slice(&frame_data.occluders);
        if bytes.len() as u64 > self.occluders.size() {
            let new_capacity = frame_data.occluders.len().next_power_of_two();
            self.occluders = occluder_buffer(device, new_capacity);
            self.groups = None;
        }
        if 4 * frame_data.list_words > self.lists.size() {
            self.lists = list_buffer(device, frame_data.list_words);
            self.groups = None;
        }
        queue.write_buffer(&self.tiles_buffer, 0, bytemuck::bytes_of(&frame_data.tiles));
        queue.write_buffer(&self.occluders, 0, bytes);
        self.tiles = frame_data.tiles;
        let views = [frame.atlas.view(), frame.target].map(Clone::clone);
        if self
            .groups
            .as_ref()
            .is_none_or(|previous| previous.views != views)
        {
            self.groups = Some(self.bind(device, views));
        }
    }

    fn bind(&self, device: &wgpu::Device, views: [wgpu::TextureView; 2]) -> BindGroups {
        let view = wgpu::BindingResource::TextureView;
        let ([atlas, target], [t_clip, overlaps]) = (&views, &self.tables);
        let tiles = self.tiles_buffer.as_entire_binding();
        let occluders = self.occluders.as_entire_binding();
        let lists = self.lists.as_entire_binding();
        let list_resources = [
            tiles.clone(),
            occluders.clone(),
            view(atlas),
            view(t_clip),
            view(overlaps),
            wgpu::BindingResource::Sampler(&self.sampler),
            lists.clone(),
        ];
        let shade = [lists.clone(), view(atlas), view(overlaps), view(target)];
        BindGroups {
            common: group(device, &self.layouts.common, [tiles, occluders]),
            gather: group(device, &self.layouts.gather, [lists]),
            shade: group(device, &self.layouts.shade, shade),
            lists: group(device, &self.layouts.lists, list_resources),
            views,
        }
    }
}

/// The minimum x and y and the maximum x and y of the pixels that the box may cover: all pixels if
/// a part of the box lies behind the camera, none if the whole box does.
fn pixels(
    clip_from_world: [[f32; 4]; 4],
    region: &AtlasRegion,
    instance: &Instance,
    size: [u32; 2],
) -> Result<[f32; 4], InstanceError> {
    /// The margin for rounding, in pixels; it also covers positions anywhere within a pixel.
    const MARGIN: f32 = 1.0;
    let clip_from_box = clip_from_box(clip_from_world, &region.facts, instance)?;
    let clip_from_box = glam::Mat4::from_cols_array_2d(&clip_from_box);
    let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|corner| {
        let bit = |axis: u32| (corner >> axis & 1) as f32;
        clip_from_box * glam::Vec4::new(bit(0), bit(1), bit(2), 1.0)
    });
    let in_front = corners.iter().filter(|corner| corner.w > 0.0).count();
    Ok(match in_front {
        // An empty range, which no tile meets.
        0 => [f32::MAX, f32::MAX, f32::MIN, f32::MIN],
        8 => {
            let [width, height] = size.map(|n| n as f32);
            let at = corners.map(|c| {
                let (x, y) = (c.x / c.w, c.y / c.w);
                glam::Vec2::new((0.5 + 0.5 * x) * width, (0.5 - 0.5 * y) * height)
            });
            let low = at.into_iter().reduce(glam::Vec2::min).unwrap_or_default() - MARGIN;
            let high = at.into_iter().reduce(glam::Vec2::max).unwrap_or_default() + MARGIN;
            [low.x, low.y, high.x, high.y]
        }
        _ => [f32::MIN, f32::MIN, f32::MAX, f32::MAX],
    })
}

fn occluder_buffer(device: &wgpu::Device, count: usize) -> wgpu::Buffer {
    let bytes = count * size_of::<AogridAtlasOccluder>();
    buffer(device, wgpu::BufferUsages::STORAGE, bytes)
}

fn list_buffer(device: &wgpu::Device, words: u64) -> wgpu::Buffer {
    buffer(device, wgpu::BufferUsages::STORAGE, 4 * words as usize)
}

fn buffer(device: &wgpu::Device, usage: wgpu::BufferUsages, bytes: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("aogrid tiles"),
        size: bytes as u64,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn group<const N: usize>(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: [wgpu::BindingResource<'_>; N],
) -> wgpu::BindGroup {
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("aogrid tiles"),
        layout,
        entries: &entries,
    })
}

/// The layouts of the bind groups.
#[derive(Debug)]
struct Layouts {
    /// The second group of both entry points of `tiled_pass.wgsl`.
    common: wgpu::BindGroupLayout,
    /// The third group of the two entry points.
    gather: wgpu::BindGroupLayout,
    shade: wgpu::BindGroupLayout,
    /// The group that `tile_lists.wgsl` binds.
    lists: wgpu::BindGroupLayout,
}

impl Layouts {
    fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        use wgpu::TextureViewDimension::{D2, D3};
        let compute = wgpu::ShaderStages::COMPUTE;
        let uniform = binding(wgpu::BufferBindingType::Uniform);
        let read = binding(wgpu::BufferBindingType::Storage { read_only: true });
        let written = binding(wgpu::BufferBindingType::Storage { read_only: false });
        let target = wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: target,
            view_dimension: D2,
        };
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let (grids, table) = (filtered(D3), filtered(D2));
        let lists = [uniform, read, grids, table, grids, sampler, read];
        let anywhere = wgpu::ShaderStages::FRAGMENT | compute;
        Self {
            common: make_layout(device, compute, &[uniform, read]),
            gather: make_layout(device, compute, &[written]),
            shade: make_layout(device, compute, &[read, grids, grids, target]),
            lists: make_layout(device, anywhere, &lists),
        }
    }
}

fn make_layout(
    device: &wgpu::Device,
    visibility: wgpu::ShaderStages,
    types: &[wgpu::BindingType],
) -> wgpu::BindGroupLayout {
    let entry = |(binding, &ty)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty,
        count: None,
    };
    let entries: Vec<_> = (0..).zip(types).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aogrid tiles"),
        entries: &entries,
    })
}

fn binding(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

fn filtered(view_dimension: wgpu::TextureViewDimension) -> wgpu::BindingType {
    wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension,
        multisampled: false,
    }
}
