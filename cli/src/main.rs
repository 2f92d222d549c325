//! `aogrid`: see the library for the commands.

use std::process::ExitCode;

fn main() -> ExitCode {
    aogrid::run()
}
