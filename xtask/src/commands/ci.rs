//! `ci`: everything that must hold before a change lands.

use std::process::Command;

use anyhow::{Context, bail};

use super::tables;
use crate::console::Console;

/// A call of cargo.
struct Check {
    name: &'static str,
    args: &'static str,
    /// Flags for rustdoc.
    rustdoc: &'static str,
}

/// What follows the tables, in the order in which it fails fastest.
const CHECKS: [Check; 4] = [
    Check {
        name: "format",
        args: "fmt --all --check",
        rustdoc: "",
    },
    Check {
        name: "clippy",
        args: "clippy --workspace --all-targets --locked -- -D warnings",
        rustdoc: "",
    },
    Check {
        name: "docs",
        args: "doc --workspace --no-deps --document-private-items --locked",
        rustdoc: "-D warnings",
    },
    Check {
        name: "tests",
        args: "test --workspace --locked",
        rustdoc: "",
    },
];

pub(crate) fn run(console: &Console) -> anyhow::Result<()> {
    console.note("== tables: cargo xtask tables --check");
    tables::check(console)?;
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    for Check {
        name,
        args,
        rustdoc,
    } in CHECKS
    {
        console.note(&format!("== {name}: cargo {args}"));
        let mut command = Command::new(&cargo);
        command.args(args.split(' '));
        if !rustdoc.is_empty() {
            command.env("RUSTDOCFLAGS", rustdoc);
        }
        let status = command
            .status()
            .with_context(|| format!("cannot start cargo {args}"))?;
        if !status.success() {
            bail!("{name} failed");
        }
    }
    console.note("== all checks passed");
    Ok(())
}
