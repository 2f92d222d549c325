//! The error of wrong usage, which ends a command with status 2.

use std::fmt::Display;

use clap::error::ErrorKind;

/// Returns the error of a command line that contradicts itself, whatever its files hold.
pub fn usage(message: impl Display) -> anyhow::Error {
    conflict(message).into()
}

/// Returns the error of a command line that contradicts itself, as one of clap's own.
pub(crate) fn conflict(message: impl Display) -> clap::Error {
    clap::Error::raw(ErrorKind::ArgumentConflict, format!("{message}\n"))
}
