//! `export`: conversion of grids to other programs' formats.

use std::path::PathBuf;

use aogrid_grid_format::Grid;
use clap::ValueEnum;

use super::info::read_grid;
use crate::console::Console;
use crate::{npy, output};

/// Convert a grid to another program's format
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// A grid file (*.ao.ktx2)
    file: PathBuf,
    /// The format: npy is a NumPy array of decoded f32, shape (nz, ny, nx, channels), with
    /// the channels a or dx, dy, dz, a
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
  aogrid export table.ao.ktx2 --to npy -o table.npy
  python3 -c 'import numpy; print(numpy.load(\"table.npy\").shape)'";

#[derive(Clone, Copy, ValueEnum)]
enum Target {
    Npy,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let grid = read_grid(&args.file)?;
    output::check_not_input(&args.out, &args.file)?;
    output::check_new(&args.out, args.force)?;
    let shape = match args.to {
        Target::Npy => write_npy(args, &grid)?,
    };
    console.note(&format!("wrote {} of shape {shape:?}", args.out.display()));
    Ok(())
}

fn write_npy(args: &Args, grid: &Grid) -> anyhow::Result<[usize; 4]> {
    let [nx, ny, nz] = grid.spec().resolution().map(|n| n as usize);
    let shape = [nz, ny, nx, grid.encoding().channels()];
    npy::write(&args.out, &shape, grid.decode())?;
    Ok(shape)
}
