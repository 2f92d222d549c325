//! `ci`: everything that must hold before a change lands.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, bail};

use super::tables;
use aogrid::console::Console;

/// Check everything that must hold before a change lands: tables, format, clippy, docs, tests
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Then check the integrations that are no part of the workspace: the web package, in Node.js and
    /// a headless Chromium
    #[arg(long)]
    integrations: bool,
}

/// The examples at the end of `ci --help`.
const EXAMPLES: &str = "\
Examples:
  cargo xtask ci
  AOGRID_GPU=require cargo xtask ci
  AOGRID_BROWSER=require cargo xtask ci --integrations";

/// The scripts that check the integrations, run by Node.js in the folder that holds each.
const INTEGRATIONS: [(&str, &str); 1] = [("integrations/web", "ci.mjs")];

/// A call of cargo.
struct Check {
    name: &'static str,
    args: &'static str,
    /// Flags for rustdoc.
    rustdoc: &'static str,
}

const FORMAT: Check = Check {
    name: "format",
    args: "fmt --all --check",
    rustdoc: "",
};

/// The checks behind the format, which is done at once. The first compiles everything; clippy and
/// rustdoc share what they need, which is no machine code; tests find all compiled.
const CHECKS: [Check; 6] = [
    Check {
        name: "build",
        args: "test --workspace --locked --no-run",
        rustdoc: "",
    },
    Check {
        name: "clippy",
        args: "clippy --workspace --all-targets --locked -- -D warnings",
        rustdoc: "",
    },
    // The configuration for a browser: no blocking waits, threads or clocks.
    Check {
        name: "browser",
        args: "check --locked --no-default-features -p aogrid-baker-gpu -p aogrid-runtime",
        rustdoc: "",
    },
    // A package with its own lock file: the writers of naga are features that nothing else needs.
    Check {
        name: "shading languages",
        args: "run --locked --manifest-path integrations/shading-languages/Cargo.toml --target-dir \
               target/shading-languages -- --check",
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

/// A processor without the SIMD levels of x86-64: what bakes has to compile for it. Other tests would
/// need an emulator.
const OTHER_PROCESSOR: Check = Check {
    name: "aarch64",
    args: "check --locked --target aarch64-unknown-linux-gnu -p aogrid-baker-cpu",
    rustdoc: "",
};

/// The target of [`OTHER_PROCESSOR`], and the compiler of its dependencies in C.
const OTHER_TARGET: &str = "aarch64-unknown-linux-gnu";
const OTHER_COMPILER: &str = "aarch64-linux-gnu-gcc";

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let started = Instant::now();
    check(&FORMAT, console)?;
    console.note("== tables: cargo xtask tables --check");
    tables::check(console)?;
    for of_cargo in &CHECKS {
        check(of_cargo, console)?;
    }
    match missing_for_other_processor() {
        None => check(&OTHER_PROCESSOR, console)?,
        Some(missing) => console.note(&format!("== aarch64: skipped, for lack of {missing}")),
    }
    if args.integrations {
        for (folder, script) in INTEGRATIONS {
            check_integration(folder, script, console)?;
        }
    }
    let seconds = started.elapsed().as_secs();
    console.note(&format!("== all checks passed in {seconds} s"));
    Ok(())
}

/// Runs the script that checks an integration.
fn check_integration(folder: &str, script: &str, console: &Console) -> anyhow::Result<()> {
    let started = Instant::now();
    console.note(&format!("== {folder}: node {script}"));
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let status = Command::new("node")
        .arg(script)
        .current_dir(root.join(folder))
        .status()
        .context("cannot start node: install Node.js 20 or newer")?;
    if !status.success() {
        bail!("{folder} failed");
    }
    console.note(&format!("== {folder}: {} s", started.elapsed().as_secs()));
    Ok(())
}

/// Returns what [`OTHER_PROCESSOR`] needs and this machine has not.
fn missing_for_other_processor() -> Option<String> {
    let mut rustc = Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()));
    let printed = rustc.args(["--print", "target-libdir", "--target", OTHER_TARGET]);
    let folder = printed
        .output()
        .map_or_else(|_| vec![], |output| output.stdout);
    if !Path::new(String::from_utf8_lossy(&folder).trim()).is_dir() {
        return Some(format!(
            "the standard library: rustup target add {OTHER_TARGET}"
        ));
    }
    let mut compiler = Command::new(OTHER_COMPILER);
    let started = compiler.arg("--version").stdout(Stdio::null()).status();
    started
        .is_err()
        .then(|| format!("the C compiler {OTHER_COMPILER}"))
}

fn check(check: &Check, console: &Console) -> anyhow::Result<()> {
    let Check {
        name,
        args,
        rustdoc,
    } = check;
    let started = Instant::now();
    console.note(&format!("== {name}: cargo {args}"));
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
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
    console.note(&format!("== {name}: {} s", started.elapsed().as_secs()));
    Ok(())
}
