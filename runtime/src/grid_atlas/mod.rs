//! Several grids in one texture, for shaders that choose an occluder per pixel.

mod packing;

use aogrid_grid_format::{Encoding, Grid, TexelFormat};

use crate::grid_facts::GridFacts;
use crate::grid_texture::{self, GridTextureError};

/// Grids of one encoding and format in one 3D texture. Clones share it.
///
/// Look-ups are clamped to the centers of the grid's outer cells, as a clamped sampler does at the
/// edge of a texture: neighboring grids never mix, and no border is stored.
#[derive(Clone, Debug)]
pub struct GridAtlas {
    view: wgpu::TextureView,
    encoding: Encoding,
    format: TexelFormat,
    regions: Vec<AtlasRegion>,
}

/// The region of one grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AtlasRegion {
    pub(crate) facts: GridFacts,
    /// Its first texel.
    origin: [u32; 3],
    /// The size of the atlas in texels.
    atlas_size: [u32; 3],
}

/// The reasons why grids cannot form an atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GridAtlasError {
    /// There is no grid.
    #[error("an atlas needs at least one grid")]
    Empty,
    /// A grid differs from the first in encoding or format.
    #[error(
        "grid {0} differs from the first in encoding or format: bake all with the same \
         --encoding and --format"
    )]
    Mixed(usize),
    /// The device cannot hold a grid.
    #[error("grid {grid}: {source}")]
    Grid {
        /// Its index in the list.
        grid: usize,
        /// The reason.
        source: GridTextureError,
    },
    /// The grids do not fit into one texture.
    #[error("the grids do not fit into one texture of {limit} texels along each axis")]
    Full {
        /// The device's limit.
        limit: u32,
    },
}

impl GridAtlas {
    /// Uploads `grids`. The writes take effect with the queue's next submission. `label` names the
    /// texture in graphics debuggers.
    ///
    /// # Errors
    ///
    /// If there are no grids, if they differ in encoding or format, or if the device cannot hold or
    /// filter them.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        grids: &[&Grid],
        label: &str,
    ) -> Result<Self, GridAtlasError> {
        let first = grids.first().ok_or(GridAtlasError::Empty)?;
        let (encoding, format) = (first.encoding(), first.format());
        for (idx, grid) in grids.iter().enumerate() {
            if (grid.encoding(), grid.format()) != (encoding, format) {
                return Err(GridAtlasError::Mixed(idx));
            }
            grid_texture::check(device, grid)
                .map_err(|source| GridAtlasError::Grid { grid: idx, source })?;
        }
        let limit = device.limits().max_texture_dimension_3d;
        let sizes: Vec<_> = grids.iter().map(|grid| grid.spec().resolution()).collect();
        let packed = packing::pack(&sizes, limit).ok_or(GridAtlasError::Full { limit })?;
        let format_on_device = grid_texture::texture_format(encoding, format);
        let texture = grid_texture::create(device, packed.size, format_on_device, label);
        for (grid, &origin) in grids.iter().zip(&packed.origins) {
            grid_texture::write(queue, &texture, grid, origin);
        }
        let region = |(grid, &origin): (&&Grid, &[u32; 3])| AtlasRegion {
            facts: GridFacts::of(grid),
            origin,
            atlas_size: packed.size,
        };
        Ok(Self {
            view: texture.create_view(&wgpu::TextureViewDescriptor {
                label: Some(label),
                ..Default::default()
            }),
            encoding,
            format,
            regions: grids.iter().zip(&packed.origins).map(region).collect(),
        })
    }

    /// The number of grids.
    pub fn grid_count(&self) -> usize {
        self.regions.len()
    }

    /// The whole texture, for your own shaders.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// The quantities that a texel holds.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// The storage format of a channel.
    pub fn format(&self) -> TexelFormat {
        self.format
    }

    pub(crate) fn region(&self, grid: usize) -> Option<&AtlasRegion> {
        self.regions.get(grid)
    }
}

impl AtlasRegion {
    /// Half a cell, in \[0,1\]³ of the grid's box.
    pub(crate) fn half_cell(&self) -> [f32; 3] {
        self.facts.spec.resolution().map(|n| 0.5 / n as f32)
    }

    /// The scale and offset of atlas coordinates: scale · position + offset.
    pub(crate) fn scale_and_offset(&self) -> [[f32; 3]; 2] {
        let resolution = self.facts.spec.resolution();
        [
            std::array::from_fn(|x| resolution[x] as f32 / self.atlas_size[x] as f32),
            std::array::from_fn(|x| self.origin[x] as f32 / self.atlas_size[x] as f32),
        ]
    }
}
