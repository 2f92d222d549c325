//! Paths of the files that a scene names.

use std::path::{Path, PathBuf};

/// The prefix of file names that lie in the data folder, which the project does not ship.
const DATA_FOLDER_PREFIX: &str = "$AOGRID_SHARED/";

/// Returns the path of a file that a scene names: relative to the scene, or in the data folder.
pub(crate) fn resolve(scene: &Path, name: &str) -> PathBuf {
    let Some(inside) = name.strip_prefix(DATA_FOLDER_PREFIX) else {
        return scene.parent().unwrap_or(Path::new("")).join(name);
    };
    let default_folder = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let folder = std::env::var_os("AOGRID_SHARED").map_or_else(default_folder, PathBuf::from);
    folder.join(inside)
}
