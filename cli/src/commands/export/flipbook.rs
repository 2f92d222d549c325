//! The slices of a grid side by side in a picture.

use std::io::Cursor;

use anyhow::Context;
use aogrid_grid_format::{ChannelRange, Grid, TexelFormat};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use serde::Serialize;

/// The side up to which GPUs hold pictures.
const MAX_SIDE: u32 = 16_384;

/// The place of each slice in a picture: the slice of the lowest z at the top left, then to the right, then
/// downward. In a slice, x is to the right and y is upward.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Layout {
    /// Slices in a row.
    pub columns: u32,
    /// Rows of slices.
    pub rows: u32,
    /// The size of a slice, in pixels.
    pub slice: [u32; 2],
    /// The size of the picture, in pixels.
    pub size: [u32; 2],
    /// The direction of y in a slice.
    y: &'static str,
}

impl Layout {
    /// Returns the layout nearest to a square without an empty place, which programs would take for
    /// slices.
    pub(super) fn of([nx, ny, nz]: [u32; 3]) -> Self {
        let columns = (1..=nz).filter(|columns| nz % columns == 0);
        let side = |columns: &u32| (columns * nx).max(nz / columns * ny);
        let columns = columns.min_by_key(side).unwrap_or(1);
        let rows = nz / columns;
        Self {
            columns,
            rows,
            slice: [nx, ny],
            size: [columns * nx, rows * ny],
            y: "up",
        }
    }

    /// Returns a warning if few programs can read the picture.
    pub(super) fn warning(&self) -> Option<String> {
        let [width, height] = self.size;
        let is_large = width.max(height) > MAX_SIDE;
        is_large.then(|| {
            format!(
                "{width} × {height} pixels are more than most programs read ({MAX_SIDE}): bake with a \
                 number of cells along z that has more divisors"
            )
        })
    }

    /// Returns the cell of each pixel, row by row from the top.
    pub(super) fn cells(&self) -> impl Iterator<Item = [u32; 3]> + Clone {
        let ([width, height], [nx, ny], columns) = (self.size, self.slice, self.columns);
        (0..height).flat_map(move |row| {
            (0..width).map(move |x| {
                let slice = row / ny * columns + x / nx;
                [x % nx, ny - 1 - row % ny, slice]
            })
        })
    }
}

/// The largest value of a 16-bit channel that stands for a signed number: 1.
const SIGNED: f32 = 32_767.0;
/// The value that stands for zero.
const ZERO: f32 = 32_768.0;

/// Returns `[scale, offset]` of the decoding `scale · t + offset` of a channel t of a picture, 0..1.
pub(super) fn decoding(format: TexelFormat, range: ChannelRange) -> [f64; 2] {
    match (format, range) {
        (TexelFormat::Unorm8, _) => format.decoding(range),
        (_, ChannelRange::Unit) => [1.0, 0.0],
        (_, ChannelRange::Signed) => [
            65_535.0 / f64::from(SIGNED),
            -f64::from(ZERO) / f64::from(SIGNED),
        ],
    }
}

/// Returns a grid as a PNG.
pub(super) fn encode(grid: &Grid, layout: &Layout) -> anyhow::Result<Vec<u8>> {
    let bits = match grid.format() {
        TexelFormat::Unorm8 => 8,
        TexelFormat::F16 | TexelFormat::F32 => 16,
    };
    let (color, bytes) = match (grid.encoding().channels(), bits) {
        (1, 8) => (ExtendedColorType::L8, stored(grid, layout)),
        (1, _) => (ExtendedColorType::L16, sixteen_bits(grid, layout)),
        (_, 8) => (ExtendedColorType::Rgba8, stored(grid, layout)),
        (..) => (ExtendedColorType::Rgba16, sixteen_bits(grid, layout)),
    };
    let mut png = Cursor::new(Vec::new());
    let [width, height] = layout.size;
    PngEncoder::new(&mut png)
        .write_image(&bytes, width, height, color)
        .context("cannot encode the PNG")?;
    Ok(png.into_inner())
}

/// Returns the texels of a picture as they are in the grid.
fn stored(grid: &Grid, layout: &Layout) -> Vec<u8> {
    let size = grid.texel_bytes();
    let texel = |cell| &grid.texels()[grid.spec().cell_idx(cell) * size..][..size];
    layout
        .cells()
        .flat_map(|cell| texel(cell).iter().copied())
        .collect()
}

/// Returns the decoded channels of a picture with 16 bits each, in the byte order of this machine, as the
/// encoder takes them.
fn sixteen_bits(grid: &Grid, layout: &Layout) -> Vec<u8> {
    let channels = grid.encoding().channel_list();
    let values = grid.decode();
    let number = |(value, range): (f32, ChannelRange)| match range {
        ChannelRange::Unit => (value * 65_535.0).round() as u16,
        ChannelRange::Signed => (value * SIGNED + ZERO).round() as u16,
    };
    let cells = layout.cells().flat_map(|cell| {
        let at = grid.spec().cell_idx(cell) * channels.len();
        let values = values[at..at + channels.len()].iter().copied();
        values.zip(channels.iter().map(|channel| channel.range))
    });
    cells
        .flat_map(|value| number(value).to_ne_bytes())
        .collect()
}
