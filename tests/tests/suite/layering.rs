use std::collections::{BTreeMap, BTreeSet};

use cargo_metadata::{DependencyKind, MetadataCommand};

/// What each crate may use of ours; those not named may use all.
const ALLOWED: [(&str, &[&str]); 6] = [
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
];

/// Crates above all others: no other may depend on them, not even for tests.
const ON_TOP: [&str; 2] = ["xtask", "aogrid-tests"];

/// Our crates and which of ours each depends on, outside tests and in tests.
fn arrows() -> BTreeMap<String, [BTreeSet<String>; 2]> {
    let metadata = MetadataCommand::new()
        .no_deps()
        .exec()
        .expect("cargo metadata");
    let ours: BTreeSet<_> = metadata
        .packages
        .iter()
        .map(|p| p.name.to_string())
        .collect();
    let arrows = metadata.packages.iter().map(|package| {
        let mut uses = [BTreeSet::new(), BTreeSet::new()];
        for dependency in package
            .dependencies
            .iter()
            .filter(|d| ours.contains(&d.name))
        {
            let in_tests = dependency.kind == DependencyKind::Development;
            uses[usize::from(in_tests)].insert(dependency.name.clone());
        }
        (package.name.to_string(), uses)
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
fn nothing_depends_on_commands_or_tests() {
    for (name, [uses, in_tests]) in arrows() {
        // Those on top may use each other in tests alone.
        let in_tests = in_tests.iter().filter(|_| !ON_TOP.contains(&name.as_str()));
        let upward: Vec<_> = uses
            .iter()
            .chain(in_tests)
            .filter(|u| ON_TOP.contains(&u.as_str()))
            .collect();
        assert!(upward.is_empty(), "{name} must not depend on {upward:?}");
    }
}

#[test]
fn crates_for_renderers_ask_for_no_newer_rust_than_wgpu() {
    let metadata = MetadataCommand::new()
        .no_deps()
        .exec()
        .expect("cargo metadata");
    for name in ["aogrid-grid-format", "aogrid-tables", "aogrid-runtime"] {
        let package = metadata
            .packages
            .iter()
            .find(|p| p.name == name)
            .expect("it exists");
        let version = package.rust_version.as_ref().expect("it says so");
        assert_eq!((version.major, version.minor), (1, 87), "{name}");
    }
}
