//! `reproduce`: the papers' figures and tables as one report, with a verdict on each claim.

mod figures;
mod finding;
mod html;
mod misprints;
mod plot;
mod scenes;
mod steps;

use std::fs;
use std::path::PathBuf;

use anyhow::Context;
use aogrid::console::Console;
use aogrid::output;
use aogrid_baker_gpu::adapters;
use clap::builder::PossibleValuesParser;

use finding::Results;
use html::Judged;

/// Reproduce the papers' figures and tables: one HTML file with pictures, plots and verdicts
///
/// Each figure is made by commands of this program, which the report shows. Their outputs are kept in
/// the folder, so that a run that was cut off goes on where it stopped, and only what changed is made
/// again. The default quality takes some 20 minutes on two cores.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The folder of the report, report.html, and of all that it is made from
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Standard error of ray-traced truth: smaller takes longer
    #[arg(long, value_name = "E", default_value = "0.004", value_parser = error)]
    error: f64,
    /// Make only this figure; may be given several times
    #[arg(long, value_name = "FIGURE", value_parser = figure_names())]
    only: Vec<String>,
}

/// The examples at the end of `reproduce --help`.
const EXAMPLES: &str = "\
Examples:
  cargo xtask reproduce -o report
  cargo xtask reproduce -o report --only figure-11 --only table-1
  cargo xtask reproduce -o report --error 0.001";

/// Parses a standard error.
fn error(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        _ => Err("it must be a number between 0 and 1".into()),
    }
}

/// Accepts the names of figures.
fn figure_names() -> PossibleValuesParser {
    let all = figures::all(1.0, None);
    PossibleValuesParser::new(all.iter().map(|figure| figure.id).collect::<Vec<_>>())
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let adapter = adapters().into_iter().next().map(|adapter| adapter.name);
    let mut figures = figures::all(args.error, adapter.as_deref());
    let is_wanted = |figure: &figures::Figure| args.only.iter().any(|name| name == figure.id);
    figures.retain(|figure| args.only.is_empty() || is_wanted(figure));
    let folder = &args.out;
    for part in ["data", "models", "scenes"] {
        let path = folder.join(part);
        fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
    }
    let mut inputs = String::new();
    for (name, text) in scenes::all() {
        output::write(&folder.join(format!("scenes/{name}.toml")), text.as_bytes())?;
        inputs += &text;
    }
    let n = figures.len();
    let mut judged = Vec::new();
    for (idx, figure) in figures.into_iter().enumerate() {
        let mut results = Results(Vec::new());
        for step in &figure.steps {
            let output = steps::run(folder, figure.id, step, &inputs, console)?;
            results.0.push((step.name.clone(), output));
        }
        let finding = (figure.judge)(&results).with_context(|| figure.id)?;
        let (id, word) = (figure.id, finding.verdict.word());
        console.note(&format!("{id} ({} of {n}): {word}", idx + 1));
        judged.push(Judged { figure, finding });
    }
    let report = html::report(folder, &machine(), &judged, &misprints::all())?;
    let path = folder.join("report.html");
    output::write(&path, report.as_bytes())?;
    console.note(&format!("wrote {}", path.display()));
    Ok(())
}

/// Tells the machine that the times are of.
fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let level = aogrid_baker_cpu::Sweeper::simd_levels()[0];
    format!("Times are of this machine: {cores} cores, SIMD level {level}.")
}
