//! `diff`: the differences between two grids of the same resolution.

use std::path::PathBuf;

use anyhow::bail;
use aogrid_grid_format::{Grid, GridSpec};
use serde::Serialize;

use super::info::read_grid;
use crate::console::Console;

/// Compare two grids cell by cell
///
/// Exit status 1 if they differ.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// A grid file (*.ao.ktx2)
    a: PathBuf,
    /// Another grid file, of the same resolution
    b: PathBuf,
    /// Largest difference that passes: of occlusion and of its components along the axes, and of the
    /// boxes in cells
    #[arg(long, value_name = "T", default_value_t = 0.0, value_parser = tolerance)]
    tolerance: f64,
    /// Report as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// The examples at the end of `diff --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid diff sweep.ao.ktx2 monte-carlo.ao.ktx2
  aogrid diff a.ao.ktx2 b.ao.ktx2 --tolerance 0.01 --json";

/// The minimum occlusion fraction of cells whose axes are compared; below it, axes are dominated by
/// quantization and boundary treatment.
const MIN_OCCLUSION: f32 = 0.02;

#[derive(Serialize)]
struct Difference {
    /// Whether values, box and encoding are the same.
    equal: bool,
    /// Whether all differences are within the tolerance.
    within_tolerance: bool,
    same_box: bool,
    /// The largest difference of the boxes' sides, in cells of the first grid.
    box_max_cells: f64,
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
    let difference = compare(&a, &b, args.tolerance);
    match args.json {
        true => console.json(&difference)?,
        false => print(&difference, console),
    }
    if difference.within_tolerance {
        return Ok(());
    }
    let (a, b) = (args.a.display(), args.b.display());
    match args.tolerance {
        0.0 => bail!("{a} and {b} differ"),
        tolerance => bail!("{a} and {b} differ by more than {tolerance}"),
    }
}

fn print(d: &Difference, console: &Console) {
    console.result(&match d.same_box {
        true => "box        the same".to_owned(),
        false => format!("box        differs by up to {:.4} cells", d.box_max_cells),
    });
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
}

fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(v) if v >= 0.0 && f64::is_finite(v) => Ok(v),
        _ => Err("it must be a number from zero".into()),
    }
}

/// Returns the largest difference of the sides of two boxes, in cells of the first grid.
fn box_difference(a: &GridSpec, b: &GridSpec) -> f64 {
    let sides = |spec: &GridSpec, x: usize| {
        let center = spec.origin()[x] + f64::from(spec.center()[x]);
        let half = f64::from(spec.half_extents()[x]);
        [center - half, center + half]
    };
    let of_axis = |x: usize| {
        let (a_sides, b_sides) = (sides(a, x), sides(b, x));
        let largest = (0..2).map(|side| (a_sides[side] - b_sides[side]).abs());
        largest.fold(0.0, f64::max) / a.cell_size()[x]
    };
    (0..3).map(of_axis).fold(0.0, f64::max)
}

fn compare(a: &Grid, b: &Grid, tolerance: f64) -> Difference {
    let cells = a.spec().cell_count();
    let both_cones = [a, b].iter().all(|grid| grid.encoding().has_direction());
    let (mut differing, mut squares, mut worst, mut at) = (0, 0.0, 0.0, 0);
    let mut along_axes = 0.0;
    let mut angles = Vec::new();
    for idx in 0..cells {
        let (p, q) = (a.cell(idx), b.cell(idx));
        differing += usize::from(p != q);
        let off = (f64::from(p[3]) - f64::from(q[3])).abs();
        squares += off * off;
        if off > worst {
            (worst, at) = (off, idx);
        }
        // Axes are noise if little is occluded; times the occlusion they count as little.
        let component = |cone: [f32; 4], x: usize| f64::from(cone[x]) * f64::from(cone[3]);
        let components = (0..3).map(|x| (component(p, x) - component(q, x)).abs());
        along_axes = components.fold(along_axes, f64::max);
        if both_cones && p[3].min(q[3]) >= MIN_OCCLUSION {
            angles.extend(degrees_between(p, q));
        }
    }
    let same_box = a.spec() == b.spec();
    let same_encoding = a.encoding() == b.encoding();
    let box_max_cells = box_difference(a.spec(), b.spec());
    let equal = same_box && differing == 0 && same_encoding;
    let largest = f64::max(worst, box_max_cells);
    // Only one of two encodings may have axes.
    let largest = if both_cones {
        largest.max(along_axes)
    } else {
        largest
    };
    let mean_square = angles.iter().map(|v| v * v).sum::<f64>() / angles.len().max(1) as f64;
    Difference {
        equal,
        within_tolerance: equal || tolerance > 0.0 && same_encoding && largest <= tolerance,
        same_box,
        box_max_cells,
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
