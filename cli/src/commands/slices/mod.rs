//! `slices`: a picture of a grid's slices for visual inspection.

mod sheet;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail};
use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::mesh::{self, MeshFile};
use aogrid_grid_format::Grid;

use super::info::read_grid;
use crate::console::Console;
use crate::output;
use crate::pictures::baked_model::BakedModel;
use crate::pictures::png;

/// Draw a grid's slices across an axis as one PNG: occlusion, directions as colors, the model's outline,
/// and the cells inside it
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// A grid file (*.ao.ktx2)
    file: PathBuf,
    /// The PNG to write
    #[arg(short, long, value_name = "PNG")]
    out: PathBuf,
    /// Model whose outline and interior to draw [default: the one the grid was baked from, if it
    /// lies beside the grid]
    #[arg(long, value_name = "MODEL")]
    mesh: Option<PathBuf>,
    /// The axis that the slices lie across
    #[arg(long, value_enum, default_value = "z")]
    axis: Axis,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

/// An axis of the grid.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Axis {
    X,
    Y,
    Z,
}

/// The examples at the end of `slices --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid slices table.ao.ktx2 -o table.png
  aogrid slices table.ao.ktx2 -o from-above.png --axis y
  aogrid slices table.ao.ktx2 --mesh assets/table.obj -o table.png";

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let grid = read_grid(&args.file)?;
    output::check_not_input(&args.out, &args.file)?;
    if let Some(mesh) = &args.mesh {
        output::check_not_input(&args.out, mesh)?;
    }
    output::check_new(&args.out, args.force)?;
    let model = match find_mesh(args, &grid, console)? {
        Some(mesh) => {
            let model = BakedModel::new(&grid, mesh, console);
            Some(model.with_context(|| args.file.display().to_string())?)
        }
        None => None,
    };
    let name = args.file.file_name().unwrap_or_default();
    let sheet = sheet::draw(
        &grid,
        model.as_ref(),
        args.axis as usize,
        &name.to_string_lossy(),
    );
    let (width, height) = (sheet.width(), sheet.height());
    output::write(&args.out, &png(&sheet)?)?;
    console.note(&format!("wrote {} ({width}×{height})", args.out.display()));
    Ok(())
}

/// Returns the mesh that the grid was baked from, or the one that the user named; `None` with a
/// note if there is neither.
fn find_mesh(
    args: &Args,
    grid: &Grid,
    console: &Console,
) -> anyhow::Result<Option<Arc<TriangleMesh>>> {
    let source = &grid.record().source;
    let beside = args.file.with_file_name(&source.name);
    let path: &Path = match &args.mesh {
        Some(path) => path,
        None => &beside,
    };
    if args.mesh.is_none() {
        let same = MeshFile::read(path).is_ok_and(|file| file.blake3() == source.blake3);
        if !same {
            let name = &source.name;
            console.note(&format!(
                "no outline and no interior: {name} is not beside the grid, or has changed since the \
                 bake; name the model with --mesh"
            ));
            return Ok(None);
        }
    }
    let loaded = mesh::load(path).with_context(|| path.display().to_string())?;
    if loaded.blake3 != source.blake3 {
        let shown = path.display();
        console.warning(&format!(
            "{shown} is not the model that the grid was baked from"
        ));
    }
    let Some(part) = &source.part else {
        let without = &grid.record().without;
        return match without.is_empty() {
            true => Ok(Some(Arc::new(loaded.mesh))),
            false => {
                let mesh = loaded.mesh.without(without);
                let mesh = mesh.with_context(|| path.display().to_string())?;
                Ok(Some(Arc::new(mesh)))
            }
        };
    };
    match loaded.mesh.parts().iter().position(|p| p.name == *part) {
        Some(idx) => Ok(Some(loaded.part(idx)?.mesh)),
        None => bail!("{}: it has no part `{part}`", path.display()),
    }
}
