//! `man`: manual pages.

use std::fs;
use std::path::PathBuf;

use anyhow::Context;
use clap::CommandFactory;

use crate::console::Console;
use crate::output;

/// Write a manual page for each command into a folder
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The folder; it is made if it is missing
    #[arg(short, long, value_name = "FOLDER")]
    out: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

/// The examples at the end of `man --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid man -o ~/.local/share/man/man1
  aogrid man -o man";

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let shown = || args.out.display().to_string();
    fs::create_dir_all(&args.out).with_context(shown)?;
    output::check_new(&args.out.join("aogrid.1"), args.force)?;
    clap_mangen::generate_to(crate::Cli::command(), &args.out).with_context(shown)?;
    console.note(&format!("wrote the manual pages into {}", shown()));
    Ok(())
}
