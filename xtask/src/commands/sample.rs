//! `sample`: the built-in models as OBJ files.

use std::path::PathBuf;

use aogrid_bake_core::samples::{Sample, to_obj};
use clap::builder::PossibleValue;

use crate::console::Console;
use crate::output;

/// Write one of the built-in models as an OBJ file
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The model to write
    #[arg(value_enum)]
    name: SampleArg,
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
  cargo xtask sample robot -o robot.obj
  cargo xtask sample torus --triangles 100000 -o torus.obj";

#[derive(Clone, Copy)]
struct SampleArg(Sample);

impl clap::ValueEnum for SampleArg {
    fn value_variants<'a>() -> &'a [Self] {
        const {
            &[
                Self(Sample::ALL[0]),
                Self(Sample::ALL[1]),
                Self(Sample::ALL[2]),
                Self(Sample::ALL[3]),
                Self(Sample::ALL[4]),
                Self(Sample::ALL[5]),
                Self(Sample::ALL[6]),
                Self(Sample::ALL[7]),
                Self(Sample::ALL[8]),
                Self(Sample::ALL[9]),
                Self(Sample::ALL[10]),
                Self(Sample::ALL[11]),
                Self(Sample::ALL[12]),
                Self(Sample::ALL[13]),
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
