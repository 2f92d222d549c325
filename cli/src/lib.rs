//! The command `aogrid`: bakes grids, shows, checks, compares and exports them, renders scenes. One
//! file a command.
//!
//! Exit status: 0 done, 1 failed, 2 wrong usage. A failure prints one line on stderr; wrong usage
//! prints a hint. Output is written to a temporary file and renamed, so that a killed command
//! leaves an existing file intact.
//!
//! The library serves the binary and this workspace's own `cargo xtask`, which offers the same
//! commands beside those for developers.

mod commands;

#[doc(hidden)]
pub mod backend;
#[doc(hidden)]
pub mod console;
#[doc(hidden)]
pub mod interrupt;
mod memory;
#[doc(hidden)]
pub mod npy;
#[doc(hidden)]
pub mod output;
#[doc(hidden)]
pub mod pictures;
mod usage;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use commands::{
    adapters, attach, bake, bake_surface, compare, completions, detach, diff, export, info, man,
    model, preview, render, slices, verify,
};

#[doc(hidden)]
pub use commands::bake::{SharedArgs, face_size, resolution, use_threads};
use console::Console;

#[derive(Parser)]
#[command(name = "aogrid", version, about, max_term_width = 100)]
struct Cli {
    /// Print no progress and no notes, only results, warnings and errors
    #[arg(long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: AnyCommand,
}

/// The commands, and those that are of this binary alone.
#[derive(Subcommand)]
enum AnyCommand {
    #[command(flatten)]
    Product(Command),
    Completions(completions::Args),
    Man(man::Args),
}

/// A command on grids, models or scenes, with its arguments.
#[derive(Subcommand)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "clap shows the documentation of the arguments' types"
)]
#[expect(private_interfaces, reason = "arguments are made by clap alone")]
pub enum Command {
    Bake(Box<bake::Args>),
    BakeSurface(Box<bake_surface::Args>),
    Info(info::Args),
    Verify(verify::Args),
    Diff(diff::Args),
    Slices(slices::Args),
    Preview(preview::Args),
    #[command(alias = "sample")]
    Model(model::Args),
    Export(export::Args),
    Attach(attach::Args),
    Detach(detach::Args),
    Render(Box<render::Args>),
    Compare(Box<compare::Args>),
    Adapters(adapters::Args),
}

impl Command {
    /// Runs the command.
    ///
    /// # Errors
    ///
    /// Whatever the command fails with: the chain of causes makes one line.
    pub fn run(&self, console: &Console) -> anyhow::Result<()> {
        match self {
            Self::Bake(args) => bake::run(args, console),
            Self::BakeSurface(args) => bake_surface::run(args, console),
            Self::Info(args) => info::run(args, console),
            Self::Verify(args) => verify::run(args, console),
            Self::Diff(args) => diff::run(args, console),
            Self::Slices(args) => slices::run(args, console),
            Self::Preview(args) => preview::run(args, console),
            Self::Model(args) => model::run(args, console),
            Self::Export(args) => export::run(args, console),
            Self::Attach(args) => attach::run(args, console),
            Self::Detach(args) => detach::run(args, console),
            Self::Render(args) => render::run(args, console),
            Self::Compare(args) => compare::run(args, console),
            Self::Adapters(args) => adapters::run(args, console),
        }
    }
}

/// Runs the command that the process was called with.
pub fn run() -> ExitCode {
    without_device_layer();
    let cli = Cli::parse();
    let console = Console::new(cli.quiet);
    exit_code(
        &console,
        &match cli.command {
            AnyCommand::Product(command) => command.run(&console),
            AnyCommand::Completions(args) => {
                completions::run(&args);
                Ok(())
            }
            AnyCommand::Man(args) => man::run(&args, &console),
        },
    )
}

/// The exit status of a command, whose failure is told.
#[doc(hidden)]
pub fn exit_code(console: &Console, result: &anyhow::Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => match error.downcast_ref::<clap::Error>() {
            Some(usage) => {
                // A closed stderr changes nothing about the status.
                let _ = usage.print();
                ExitCode::from(2)
            }
            None => {
                console.error(error);
                ExitCode::FAILURE
            }
        },
    }
}

/// The variable that turns off Mesa's layer which sorts Vulkan's devices. The layer asks a Wayland
/// display which device comes first, and complains on stderr where there is none.
#[cfg(target_os = "linux")]
const NO_DEVICE_LAYER: &str = "NODEVICE_SELECT";

/// Replaces this process by itself with [`NO_DEVICE_LAYER`] set, once: an environment variable
/// cannot be set safely in a process that may have threads.
fn without_device_layer() {
    #[cfg(target_os = "linux")]
    if std::env::var_os(NO_DEVICE_LAYER).is_none()
        && let Ok(own) = std::env::current_exe()
    {
        use std::os::unix::process::CommandExt;
        let mut again = std::process::Command::new(own);
        again.args(std::env::args_os().skip(1));
        // It returns only if it failed: then the complaint is all that is lost.
        let _ = again.env(NO_DEVICE_LAYER, "1").exec();
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
                let Some((_, line)) = example.split_once("aogrid ") else {
                    continue;
                };
                let line = line.split(['>', '|']).next().unwrap();
                let words = ["aogrid"].into_iter().chain(line.split_whitespace());
                if let Err(error) = Cli::try_parse_from(words) {
                    panic!("{example}: {error}");
                }
                assert!(line.starts_with(name), "{example}");
            }
        }
    }

    /// The farm's template calls commands as they are: its arguments parse once its variables have
    /// values.
    #[test]
    fn the_template_for_farms_parses() {
        let template = include_str!("../../integrations/openjd/bake.yaml");
        let values = [
            ("{{Param.Models}}", "models"),
            ("{{Param.Grids}}", "grids"),
            ("{{Param.Preset}}", "fine"),
            ("{{Task.Param.Shard}}/{{Param.Shards}}", "2/8"),
            ("{{Param.Cache}}", "cache"),
        ];
        let mut text = template.to_owned();
        for (variable, value) in values {
            assert!(text.contains(variable), "{variable}");
            text = text.replace(variable, value);
        }
        let lines = text.lines().map(str::trim);
        let of_bake = lines.skip_while(|line| *line != "- bake");
        let of_bake = of_bake.map_while(|line| line.strip_prefix("- "));
        let words: Vec<_> = of_bake
            .take_while(|word| !word.starts_with("name"))
            .collect();
        let words = words.iter().map(|word| word.trim_matches('"'));
        if let Err(error) = Cli::try_parse_from(["aogrid"].into_iter().chain(words)) {
            panic!("{error}");
        }
        assert!(text.contains("args: [verify, \"grids\"]"));
    }
}
