//! `completions`: what a shell needs to complete our command lines.

use std::io;

use clap::CommandFactory;
use clap_complete::Shell;

/// Print the completions for a shell
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The shell that reads them
    #[arg(value_enum)]
    shell: Shell,
}

/// The examples at the end of `completions --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid completions bash > ~/.local/share/bash-completion/completions/aogrid
  aogrid completions zsh > ~/.zfunc/_aogrid";

pub(crate) fn run(args: &Args) {
    let mut command = crate::Cli::command();
    clap_complete::generate(args.shell, &mut command, "aogrid", &mut io::stdout().lock());
}
