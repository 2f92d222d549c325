//! Pictures of decoded values with a channel for each, named as in the encoding.

use std::io::Cursor;

use anyhow::Context;
use aogrid_grid_format::{Channel, Grid, TexelFormat};
use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, SmallVec, WritableImage};
use half::f16;

use super::flipbook::Layout;

/// Returns a grid as an EXR picture.
pub(super) fn encode(grid: &Grid, layout: &Layout) -> anyhow::Result<Vec<u8>> {
    let channels = grid.encoding().channel_list();
    let values = grid.decode();
    let channel = |(idx, channel): (usize, &Channel)| {
        let cells = layout.cells();
        let values = cells.map(|cell| values[grid.spec().cell_idx(cell) * channels.len() + idx]);
        let samples = match grid.format() {
            // An f16 grid's values are f16 already.
            TexelFormat::F16 => FlatSamples::F16(values.map(f16::from_f32).collect()),
            TexelFormat::Unorm8 | TexelFormat::F32 => FlatSamples::F32(values.collect()),
        };
        AnyChannel::new(channel.name, samples)
    };
    let channels: SmallVec<_> = channels.iter().enumerate().map(channel).collect();
    let [width, height] = layout.size.map(|n| n as usize);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_channels((width, height), AnyChannels::sort(channels))
        .write()
        .to_buffered(&mut bytes)
        .context("cannot encode the EXR picture")?;
    Ok(bytes.into_inner())
}
