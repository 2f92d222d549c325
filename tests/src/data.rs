//! The data folder of real meshes and malformed files. It is not part of the project: tests that
//! need it skip with a note if it is missing.

use std::fs;
use std::io::{Write, stderr};
use std::path::{Path, PathBuf};

/// The environment variable that overrides the path of the data folder.
const VARIABLE: &str = "AOGRID_SHARED";

/// Returns the path of `relative` in the data folder (`AOGRID_SHARED`, or `shared` beside the
/// project). Returns `None` and notes the skip if it does not exist.
pub fn shared(relative: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let folder = std::env::var_os(VARIABLE).map_or_else(beside, PathBuf::from);
    let path = folder.join(relative);
    if path.exists() {
        return Some(path);
    }
    skip(&format!("no {relative} in the data folder ({VARIABLE})"));
    None
}

/// Notes that the running test skips a check. Writes to standard error directly, because the test
/// harness captures the output of passing tests.
pub fn skip(why: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    // A closed standard error is not a reason to fail.
    let _ = writeln!(stderr(), "SKIPPED {test}: {why}");
}

/// Returns the files of a folder whose names end with `ending`, sorted by path.
///
/// # Panics
///
/// If the folder cannot be read or has no such files.
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
