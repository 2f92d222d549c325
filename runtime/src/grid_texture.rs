//! A grid on the GPU, shared by all of its instances and by all passes.

use aogrid_grid_format::{Encoding, Grid, GridSpec, TexelFormat};

use crate::grid_facts::GridFacts;
use crate::{AogridOccluder, Instance, InstanceError};

/// A grid's texture. Clones share it.
#[derive(Clone, Debug)]
pub struct GridTexture {
    view: wgpu::TextureView,
    bind_group: wgpu::BindGroup,
    facts: GridFacts,
}

/// The reasons why a device cannot hold a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GridTextureError {
    /// The grid holds single floats, which the device cannot filter.
    #[error("an f32 grid needs the device feature FLOAT32_FILTERABLE; bake it as f16 or unorm8")]
    Float32,
    /// The grid has more cells along an axis than the device's 3D textures can have.
    #[error(
        "{resolution:?} cells exceed the device's limit of {limit} along an axis of a 3D texture"
    )]
    Resolution {
        /// The grid's resolution.
        resolution: [u32; 3],
        /// The device's limit.
        limit: u32,
    },
}

impl GridTexture {
    /// Uploads `grid`. The write takes effect with the queue's next submission. `label` names the
    /// texture in graphics debuggers.
    ///
    /// # Errors
    ///
    /// If the device cannot hold or filter the grid.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        grid: &Grid,
        label: &str,
    ) -> Result<Self, GridTextureError> {
        check(device, grid)?;
        let format = texture_format(grid.encoding(), grid.format());
        let texture = create(device, grid.spec().resolution(), format, label);
        write(queue, &texture, grid, [0; 3]);
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            label: Some(label),
            ..Default::default()
        });
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(label),
            layout: &layout(device),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&view),
            }],
        });
        Ok(Self {
            view,
            bind_group,
            facts: GridFacts::of(grid),
        })
    }

    /// The whole texture, for your own shaders.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// The grid's resolution and box.
    pub fn spec(&self) -> &GridSpec {
        &self.facts.spec
    }

    /// The quantities that a texel holds.
    pub fn encoding(&self) -> Encoding {
        self.facts.encoding
    }

    /// The storage format of a channel.
    pub fn format(&self) -> TexelFormat {
        self.facts.format
    }

    /// Builds the shader data of an instance, for your own shaders.
    ///
    /// # Errors
    ///
    /// The errors of [`AogridOccluder::new`].
    pub fn occluder(&self, instance: &Instance) -> Result<AogridOccluder, InstanceError> {
        AogridOccluder::of(&self.facts, instance)
    }

    pub(crate) fn facts(&self) -> &GridFacts {
        &self.facts
    }

    pub(crate) fn bind_group(&self) -> &wgpu::BindGroup {
        &self.bind_group
    }
}

/// The layout of the bind group of every [`GridTexture`]. Layouts that were created alike are
/// interchangeable.
pub(crate) fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("aogrid grid"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::FRAGMENT | wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: true },
                view_dimension: wgpu::TextureViewDimension::D3,
                multisampled: false,
            },
            count: None,
        }],
    })
}

/// Rejects grids that the device cannot hold or filter.
pub(crate) fn check(device: &wgpu::Device, grid: &Grid) -> Result<(), GridTextureError> {
    let can_filter = wgpu::Features::FLOAT32_FILTERABLE;
    if grid.format() == TexelFormat::F32 && !device.features().contains(can_filter) {
        return Err(GridTextureError::Float32);
    }
    let limit = device.limits().max_texture_dimension_3d;
    let resolution = grid.spec().resolution();
    if resolution.iter().any(|&n| n > limit) {
        return Err(GridTextureError::Resolution { resolution, limit });
    }
    Ok(())
}

/// An empty texture for grids.
pub(crate) fn create(
    device: &wgpu::Device,
    size: [u32; 3],
    format: wgpu::TextureFormat,
    label: &str,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: extent(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// Writes the cells of a grid into a texture, from texel `origin` on.
pub(crate) fn write(
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    grid: &Grid,
    [x, y, z]: [u32; 3],
) {
    let [width, height, depth] = grid.spec().resolution();
    let destination = wgpu::TexelCopyTextureInfo {
        origin: wgpu::Origin3d { x, y, z },
        ..texture.as_image_copy()
    };
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(width * grid.texel_bytes() as u32),
        rows_per_image: Some(height),
    };
    queue.write_texture(
        destination,
        grid.texels(),
        layout,
        extent([width, height, depth]),
    );
}

fn extent([width, height, depth_or_array_layers]: [u32; 3]) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers,
    }
}

/// The texture format of a grid: never sRGB, the texels are data.
pub(crate) fn texture_format(encoding: Encoding, format: TexelFormat) -> wgpu::TextureFormat {
    use wgpu::TextureFormat as F;
    let [one, four] = match format {
        TexelFormat::Unorm8 => [F::R8Unorm, F::Rgba8Unorm],
        TexelFormat::F16 => [F::R16Float, F::Rgba16Float],
        TexelFormat::F32 => [F::R32Float, F::Rgba32Float],
    };
    if encoding.channels() == 1 { one } else { four }
}
