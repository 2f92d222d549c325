//! `verify`: whether grid files are whole and agree with what they say of themselves.

use std::path::PathBuf;

use aogrid_grid_format::{BoundaryMode, Encoding, Grid};

use super::info::read_grid;
use crate::console::Console;

/// Check that grid files are whole and agree with their own metadata
///
/// Beyond what every reader checks (layout, ranges): mean and largest occlusion are as
/// recorded, a treated boundary is zero, axes have length one or zero.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Grid files (*.ao.ktx2)
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let mut last = None;
    for path in &args.files {
        let fault = match read_grid(path) {
            Ok(grid) => fault(&grid).map(|fault| anyhow::anyhow!("{}: {fault}", path.display())),
            Err(error) => Some(error),
        };
        match fault {
            // One line for each broken file; the last is the command's own error.
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

/// What is wrong with a grid that reads well.
fn fault(grid: &Grid) -> Option<String> {
    let (recorded, measured) = (grid.statistics(), grid.measure());
    if recorded != measured {
        return Some(format!(
            "its texels were changed after the bake: mean and largest occlusion are {} and {}, \
             recorded are {} and {}",
            measured.mean, measured.largest, recorded.mean, recorded.largest
        ));
    }
    let (spec, cells) = (grid.spec(), 0..grid.spec().cell_count());
    let treated = grid.record().boundary.applied != BoundaryMode::None;
    let mut outer = cells
        .clone()
        .filter(|&idx| spec.is_outer(spec.cell_at(idx)));
    if treated && let Some(idx) = outer.find(|&idx| grid.cone(idx)[3] != 0.0) {
        let cell = spec.cell_at(idx);
        return Some(format!(
            "occlusion at its boundary cell {cell:?} is not zero"
        ));
    }
    if grid.encoding() == Encoding::Cone
        && let Some(idx) = cells.into_iter().find(|&idx| !has_axis(grid, idx))
    {
        let cell = spec.cell_at(idx);
        return Some(format!(
            "the axis of cell {cell:?} has neither length 1 nor 0"
        ));
    }
    None
}

fn has_axis(grid: &Grid, idx: usize) -> bool {
    let [x, y, z, _] = grid.cone(idx);
    let length = (x * x + y * y + z * z).sqrt();
    // The error of three components, each up to the format's, lengthens the axis by up to √3
    // times it; single floats round by a few units in the last place.
    let tolerance = 3.0_f32.sqrt() * grid.format().max_error()[1] + 4.0 * f32::EPSILON;
    length == 0.0 || (length - 1.0).abs() <= tolerance
}
