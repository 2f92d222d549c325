//! Node.js with other programs' packages, which read our files and shaders. If it or the npm
//! registry is missing, tests are skipped with a note, unless `AOGRID_NODE=require`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use aogrid_tests::skip;

/// The environment variable that makes a missing Node.js a failure.
const VARIABLE: &str = "AOGRID_NODE";

const FILES: [&str; 4] = ["package.json", "check.mjs", "glb.mjs", "tint.mjs"];

/// Returns a folder with the scripts of `tests/node` and the packages that they use, or `None` with
/// a note.
pub(crate) fn node() -> Option<&'static PathBuf> {
    static INSTALLED: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    match INSTALLED.get_or_init(install) {
        Ok(folder) => Some(folder),
        Err(why) if std::env::var(VARIABLE).as_deref() == Ok("require") => panic!("{why}"),
        Err(why) => {
            skip(&format!("{why} ({VARIABLE})"));
            None
        }
    }
}

fn install() -> Result<PathBuf, String> {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("node");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("node");
    let io = |error: std::io::Error| format!("{}: {error}", folder.display());
    fs::create_dir_all(&folder).map_err(io)?;
    for file in FILES {
        fs::copy(from.join(file), folder.join(file)).map_err(io)?;
    }
    let args = [
        "install",
        "--no-package-lock",
        "--no-audit",
        "--no-fund",
        "--silent",
    ];
    let install = Command::new("npm").args(args).current_dir(&folder).output();
    match install {
        Ok(output) if output.status.success() => Ok(folder),
        Ok(output) => Err(format!(
            "npm install failed: {}",
            String::from_utf8_lossy(&output.stderr)
        )),
        Err(error) => Err(format!("npm cannot be started: {error}")),
    }
}
