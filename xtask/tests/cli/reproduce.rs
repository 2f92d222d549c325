use std::fs;

use super::{misused, run};

/// The quickest figure: three steps, two small bakes among them.
const FIGURE: &str = "reproduce -o {} --only jgt-memory";

#[test]
fn the_report_is_one_file_and_is_not_made_twice() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("report");
    let notes = || {
        let output = run(FIGURE, &[&out]);
        assert!(output.status.success());
        let notes = String::from_utf8(output.stderr).unwrap();
        notes.matches("jgt-memory: cargo xtask").count()
    };
    assert_eq!(notes(), 3);
    let html = fs::read_to_string(out.join("report.html")).unwrap();
    for text in [
        "32 KiB and 128 KiB",
        "It holds.",
        "cargo xtask bake models/box.obj",
        "What we found in the papers",
    ] {
        assert!(html.contains(text), "{text}");
    }
    for loading in ["<script", "http:", "https:", "<link"] {
        assert!(!html.contains(loading), "{loading}");
    }
    // Nothing is done again, and what was lost is.
    assert_eq!(notes(), 0);
    assert_eq!(fs::read_to_string(out.join("report.html")).unwrap(), html);
    fs::remove_file(out.join("data/jgt-memory-cone.json")).unwrap();
    assert_eq!(notes(), 1);
    assert_eq!(fs::read_to_string(out.join("report.html")).unwrap(), html);
    let unknown = misused("reproduce -o {} --only figure-99", &[&out]);
    assert!(unknown.contains("figure-11"), "{unknown}");
}
