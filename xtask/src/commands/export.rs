//! `export`: grids for other programs.

use std::path::PathBuf;

use aogrid_grid_format::Grid;
use clap::ValueEnum;
use npyz::WriterBuilder;

use super::info::read_grid;
use crate::console::Console;
use crate::output;

/// Write a grid in another program's format
#[derive(clap::Args)]
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
}

#[derive(Clone, Copy, ValueEnum)]
enum Target {
    Npy,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let grid = read_grid(&args.file)?;
    let shape = match args.to {
        Target::Npy => write_npy(args, &grid)?,
    };
    console.note(&format!("wrote {} of shape {shape:?}", args.out.display()));
    Ok(())
}

fn write_npy(args: &Args, grid: &Grid) -> anyhow::Result<[u64; 4]> {
    let [nx, ny, nz] = grid.spec().resolution().map(u64::from);
    let shape = [nz, ny, nx, grid.encoding().channels() as u64];
    output::write_with(&args.out, |file| {
        let mut writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(&shape)
            .writer(file)
            .begin_nd()?;
        writer.extend(grid.decode())?;
        writer.finish()
    })?;
    Ok(shape)
}
