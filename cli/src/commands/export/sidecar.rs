//! The JSON beside an exported texture.

use aogrid_grid_format::{Grid, TexelFormat};
use serde::Serialize;

use super::flipbook::{self, Layout};
use crate::commands::info::GridJson;

/// The facts that a reader of an exported texture needs besides it.
#[derive(Serialize)]
pub(super) struct Sidecar {
    /// A channel of the texture for each value, in order.
    channels: Vec<ChannelJson>,
    /// The place of the slices, in a picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    flipbook: Option<Layout>,
    /// The grid that was exported, as `info --json` describes it.
    grid: GridJson,
}

/// A channel: value = scale · t + offset, where t is what a shader reads.
#[derive(Serialize)]
struct ChannelJson {
    name: &'static str,
    scale: f64,
    offset: f64,
}

/// Returns what belongs to a volume texture.
pub(super) fn volume(grid: &Grid) -> Sidecar {
    let format = grid.format();
    sidecar(grid, None, |range| format.decoding(range))
}

/// Returns what belongs to a picture of decoded values.
pub(super) fn decoded(grid: &Grid, layout: &Layout) -> Sidecar {
    let layout = Some(layout.clone());
    sidecar(grid, layout, |range| TexelFormat::F32.decoding(range))
}

/// Returns what belongs to a PNG.
pub(super) fn flipbook(grid: &Grid, layout: &Layout) -> Sidecar {
    let format = grid.format();
    let decoding = |range| flipbook::decoding(format, range);
    sidecar(grid, Some(layout.clone()), decoding)
}

fn sidecar(
    grid: &Grid,
    flipbook: Option<Layout>,
    decoding: impl Fn(aogrid_grid_format::ChannelRange) -> [f64; 2],
) -> Sidecar {
    let channels = grid.encoding().channel_list().iter().map(|channel| {
        let [scale, offset] = decoding(channel.range);
        ChannelJson {
            name: channel.name,
            scale,
            offset,
        }
    });
    Sidecar {
        channels: channels.collect(),
        flipbook,
        grid: GridJson::new(grid),
    }
}
