//! `compare`: how far shading is from the truth, in a scene or around the occluders of the accuracy
//! suite.

mod panels;
mod scene;
mod suite;

use std::path::PathBuf;

use aogrid_scene::compare::ModeErrors;
use aogrid_scene::shade::{Mode, Shaded, Target};
use aogrid_scene::suite::Area;

use crate::commands::bake::use_threads;
use crate::commands::render::{mode_parser, positive};
use crate::console::Console;
use crate::interrupt;
use crate::usage::usage;

/// Compare shading with the truth: in a scene, or in the accuracy suite
///
/// Errors are told by area: near an occluder on planes that touch it, on tilted planes, near it in
/// free space, in the rest of the box of the papers' grid, beyond it, and on the occluder itself.
/// docs/accuracy.md explains them and the suite.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The scene file whose modes are compared with its truth
    #[arg(required_unless_present = "suite", conflicts_with = "suite")]
    scene: Option<PathBuf>,
    /// Shading mode of the scene; several with commas between [default: all that need no light]
    #[arg(long, value_parser = mode_parser(), value_delimiter = ',', conflicts_with = "suite")]
    mode: Vec<&'static Mode>,
    /// Standard error of a scene's truth to reach [default: the scene's, else 0.002]
    #[arg(long, value_name = "E", value_parser = positive, conflicts_with = "suite")]
    error: Option<f64>,
    /// Run the accuracy suite: our own shapes and, where the folder AOGRID_SHARED is, real meshes
    #[arg(long)]
    suite: bool,
    /// Judge these occluders only: names of the suite's, or mesh files; several with commas between
    #[arg(
        long,
        value_name = "NAME|FILE",
        value_delimiter = ',',
        requires = "suite"
    )]
    only: Vec<String>,
    /// Judge rows whose name contains this only; several with commas between
    #[arg(long, value_name = "TEXT", value_delimiter = ',', requires = "suite")]
    rows: Vec<String>,
    /// Receivers in each area of an occluder [default: 360]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1_000_000), requires = "suite")]
    receivers: Option<u32>,
    /// Rays for the truth of a receiver; with --error the most that one gets [default: the scene's,
    /// else 8192; in the suite 4096]
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    samples: Option<u32>,
    /// Seed of the rays, and of the suite's receivers [default: the scene's, else 0]
    #[arg(long)]
    seed: Option<u64>,
    /// The file for a scene's panels (.png) or its receivers (.csv), or both; for the suite, the
    /// folder for its receivers with their truth, and for the report suite.json
    #[arg(short, long)]
    out: Vec<PathBuf>,
    /// Take the truth that is in the suite's folder already instead of tracing it again
    #[arg(long, requires = "suite", requires = "out")]
    resume: bool,
    /// Report as one JSON object on stdout
    #[arg(long)]
    json: bool,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Threads to work with [default: as many as there are processors]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

/// The receivers with what the modes and truth make of them.
struct Compared<'a> {
    target: &'a Target,
    truth: &'a Shaded,
    modes: &'a [(&'static Mode, Shaded)],
    areas: &'a [Option<Area>],
    errors: &'a [ModeErrors],
}

/// The examples at the end of `compare --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid compare scenes/table.toml --mode cone,merge -o table.png -o table.csv
  aogrid compare --suite -o accuracy --resume
  aogrid compare --suite --only box,table --rows paper";

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    use_threads(args.threads)?;
    interrupt::listen();
    match (&args.scene, args.out.as_slice()) {
        (Some(path), _) => scene::run(args, path, console),
        (None, out @ ([] | [_])) => suite::run(args, out.first().map(PathBuf::as_path), console),
        (None, _) => Err(usage("the suite writes to one folder: give -o once")),
    }
}
