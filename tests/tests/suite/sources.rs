//! The source files of the workspace, as text.

use std::fs;
use std::path::{Path, PathBuf};

use crate::cargo::{self, text};

/// A Rust file.
pub(crate) struct Source {
    /// Relative to the workspace.
    pub(crate) path: PathBuf,
    pub(crate) text: String,
}

impl Source {
    /// The text before the unit tests that end many files.
    pub(crate) fn without_tests(&self) -> &str {
        let tests = self.text.find("#[cfg(test)]\nmod ");
        &self.text[..tests.unwrap_or(self.text.len())]
    }
}

/// Returns the folders of all packages, with their names.
pub(crate) fn packages() -> Vec<(String, PathBuf)> {
    let folder = |manifest: &str| Path::new(manifest).parent().expect("a folder").to_owned();
    cargo::packages()
        .iter()
        .map(|p| (text(p, "name"), folder(&text(p, "manifest_path"))))
        .collect()
}

/// Returns the Rust files below a folder, sorted.
pub(crate) fn below(folder: &Path) -> Vec<Source> {
    let mut found = Vec::new();
    collect(folder, &mut found);
    found.sort();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let root = root.canonicalize().expect("the workspace exists");
    let read = |path: PathBuf| Source {
        text: fs::read_to_string(&path).expect("it can be read"),
        path: path.strip_prefix(&root).unwrap_or(&path).to_owned(),
    };
    found.into_iter().map(read).collect()
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder can be read") {
        let path = entry.expect("the entry can be read").path();
        if path.is_dir() {
            if path.file_name().is_none_or(|name| name != "target") {
                collect(&path, found);
            }
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
}

/// Returns all Rust files of the workspace: some hundreds.
pub(crate) fn all() -> Vec<Source> {
    let all: Vec<_> = packages()
        .iter()
        .flat_map(|(_, folder)| below(folder))
        .collect();
    assert!(all.len() > 200, "{} files", all.len());
    all
}
