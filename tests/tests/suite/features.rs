//! `cargo xtask` and the tests resolve the same features of every package. Where they differ, cargo
//! compiles the package and all that depends on it twice, and wgpu takes minutes.

use std::collections::BTreeMap;

use crate::cargo;

/// Returns each third-party package of a `cargo tree` with its features.
fn features(args: &[&str]) -> BTreeMap<String, String> {
    let tree = [
        "tree",
        "--locked",
        "--prefix",
        "none",
        "--no-dedupe",
        "--format",
        "{p}|{f}",
    ];
    let output = cargo::output(&[&tree[..], args].concat());
    let lines = output.lines().filter_map(|line| line.split_once('|'));
    // Ours come with a path in parentheses.
    let others = lines.filter(|(package, _)| !package.contains('('));
    others
        .map(|(package, features)| (package.to_owned(), features.to_owned()))
        .collect()
}

#[test]
fn commands_and_tests_share_what_is_compiled() {
    let commands = features(&["--package", "xtask", "--edges", "normal"]);
    let tests = features(&["--workspace", "--edges", "normal,dev"]);
    assert!(commands.keys().any(|package| package.starts_with("wgpu v")));
    let differing: Vec<_> = commands
        .iter()
        .filter(|&(package, features)| tests.get(package) != Some(features))
        .collect();
    assert!(
        differing.is_empty(),
        "name the missing features in xtask/Cargo.toml: {differing:?}"
    );
}
