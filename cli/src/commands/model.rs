//! `sample`: the built-in models as OBJ files.

use std::path::PathBuf;

use aogrid_bake_core::models::{Model, to_obj};
use clap::builder::PossibleValue;

use crate::console::Console;
use crate::output;

/// Write one of the built-in models as an OBJ file
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The model to write
    #[arg(value_enum)]
    name: ModelArg,
    /// The OBJ file to write
    #[arg(short, long, value_name = "OBJ")]
    out: PathBuf,
    /// Refine the model to this many triangles, or one more
    #[arg(long, value_name = "N")]
    triangles: Option<usize>,
}

/// The examples at the end of `sample --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid model robot -o robot.obj
  aogrid model torus --triangles 100000 -o torus.obj";

#[derive(Clone, Copy)]
struct ModelArg(Model);

impl clap::ValueEnum for ModelArg {
    fn value_variants<'a>() -> &'a [Self] {
        const {
            &[
                Self(Model::ALL[0]),
                Self(Model::ALL[1]),
                Self(Model::ALL[2]),
                Self(Model::ALL[3]),
                Self(Model::ALL[4]),
                Self(Model::ALL[5]),
                Self(Model::ALL[6]),
                Self(Model::ALL[7]),
                Self(Model::ALL[8]),
                Self(Model::ALL[9]),
                Self(Model::ALL[10]),
                Self(Model::ALL[11]),
                Self(Model::ALL[12]),
                Self(Model::ALL[13]),
            ]
        }
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.0.name()))
    }
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    output::check(&args.out)?;
    let mesh = args.name.0.mesh(args.triangles)?;
    output::write(&args.out, to_obj(&mesh).as_bytes())?;
    console.note(&format!(
        "wrote {} ({} triangles in {} parts)",
        args.out.display(),
        mesh.triangles().len(),
        mesh.parts().len()
    ));
    Ok(())
}
