use std::collections::BTreeSet;

use serde_json::Value;

use crate::cargo::{self, text};

/// Licenses under which the project may link what it depends on.
const ALLOWED: [&str; 12] = [
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Whether a license expression leaves a choice that is allowed. With parentheses each part between
/// ANDs must leave one, which refuses more than it has to.
fn is_allowed(expression: &str) -> bool {
    let of_any = |alternatives: &str| {
        let mut alternatives = alternatives.split(" OR ");
        alternatives.any(|part| part.split(" AND ").all(|l| ALLOWED.contains(&l.trim())))
    };
    // An old way to write OR.
    let expression = expression.replace('/', " OR ");
    match expression.contains('(') {
        true => expression
            .split(" AND ")
            .all(|part| of_any(&part.replace(['(', ')'], ""))),
        false => of_any(&expression),
    }
}

#[test]
fn every_dependency_has_a_license_that_we_may_use() {
    let json = cargo::output(&["metadata", "--locked", "--format-version", "1"]);
    let metadata: Value = serde_json::from_str(&json).expect("it is JSON");
    let packages = metadata["packages"].as_array().expect("a list");
    assert!(packages.len() > 100, "{} packages", packages.len());
    let refused: BTreeSet<_> = packages
        .iter()
        .filter(|package| !package["license"].as_str().is_some_and(is_allowed))
        .map(|package| format!("{}: {}", text(package, "name"), package["license"]))
        .collect();
    assert!(refused.is_empty(), "{refused:?}");
}

#[test]
fn expressions_are_read() {
    assert!(is_allowed("MIT OR GPL-3.0"));
    assert!(is_allowed("(MIT OR Apache-2.0) AND Unicode-3.0"));
    assert!(!is_allowed("GPL-3.0"));
    assert!(!is_allowed("MIT AND GPL-3.0"));
    assert!(!is_allowed("(MIT OR Apache-2.0) AND GPL-3.0"));
}
