//! `diff`: the differences between two grids of the same resolution.

use std::path::PathBuf;

use anyhow::bail;
use aogrid_grid_format::Grid;
use serde::Serialize;

use super::info::read_grid;
use crate::console::Console;

/// Compare two grids cell by cell
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// A grid file (*.ao.ktx2)
    a: PathBuf,
    /// Another grid file, of the same resolution
    b: PathBuf,
    /// Report as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// The examples at the end of `diff --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid diff sweep.ao.ktx2 monte-carlo.ao.ktx2
  aogrid diff a.ao.ktx2 b.ao.ktx2 --json";

/// The minimum occlusion fraction of cells whose axes are compared; below it, axes are dominated by
/// quantization and boundary treatment.
const MIN_OCCLUSION: f32 = 0.02;

#[derive(Serialize)]
struct Difference {
    /// Whether values, box and encoding are the same.
    equal: bool,
    same_box: bool,
    cells: usize,
    differing_cells: usize,
    occlusion_rms: f64,
    occlusion_max: f64,
    /// The cell (i, j, k) with the largest difference in occlusion.
    occlusion_max_at: [u32; 3],
    /// Number of cells whose axes are compared.
    axes: usize,
    axis_rms_degrees: f64,
    axis_max_degrees: f64,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let (a, b) = (read_grid(&args.a)?, read_grid(&args.b)?);
    if a.spec().resolution() != b.spec().resolution() {
        let (p, q) = (a.spec().resolution(), b.spec().resolution());
        let (a, b) = (args.a.display(), args.b.display());
        bail!("{a} and {b} have {p:?} and {q:?} cells: bake one of them again to compare");
    }
    let difference = compare(&a, &b);
    if args.json {
        return console.json(&difference);
    }
    let d = &difference;
    let same_box = if d.same_box { "the same" } else { "different" };
    console.result(&format!("box        {same_box}"));
    console.result(&format!(
        "cells      {} of {} differ",
        d.differing_cells, d.cells
    ));
    let (rms, max, at) = (d.occlusion_rms, d.occlusion_max, d.occlusion_max_at);
    console.result(&format!(
        "occlusion  rms {rms:.6}, max {max:.6} at cell {at:?}"
    ));
    if d.axes > 0 {
        let (rms, max, n) = (d.axis_rms_degrees, d.axis_max_degrees, d.axes);
        console.result(&format!(
            "axis       rms {rms:.3}°, max {max:.3}° over {n} cells"
        ));
    }
    Ok(())
}

fn compare(a: &Grid, b: &Grid) -> Difference {
    let cells = a.spec().cell_count();
    let both_cones = [a, b].iter().all(|grid| grid.encoding().has_direction());
    let (mut differing, mut squares, mut worst, mut at) = (0, 0.0, 0.0, 0);
    let mut angles = Vec::new();
    for idx in 0..cells {
        let (p, q) = (a.cell(idx), b.cell(idx));
        differing += usize::from(p != q);
        let off = (f64::from(p[3]) - f64::from(q[3])).abs();
        squares += off * off;
        if off > worst {
            (worst, at) = (off, idx);
        }
        if both_cones && p[3].min(q[3]) >= MIN_OCCLUSION {
            angles.extend(degrees_between(p, q));
        }
    }
    let same_box = a.spec() == b.spec();
    let mean_square = angles.iter().map(|v| v * v).sum::<f64>() / angles.len().max(1) as f64;
    Difference {
        equal: same_box && differing == 0 && a.encoding() == b.encoding(),
        same_box,
        cells,
        differing_cells: differing,
        occlusion_rms: (squares / cells as f64).sqrt(),
        occlusion_max: worst,
        occlusion_max_at: a.spec().cell_at(at),
        axes: angles.len(),
        axis_rms_degrees: mean_square.sqrt(),
        axis_max_degrees: angles.iter().copied().fold(0.0, f64::max),
    }
}

/// Returns the angle between two axes in degrees; `None` if either is zero.
fn degrees_between(p: [f32; 4], q: [f32; 4]) -> Option<f64> {
    let [p, q] = [p, q].map(|v| v.map(f64::from));
    let cross = [0, 1, 2].map(|x| {
        let (y, z) = ((x + 1) % 3, (x + 2) % 3);
        p[y] * q[z] - p[z] * q[y]
    });
    let dot = p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let sin = cross.iter().map(|v| v * v).sum::<f64>().sqrt();
    (sin != 0.0 || dot != 0.0).then(|| sin.atan2(dot).to_degrees())
}
