//! `ci`: everything that must hold before a change lands.

use std::process::Command;

use anyhow::{Context, bail};

use super::tables;
use crate::console::Console;

/// Name, arguments and environment of each check, in the order in which they fail fastest.
const CHECKS: [(&str, &[&str], &[(&str, &str)]); 4] = [
    ("format", &["fmt", "--all", "--check"], &[]),
    (
        "clippy",
        &[
            "clippy",
            "--workspace",
            "--all-targets",
            "--locked",
            "--",
            "-D",
            "warnings",
        ],
        &[],
    ),
    (
        "docs",
        &[
            "doc",
            "--workspace",
            "--no-deps",
            "--document-private-items",
            "--locked",
        ],
        &[("RUSTDOCFLAGS", "-D warnings")],
    ),
    ("tests", &["test", "--workspace", "--locked"], &[]),
];

pub(crate) fn run(console: &Console) -> anyhow::Result<()> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    for (name, args, env) in CHECKS {
        console.note(&format!("== {name}: cargo {}", args.join(" ")));
        let mut command = Command::new(&cargo);
        command.args(args).envs(env.iter().copied());
        let status = command
            .status()
            .with_context(|| format!("cannot start cargo {}", args[0]))?;
        if !status.success() {
            bail!("{name} failed");
        }
    }
    console.note("== tables: cargo xtask tables --check");
    tables::check(console)?;
    console.note("== all checks passed");
    Ok(())
}
