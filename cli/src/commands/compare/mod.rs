//! `compare`: how far shading is from the truth, around the occluders of the accuracy suite.

mod suite;

use std::path::PathBuf;

use anyhow::bail;

use crate::commands::bake::use_threads;
use crate::console::Console;
use crate::interrupt;

/// Compare shading with the truth: run the accuracy suite
///
/// The suite bakes grids around many occluders and shades receivers in areas around them: near the
/// occluder on planes that touch it, on tilted planes, near it in free space, in the rest of the
/// grid's box, beyond it, and on the occluder itself. docs/accuracy.md explains the tables.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Run the accuracy suite: our own shapes and, where the folder AOGRID_SHARED is, real meshes
    #[arg(long)]
    suite: bool,
    /// Judge these occluders only: names of the suite's, or mesh files; several with commas between
    #[arg(long, value_name = "NAME|FILE", value_delimiter = ',')]
    only: Vec<String>,
    /// Judge rows whose name contains this only; several with commas between
    #[arg(long, value_name = "TEXT", value_delimiter = ',')]
    rows: Vec<String>,
    /// Receivers in each area of an occluder [default: 360]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    receivers: Option<u32>,
    /// Rays for the truth of a receiver [default: 4096]
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    samples: Option<u32>,
    /// Seed of the receivers and rays
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder for the receivers with their truth, and for the report suite.json
    #[arg(short, long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Take the truth that is in the folder already instead of tracing it again
    #[arg(long, requires = "out")]
    resume: bool,
    /// Report as one JSON object on stdout
    #[arg(long)]
    json: bool,
    /// Threads to work with [default: as many as there are processors]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

/// The examples at the end of `compare --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid compare --suite -o accuracy --resume
  aogrid compare --suite --only box,table --rows paper";

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    if !args.suite {
        bail!("name what to compare: --suite");
    }
    use_threads(args.threads)?;
    interrupt::listen();
    suite::run(args, console)
}
