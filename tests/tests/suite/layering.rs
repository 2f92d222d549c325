use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use crate::cargo::{self, text};
use crate::sources;

/// The crates of ours that each may use; those not named may use all.
const ALLOWED: [(&str, &[&str]); 9] = [
    ("aogrid-grid-format", &[]),
    ("aogrid-tables", &[]),
    ("aogrid-bake-core", &["aogrid-grid-format"]),
    (
        "aogrid-baker-cpu",
        &["aogrid-bake-core", "aogrid-grid-format"],
    ),
    (
        "aogrid-baker-gpu",
        &["aogrid-bake-core", "aogrid-grid-format"],
    ),
    ("aogrid-runtime", &["aogrid-grid-format", "aogrid-tables"]),
    (
        "aogrid-scene",
        &[
            "aogrid-bake-core",
            "aogrid-baker-cpu",
            "aogrid-grid-format",
            "aogrid-runtime",
        ],
    ),
    (
        "aogrid",
        &[
            "aogrid-bake-core",
            "aogrid-baker-cpu",
            "aogrid-baker-gpu",
            "aogrid-grid-format",
            "aogrid-runtime",
            "aogrid-scene",
        ],
    ),
    ("aogrid-gpu-support", &[]),
];

/// Crates without a rule of their own. No other may depend on the commands for developers, not even
/// in tests, and only tests on what tests share.
const ON_TOP: [&str; 3] = ["xtask", "aogrid-tests", "aogrid-drag"];

/// Our crates and which of ours each depends on, outside tests and in tests.
fn arrows() -> BTreeMap<String, [BTreeSet<String>; 2]> {
    let packages = cargo::packages();
    let ours: BTreeSet<_> = packages.iter().map(|p| text(p, "name")).collect();
    let arrows = packages.iter().map(|package| {
        let mut uses = [BTreeSet::new(), BTreeSet::new()];
        let dependencies = package["dependencies"].as_array().expect("a list");
        for dependency in dependencies {
            let name = text(dependency, "name");
            if ours.contains(&name) {
                let in_tests = dependency["kind"] == "dev";
                uses[usize::from(in_tests)].insert(name);
            }
        }
        (text(package, "name"), uses)
    });
    arrows.collect()
}

#[test]
fn arrows_between_crates_point_one_way() {
    let arrows = arrows();
    assert!(ON_TOP.iter().all(|name| arrows.contains_key(*name)));
    for (name, allowed) in ALLOWED {
        let [uses, _] = arrows
            .get(name)
            .unwrap_or_else(|| panic!("{name} is missing"));
        let forbidden: Vec<_> = uses
            .iter()
            .filter(|u| !allowed.contains(&u.as_str()))
            .collect();
        assert!(
            forbidden.is_empty(),
            "{name} must not depend on {forbidden:?}"
        );
    }
    assert_eq!(
        arrows.len(),
        ALLOWED.len() + ON_TOP.len(),
        "a crate without a rule"
    );
}

#[test]
fn nothing_depends_on_developers_commands_and_only_tests_on_tests() {
    for (name, [uses, in_tests]) in arrows() {
        let upward = uses.iter().filter(|u| ON_TOP.contains(&u.as_str()));
        let in_tests = in_tests.iter().filter(|u| *u == "xtask");
        let upward: Vec<_> = upward.chain(in_tests).collect();
        assert!(upward.is_empty(), "{name} must not depend on {upward:?}");
    }
}

#[test]
fn crates_for_renderers_ask_for_no_newer_rust_than_wgpu() {
    let packages = cargo::packages();
    for name in ["aogrid-grid-format", "aogrid-tables", "aogrid-runtime"] {
        let named = |package: &&Value| package["name"] == name;
        let package = packages.iter().find(named).expect("it exists");
        assert_eq!(text(package, "rust_version"), "1.87", "{name}");
    }
}

/// The calls that block, spawn threads or read clocks, and the only files of the two crates that
/// may have them, behind the feature `native`.
const NOT_IN_A_BROWSER: [(&str, &[&str]); 7] = [
    ("block_on", &["baker-gpu/src/native.rs"]),
    (".poll(", &["baker-gpu/src/native.rs"]),
    ("enumerate_adapters", &["baker-gpu/src/native.rs"]),
    ("mpsc", &[]),
    ("Instant", &["baker-gpu/src/clock.rs"]),
    ("SystemTime", &[]),
    ("thread::", &["runtime/src/environment_map/prefilter.rs"]),
];

#[test]
fn what_a_browser_lacks_is_in_native_files_alone() {
    let packages = sources::packages();
    let named = |name| packages.iter().find(|(package, _)| package == name);
    for name in ["aogrid-baker-gpu", "aogrid-runtime"] {
        let (_, folder) = named(name).expect("it exists");
        for source in sources::below(&folder.join("src")) {
            let code = source.without_tests().lines();
            let code: Vec<_> = code.filter(|l| !l.trim().starts_with("//")).collect();
            for (call, files) in NOT_IN_A_BROWSER {
                let is_native = files.iter().any(|file| source.path.ends_with(file));
                let has_call = code.iter().any(|line| line.contains(call));
                assert!(is_native || !has_call, "{call} in {:?}", source.path);
            }
        }
    }
}
