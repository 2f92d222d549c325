//! The choice of a resolution by memory and by error.

use anyhow::bail;
use aogrid_bake_core::{BakeOptions, Placement};
use aogrid_grid_format::{Grid, MAX_RESOLUTION, MIN_RESOLUTION};

use super::check::contact_error;
use crate::usage::usage;

/// The resolutions that `--max-error` tries, in this order.
const CANDIDATES: [u32; 13] = [8, 12, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96];

/// Returns the largest number of cells along each axis whose texels take at most `max_bytes`.
pub(super) fn resolution_within(max_bytes: u64, options: &BakeOptions) -> anyhow::Result<u32> {
    let fits = |n: u32| bytes(n, options) <= max_bytes;
    match (MIN_RESOLUTION..=MAX_RESOLUTION)
        .take_while(|&n| fits(n))
        .last()
    {
        Some(n) => Ok(n),
        None => Err(usage(format!(
            "--max-bytes {max_bytes}: the smallest grid, {MIN_RESOLUTION}³, takes {} bytes",
            bytes(MIN_RESOLUTION, options)
        ))),
    }
}

/// Returns the bytes that the texels of an n³ grid take.
fn bytes(n: u32, options: &BakeOptions) -> u64 {
    let texel = options.encoding.channels() * options.format.channel_bytes();
    u64::from(n).pow(3) * texel as u64
}

/// Returns the first of the grids that `bake` makes whose error is at most `max_error`, in the order
/// of their size, at most `max_bytes` large.
pub(super) fn within_error(
    max_error: f32,
    max_bytes: Option<u64>,
    placement: &Placement,
    options: &BakeOptions,
    mut bake: impl FnMut(&Placement) -> anyhow::Result<Grid>,
) -> anyhow::Result<Grid> {
    let limit = max_bytes.unwrap_or(u64::MAX);
    let mut best: Option<(f32, u32)> = None;
    for n in CANDIDATES
        .into_iter()
        .filter(|&n| bytes(n, options) <= limit)
    {
        let grid = bake(&Placement {
            resolution: [n; 3],
            ..*placement
        })?;
        let error = grid.record().check.as_ref().map_or(0.0, contact_error);
        if error <= max_error {
            return Ok(grid);
        }
        if best.is_none_or(|(least, _)| error < least) {
            best = Some((error, n));
        }
    }
    match best {
        Some((error, n)) => bail!(
            "no resolution up to the limit has an error of {max_error} or less: the least is \
             {error:.4}, at {n}³; allow more bytes or a larger error"
        ),
        None => bail!("--max-bytes {limit} is less than the smallest grid takes"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aogrid_bake_core::Preset;

    #[test]
    fn the_largest_grid_within_the_bytes_is_chosen() {
        let options = Preset::Default.options();
        assert_eq!(resolution_within(4 * 32 * 32 * 32, &options).unwrap(), 32);
        assert_eq!(
            resolution_within(4 * 32 * 32 * 32 - 1, &options).unwrap(),
            31
        );
        let error = resolution_within(2047, &options).unwrap_err();
        assert!(error.to_string().contains("2048"), "{error}");
    }
}
