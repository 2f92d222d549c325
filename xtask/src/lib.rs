//! The commands for developers of aogrid, one file each, called as `cargo xtask COMMAND`, and the
//! product's own commands.
//!
//! Exit status: 0 done, 1 failed, 2 wrong usage. A failure prints one line on stderr; wrong usage
//! prints a hint.

mod commands;

use std::process::ExitCode;

use aogrid::console::Console;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use commands::{bench, bench_shading, ci, reproduce, shader_cost, tables, verify_bake};

#[derive(Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    version,
    about = "The commands of aogrid, and those for its developers",
    max_term_width = 100
)]
struct Cli {
    /// Print no progress and no notes, only results, warnings and errors
    #[arg(long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    #[command(flatten)]
    Product(aogrid::Command),
    VerifyBake(verify_bake::Args),
    Bench(bench::Args),
    BenchShading(bench_shading::Args),
    Reproduce(reproduce::Args),
    Tables(tables::Args),
    ShaderCost(shader_cost::Args),
    Ci(ci::Args),
}

/// Returns the command line, with the product's examples as they are called here.
fn command() -> clap::Command {
    Cli::command().mut_subcommands(|command| {
        let help = command.get_after_help().map(ToString::to_string);
        let help = help.unwrap_or_default();
        command.after_help(help.replace("  aogrid ", "  cargo xtask "))
    })
}

/// Runs the command that the process was called with.
pub fn run() -> ExitCode {
    let matches = command().get_matches();
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let console = Console::new(cli.quiet);
    let result = match cli.command {
        Command::Product(command) => command.run(&console),
        Command::VerifyBake(args) => verify_bake::run(&args, &console),
        Command::Bench(args) => bench::run(&args, &console),
        Command::BenchShading(args) => bench_shading::run(&args, &console),
        Command::Reproduce(args) => reproduce::run(&args, &console),
        Command::Tables(args) => tables::run(&args, &console),
        Command::ShaderCost(args) => shader_cost::run(&args, &console),
        Command::Ci(args) => ci::run(&args, &console),
    };
    aogrid::exit_code(&console, &result)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_two_or_three_examples_that_parse() {
        for subcommand in command().get_subcommands() {
            let name = subcommand.get_name();
            let help = subcommand.get_after_help().map(ToString::to_string);
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
                if let Err(error) = command().try_get_matches_from(words) {
                    panic!("{example}: {error}");
                }
                assert!(line.starts_with(name), "{example}");
            }
        }
    }
}
