//! `export`: conversion of grids to other programs' formats, one file each.

mod dds;
mod exr;
mod flipbook;
mod sidecar;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use anyhow::ensure;
use aogrid_grid_format::Grid;
use clap::ValueEnum;

use super::info::read_grid;
use crate::console::Console;
use crate::{npy, output};
use flipbook::Layout;

/// Convert a grid to another program's format
///
/// Beside a DDS, EXR or PNG, a JSON file of the same name tells what the texture does not hold: the box,
/// the channels and how to decode them, the layout, and how the grid was baked.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// A grid file (*.ao.ktx2)
    file: PathBuf,
    /// The format
    #[arg(long, value_enum)]
    to: Target,
    /// The file to write
    #[arg(short, long, value_name = "OUT")]
    out: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

/// The examples at the end of `export --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid export table.ao.ktx2 --to dds -o table.dds
  aogrid export table.ao.ktx2 --to flipbook -o table.png
  aogrid export table.ao.ktx2 --to npy -o table.npy";

#[derive(Clone, Copy, ValueEnum)]
enum Target {
    /// NumPy array of decoded f32, shape (nz, ny, nx, channels), with the channels as stored: a; dx, dy,
    /// dz, a; or vx, vy, vz, sqrt_a
    Npy,
    /// Volume texture (DirectDraw surface, DX10) with the texels as stored
    Dds,
    /// Picture with the slices side by side, decoded, a named channel for each value: f16 of an f16 grid,
    /// else f32
    Exr,
    /// PNG with the slices side by side: 8 bits a channel of a unorm8 grid, else 16 bits
    Flipbook,
}

impl Target {
    fn ending(self) -> &'static str {
        match self {
            Self::Npy => "npy",
            Self::Dds => "dds",
            Self::Exr => "exr",
            Self::Flipbook => "png",
        }
    }
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let grid = read_grid(&args.file)?;
    output::check_not_input(&args.out, &args.file)?;
    check_ending(&args.out, args.to)?;
    output::check_new(&args.out, args.force)?;
    let layout = Layout::of(grid.spec().resolution());
    let (bytes, json) = match args.to {
        Target::Npy => return write_npy(&args.out, &grid, console),
        Target::Dds => (dds::encode(&grid)?, sidecar::volume(&grid)),
        Target::Exr => (
            exr::encode(&grid, &layout)?,
            sidecar::decoded(&grid, &layout),
        ),
        Target::Flipbook => (
            flipbook::encode(&grid, &layout)?,
            sidecar::flipbook(&grid, &layout),
        ),
    };
    let is_picture = matches!(args.to, Target::Exr | Target::Flipbook);
    if let Some(warning) = layout.warning().filter(|_| is_picture) {
        console.warning(&format!("{}: {warning}", args.out.display()));
    }
    let beside = args.out.with_extension("json");
    output::check_new(&beside, args.force)?;
    let json = serde_json::to_string_pretty(&json)? + "\n";
    output::write(&args.out, &bytes)?;
    output::write(&beside, json.as_bytes())?;
    let (out, beside) = (args.out.display(), beside.display());
    console.note(&format!("wrote {out} and {beside}"));
    Ok(())
}

/// Checks that a file's name says what it holds: other programs go by it.
fn check_ending(out: &Path, to: Target) -> anyhow::Result<()> {
    let ending = to.ending();
    let fits = out
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case(ending));
    ensure!(fits, "{}: its name must end in .{ending}", out.display());
    Ok(())
}

fn write_npy(out: &Path, grid: &Grid, console: &Console) -> anyhow::Result<()> {
    let [nx, ny, nz] = grid.spec().resolution().map(|n| n as usize);
    let shape = [nz, ny, nx, grid.encoding().channels()];
    npy::write(out, &shape, grid.decode())?;
    console.note(&format!("wrote {} of shape {shape:?}", out.display()));
    Ok(())
}
