//! `sample`: the built-in models as OBJ files.

use std::path::PathBuf;

use aogrid_bake_core::models::{Model, to_obj};
use clap::builder::{PossibleValuesParser, TypedValueParser};

use crate::console::Console;
use crate::output;

/// Write one of the built-in models as an OBJ file
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The model to write
    #[arg(value_parser = model_parser())]
    name: Model,
    /// The OBJ file to write
    #[arg(short, long, value_name = "OBJ")]
    out: PathBuf,
    /// Refine the model to this many triangles, or one more
    #[arg(long, value_name = "N")]
    triangles: Option<usize>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

/// The examples at the end of `sample --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid model robot -o robot.obj
  aogrid model torus --triangles 100000 -o torus.obj";

/// Returns the parser of models' names.
fn model_parser() -> impl TypedValueParser<Value = Model> {
    PossibleValuesParser::new(Model::ALL.map(Model::name)).map(|name| {
        let model = Model::ALL.into_iter().find(|model| model.name() == name);
        model.expect("clap has checked the name")
    })
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    output::check_new(&args.out, args.force)?;
    let mesh = args.name.mesh(args.triangles)?;
    output::write(&args.out, to_obj(&mesh).as_bytes())?;
    console.note(&format!(
        "wrote {} ({} triangles in {} parts)",
        args.out.display(),
        mesh.triangles().len(),
        mesh.parts().len()
    ));
    Ok(())
}
