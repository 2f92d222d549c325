//! Tests that run the commands as a user does, as processes.

/// Baking: outputs, skipping, parts, reports.
mod bake;
/// Batches: rules for build systems, the cache, files that exist.
mod batches;
/// Comparing scenes with their truth, and the accuracy suite.
mod compare;
/// Environment light and glossy surfaces.
mod environment;
/// Invalid inputs and outputs: one error line each.
mod errors;
/// Baking on a GPU, and naming one.
mod gpu;
/// Kills, interrupts and full disks.
mod interruption;
/// Looking at, comparing and exporting grids.
mod look;
/// Files from other programs' test suites, many of them broken.
mod odd_inputs;
/// Parts of models, and batches of which one fails.
mod parts;
/// Rendering scenes.
mod render;
/// The report of the papers' figures.
mod reproduce;
/// Errors in scene files: line, key, reason.
mod scene_errors;
/// Scenes shaded by grids, and the cost of shaders.
mod shade;
/// Baking surfaces.
mod surface;
/// Textures of surface bakes.
mod surface_textures;
/// T_clip and T_merge: generating, checking, measuring, exporting.
mod tables;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

/// Returns the binary with `args`, not started yet.
fn xtask<S: AsRef<std::ffi::OsStr>>(args: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
    command.args(args);
    // Mesa's drivers look for a display and complain on stderr if this is not set.
    command.env("XDG_RUNTIME_DIR", std::env::temp_dir());
    command
}

/// Splits a command line into words, replacing each `{}` by the next path.
fn words(line: &str, paths: &[&Path]) -> Vec<std::ffi::OsString> {
    let mut paths = paths.iter();
    let word = |word: &str| match word {
        "{}" => paths.next().expect("a path for each {}").into(),
        word => word.into(),
    };
    line.split_whitespace().map(word).collect()
}

fn run(line: &str, paths: &[&Path]) -> Output {
    xtask(words(line, paths))
        .output()
        .expect("the binary starts")
}

/// Runs a command that must succeed; returns its standard output.
fn ok(line: &str, paths: &[&Path]) -> String {
    let output = run(line, paths);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line}: {stderr}");
    String::from_utf8(output.stdout).expect("output is text")
}

/// Runs a command that must fail with exit status 1 and one line on stderr; returns that line.
fn fails(line: &str, paths: &[&Path]) -> String {
    one_line_error(&run(line, paths), line)
}

/// Runs a command line that contradicts itself, which must fail with exit status 2; returns what it
/// says.
fn misused(line: &str, paths: &[&Path]) -> String {
    let output = run(line, paths);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{line}: {stderr}");
    assert!(output.stdout.is_empty(), "{line}");
    stderr
}

fn one_line_error(output: &Output, what: &str) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{what}: {stderr}");
    assert!(output.stdout.is_empty(), "{what}");
    let lines: Vec<_> = stderr
        .lines()
        .filter(|l| !l.starts_with("warning: "))
        .collect();
    assert!(
        lines.len() == 1 && lines[0].starts_with("error: "),
        "{what}: {stderr}"
    );
    lines[0].to_owned()
}

/// Returns a temporary folder and the path of a built-in model in it.
fn with_sample(name: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let model = folder.path().join(format!("{name}.obj"));
    ok(&format!("sample {name} -o {{}}"), &[&model]);
    (folder, model)
}
