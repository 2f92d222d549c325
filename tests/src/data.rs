//! The folder of real meshes and hostile files. It is not part of the project: tests that
//! need it skip, and say so, where it is missing.

use std::fs;
use std::io::{Write, stderr};
use std::path::{Path, PathBuf};

/// Overrides where the folder is.
const VARIABLE: &str = "AOGRID_SHARED";

/// `inside` of the data folder (`AOGRID_SHARED`, or `shared` beside the project), or none,
/// with a note, if there is no such folder.
pub fn shared(inside: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let folder = std::env::var_os(VARIABLE).map_or_else(beside, PathBuf::from);
    let path = folder.join(inside);
    if path.exists() {
        return Some(path);
    }
    skip(&format!("no {inside} in the data folder ({VARIABLE})"));
    None
}

/// Says that the running test does not check what it could. Not through the test harness,
/// which keeps what passing tests print to itself.
pub fn skip(why: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    // Nothing to be done where nobody listens.
    let _ = writeln!(stderr(), "SKIPPED {test}: {why}");
}

/// The files of a folder whose names end so, sorted by name.
///
/// # Panics
///
/// If the folder cannot be read or has none.
pub fn files_with_ending(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder can be read");
    let mut files: Vec<_> = entries
        .map(|entry| entry.expect("the entry can be read").path())
        .filter(|path| path.to_string_lossy().ends_with(ending))
        .collect();
    files.sort();
    assert!(!files.is_empty(), "no {ending} in {}", folder.display());
    files
}
