//! The tables as EXR images for other programs.

use std::io::Cursor;

use anyhow::Context;
use aogrid_tables::{ClipTable, MergeTable};
use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, SmallVec, WritableImage};

/// Returns T_clip as an EXR image with one pixel a node: a to the right, cos β downwards from 1 to
/// −1; channels `AO`, `a'` and `f`.
pub(super) fn clip_exr(table: &ClipTable) -> anyhow::Result<Vec<u8>> {
    let [width, height] = table.size();
    let nodes = || {
        (0..height)
            .rev()
            .flat_map(|y| (0..width).map(move |x| table.node(x, y)))
    };
    let channels = vec![
        channel("AO", nodes().map(|node| node.occlusion)),
        channel("a'", nodes().map(|node| node.fraction)),
        channel("f", nodes().map(|node| node.axis_weight)),
    ];
    exr([width, height], channels)
}

/// Returns T_merge as an EXR image with one pixel a pair of fractions, a1 to the right, a2 upwards;
/// a channel for each γ, named `gamma.00` for γ = 0 to `gamma.31` for γ = π.
pub(super) fn merge_exr(table: &MergeTable) -> anyhow::Result<Vec<u8>> {
    let [width, height, depth] = table.size();
    let channels = (0..depth).map(|z| {
        let rows = (0..height).rev();
        let nodes = rows.flat_map(|y| (0..width).map(move |x| table.node(x, y, z)));
        channel(&format!("gamma.{z:02}"), nodes)
    });
    exr([width, height], channels.collect())
}

fn channel(name: &str, samples: impl Iterator<Item = f32>) -> AnyChannel<FlatSamples> {
    AnyChannel::new(name, FlatSamples::F32(samples.collect()))
}

fn exr(size: [usize; 2], channels: Vec<AnyChannel<FlatSamples>>) -> anyhow::Result<Vec<u8>> {
    let channels = AnyChannels::sort(SmallVec::from_vec(channels));
    let image = Image::from_channels((size[0], size[1]), channels);
    let mut bytes = Cursor::new(Vec::new());
    image
        .write()
        .to_buffered(&mut bytes)
        .context("cannot encode the EXR image")?;
    Ok(bytes.into_inner())
}
