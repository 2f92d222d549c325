//! Several grids in one texture, for shaders that choose an occluder per pixel.

mod packing;

use aogrid_grid_format::{Encoding, Grid, GridSpec, TexelFormat};

use crate::grid_texture::{self, GridTextureError};

/// Grids of one encoding and format in one 3D texture. Clones share it.
///
/// A look-up is clamped to the centres of its grid's outer cells, which is what a clamped sampler
/// does at the edge of a texture: neighbours never mix, and no border is stored.
#[derive(Clone, Debug)]
pub struct GridAtlas {
    view: wgpu::TextureView,
    encoding: Encoding,
    format: TexelFormat,
    parts: Vec<Part>,
}

/// Where one grid lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub(crate) spec: GridSpec,
    /// The first of its texels.
    first: [u32; 3],
    /// The atlas's texels along each axis.
    atlas: [u32; 3],
}

/// Why grids make no atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GridAtlasError {
    /// No grid at all.
    #[error("an atlas needs a grid")]
    Empty,
    /// A grid unlike the first.
    #[error(
        "grid {0} is of another encoding or format than the first: bake all with the same \
         --encoding and --format"
    )]
    Mixed(usize),
    /// A grid that the device cannot take.
    #[error("grid {grid}: {source}")]
    Grid {
        /// Its place in the list.
        grid: usize,
        /// Why not.
        source: GridTextureError,
    },
    /// Together they are too large.
    #[error("the grids are too many for one texture of {limit} texels along each axis")]
    Full {
        /// The device's limit.
        limit: u32,
    },
}

impl GridAtlas {
    /// Uploads `grids`: the writes are made with the queue's next submission. `label` names the
    /// texture in graphics debuggers.
    ///
    /// # Errors
    ///
    /// No grids, grids that differ in encoding or format, or that the device cannot hold or filter.
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
        let part = |(grid, &first): (&&Grid, &[u32; 3])| Part {
            spec: *grid.spec(),
            first,
            atlas: packed.size,
        };
        Ok(Self {
            view: texture.create_view(&wgpu::TextureViewDescriptor {
                label: Some(label),
                ..Default::default()
            }),
            encoding,
            format,
            parts: grids.iter().zip(&packed.origins).map(part).collect(),
        })
    }

    /// How many grids there are.
    pub fn grid_count(&self) -> usize {
        self.parts.len()
    }

    /// The whole texture, for a shader of your own.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// What a texel means.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// How a value is stored.
    pub fn format(&self) -> TexelFormat {
        self.format
    }

    pub(crate) fn part(&self, grid: usize) -> Option<&Part> {
        self.parts.get(grid)
    }
}

impl Part {
    /// Half a cell, in \[0,1\]³ of the grid's box.
    pub(crate) fn half_cell(&self) -> [f32; 3] {
        self.spec.resolution().map(|n| 0.5 / n as f32)
    }

    /// The atlas's coordinates are scale · position + offset.
    pub(crate) fn scale_and_offset(&self) -> [[f32; 3]; 2] {
        let resolution = self.spec.resolution();
        [
            std::array::from_fn(|x| resolution[x] as f32 / self.atlas[x] as f32),
            std::array::from_fn(|x| self.first[x] as f32 / self.atlas[x] as f32),
        ]
    }
}
