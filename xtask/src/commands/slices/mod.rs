//! `slices`: a grid as a picture that a person can judge.

mod inside;
mod outline;
mod sheet;

use std::io::Cursor;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::mesh::{self, LoadedMesh};
use aogrid_bake_core::post::Classification;
use aogrid_grid_format::Grid;
use image::ImageFormat;

use super::info::read_grid;
use crate::console::Console;
use crate::output;

/// Draw a grid's slices across z as one PNG: occlusion, directions as colours, the outline of the
/// model, and which cells are inside it
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A grid file (*.ao.ktx2)
    file: PathBuf,
    /// The PNG to write
    #[arg(short, long, value_name = "PNG")]
    out: PathBuf,
    /// The model whose outline and inside to draw [default: the one the grid was baked from, if it lies
    /// beside the grid]
    #[arg(long, value_name = "MODEL")]
    mesh: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let grid = read_grid(&args.file)?;
    output::check(&args.out)?;
    output::check_not_input(&args.out, &args.file)?;
    if let Some(mesh) = &args.mesh {
        output::check_not_input(&args.out, mesh)?;
    }
    let model = match find_mesh(args, &grid, console)? {
        Some(mesh) => {
            let inside = inside::classify(&grid, &mesh, console)
                .with_context(|| args.file.display().to_string())?;
            Some(Model { mesh, inside })
        }
        None => None,
    };
    let name = args.file.file_name().unwrap_or_default();
    let sheet = sheet::draw(&grid, model.as_ref(), &name.to_string_lossy());
    let (width, height) = (sheet.width(), sheet.height());
    let mut png = Cursor::new(Vec::new());
    sheet
        .write_to(&mut png, ImageFormat::Png)
        .context("cannot encode the picture")?;
    output::write(&args.out, png.get_ref())?;
    console.note(&format!("wrote {} ({width}×{height})", args.out.display()));
    Ok(())
}

/// What a grid was baked from.
struct Model {
    mesh: TriangleMesh,
    inside: Classification,
}

/// The triangles that the grid was baked from, or those the user asked for.
fn find_mesh(args: &Args, grid: &Grid, console: &Console) -> anyhow::Result<Option<TriangleMesh>> {
    let source = &grid.record().source;
    let beside = args.file.with_file_name(&source.name);
    let path: &Path = match &args.mesh {
        Some(path) => path,
        None => &beside,
    };
    if args.mesh.is_none() {
        let same = LoadedMesh::identify(path).is_ok_and(|(_, blake3)| blake3 == source.blake3);
        if !same {
            let name = &source.name;
            console.note(&format!(
                "no outline and no inside: {name} is not beside the grid as it was baked; name it with --mesh"
            ));
            return Ok(None);
        }
    }
    let loaded = mesh::load(path).with_context(|| path.display().to_string())?;
    if loaded.blake3 != source.blake3 {
        let shown = path.display();
        console.warning(&format!("{shown} is not the model the grid was baked from"));
    }
    let Some(part) = &source.part else {
        return Ok(Some(loaded.mesh));
    };
    match loaded.mesh.parts().iter().position(|p| p.name == *part) {
        Some(idx) => Ok(Some(loaded.mesh.part(idx)?)),
        None => bail!("{}: it has no part `{part}`", path.display()),
    }
}
