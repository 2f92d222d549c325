//! `verify`: checks that grid files are intact and agree with their metadata.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use aogrid_grid_format::{BoundaryMode, Encoding, Grid};

use super::info::read_grid;
use crate::console::Console;

/// Check that grid files are intact and agree with their own metadata
///
/// Beyond what every reader checks (layout, ranges): texels have the recorded hash, mean and
/// largest occlusion are as recorded, a treated boundary is zero, axes have length one or zero.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Grid files (*.ao.ktx2), or folders of them
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
}

/// The examples at the end of `verify --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid verify table.ao.ktx2
  aogrid verify box.ao.ktx2 robot.ao.ktx2
  aogrid verify grids";

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let mut files = Vec::new();
    for path in &args.files {
        match path.is_dir() {
            true => files.extend(grids_in(path)?),
            false => files.push(path.to_owned()),
        }
    }
    let mut last = None;
    for path in &files {
        let failure = match read_grid(path) {
            Ok(grid) => violation(&grid).map(|text| anyhow::anyhow!("{}: {text}", path.display())),
            Err(error) => Some(error),
        };
        match failure {
            // Each broken file gets a line; the last one becomes the command's own error.
            Some(error) => {
                if let Some(earlier) = last.replace(error) {
                    console.error(&earlier);
                }
            }
            None => console.result(&format!("{}: ok", path.display())),
        }
    }
    last.map_or(Ok(()), Err)
}

/// Returns the grid files of a folder, sorted by name.
fn grids_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let shown = || folder.display().to_string();
    let mut grids = Vec::new();
    for entry in fs::read_dir(folder).with_context(shown)? {
        let path = entry.with_context(shown)?.path();
        if path
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("ktx2"))
        {
            grids.push(path);
        }
    }
    // Without this, a batch that made nothing would pass.
    ensure!(!grids.is_empty(), "{}: it has no grids (*.ktx2)", shown());
    grids.sort();
    Ok(grids)
}

/// Returns the first violated condition of a grid that was read without an error.
fn violation(grid: &Grid) -> Option<String> {
    if !grid.is_unchanged() {
        return Some("its texels were changed after the bake".into());
    }
    let (recorded, measured) = (grid.statistics(), grid.measure());
    if recorded != measured {
        return Some(format!(
            "its metadata were changed after the bake: mean and largest occlusion are {} and {}, \
             but {} and {} are recorded",
            measured.mean, measured.largest, recorded.mean, recorded.largest
        ));
    }
    let (spec, cells) = (grid.spec(), 0..grid.spec().cell_count());
    let treated = grid.record().boundary.applied != BoundaryMode::None;
    let mut outer = cells
        .clone()
        .filter(|&idx| spec.is_outer(spec.cell_at(idx)));
    if treated && let Some(idx) = outer.find(|&idx| grid.cell(idx)[3] != 0.0) {
        let cell = spec.cell_at(idx);
        return Some(format!(
            "occlusion at its boundary cell {cell:?} is not zero"
        ));
    }
    if grid.encoding().has_direction()
        && let Some(idx) = cells.into_iter().find(|&idx| !has_valid_axis(grid, idx))
    {
        let cell = spec.cell_at(idx);
        return Some(format!(
            "the axis of cell {cell:?} has {}",
            match grid.encoding() {
                Encoding::Moment => "a length above 1",
                _ => "neither length 1 nor 0",
            }
        ));
    }
    None
}

/// Whether the axis of a cell has length 1 or 0, or at most 1 for moments, within the format's
/// error.
fn has_valid_axis(grid: &Grid, idx: usize) -> bool {
    let [x, y, z, _] = grid.cell(idx);
    let length = (x * x + y * y + z * z).sqrt();
    // Errors of the three components, each up to the format's error, change the length by up to √3
    // times that; single floats round by a few units in the last place.
    let [_, max_error] = grid.encoding().max_error(grid.format());
    let tolerance = 3.0_f32.sqrt() * max_error + 4.0 * f32::EPSILON;
    match grid.encoding() {
        Encoding::Moment => length <= 1.0 + tolerance,
        _ => length == 0.0 || (length - 1.0).abs() <= tolerance,
    }
}
