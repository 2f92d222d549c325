//! The commands of aogrid, one file each, called as `cargo xtask COMMAND`.
//!
//! Exit status: 0 done, 1 failed, 2 wrong usage. A failure prints one line on stderr; wrong usage
//! prints a hint. Output is written to a temporary file and renamed, so that a killed command
//! leaves an existing file intact.

mod backend;
mod canvas;
mod commands;
mod console;
mod interrupt;
mod npy;
mod output;
pub mod parity;
pub mod scene;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use commands::{
    adapters, bake, bench, ci, diff, export, info, model, render, shader_cost, slices, tables,
    verify, verify_bake,
};
use console::Console;

#[derive(Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    version,
    about,
    max_term_width = 100
)]
#[command(disable_help_subcommand = true)]
struct Cli {
    /// Print no progress and no notes, only results, warnings and errors
    #[arg(long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Bake(Box<bake::Args>),
    Info(info::Args),
    Verify(verify::Args),
    VerifyBake(verify_bake::Args),
    Diff(diff::Args),
    Slices(slices::Args),
    #[command(alias = "sample")]
    Model(model::Args),
    Export(export::Args),
    Render(Box<render::Args>),
    Bench(bench::Args),
    Adapters(adapters::Args),
    Tables(tables::Args),
    ShaderCost(shader_cost::Args),
    /// Check everything that must hold before a change lands: tables, format, clippy,
    /// docs, tests
    #[command(after_help = CI_EXAMPLES)]
    Ci,
}

/// The examples at the end of `ci --help`.
const CI_EXAMPLES: &str = "\
Examples:
  cargo xtask ci
  AOGRID_GPU=require cargo xtask ci";

/// Runs the command that the process was called with.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    let console = Console::new(cli.quiet);
    let result = match cli.command {
        Command::Bake(args) => bake::run(&args, &console),
        Command::Info(args) => info::run(&args, &console),
        Command::Verify(args) => verify::run(&args, &console),
        Command::VerifyBake(args) => verify_bake::run(&args, &console),
        Command::Diff(args) => diff::run(&args, &console),
        Command::Slices(args) => slices::run(&args, &console),
        Command::Model(args) => model::run(&args, &console),
        Command::Export(args) => export::run(&args, &console),
        Command::Render(args) => render::run(&args, &console),
        Command::Bench(args) => bench::run(&args, &console),
        Command::Adapters(args) => adapters::run(&args, &console),
        Command::Tables(args) => tables::run(&args, &console),
        Command::ShaderCost(args) => shader_cost::run(&args, &console),
        Command::Ci => ci::run(&console),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console.error(&error);
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn every_command_has_two_or_three_examples_that_parse() {
        for command in Cli::command().get_subcommands() {
            let name = command.get_name();
            let help = command.get_after_help().map(ToString::to_string);
            let help = help.unwrap_or_else(|| panic!("{name} has no examples"));
            let (heading, examples) = help.split_once('\n').unwrap();
            assert_eq!(heading, "Examples:", "{name}");
            assert!((2..=3).contains(&examples.lines().count()), "{name}");
            for example in examples.lines() {
                // An example may set a variable first, or show what to do with the output.
                let Some((_, line)) = example.split_once("cargo xtask ") else {
                    continue;
                };
                let words = ["xtask"].into_iter().chain(line.split_whitespace());
                if let Err(error) = Cli::try_parse_from(words) {
                    panic!("{example}: {error}");
                }
                assert!(line.starts_with(name), "{example}");
            }
        }
    }
}
