//! Atomic output files: a file appears whole or not at all.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use anyhow::{Context, bail};

/// Writes `bytes` to a temporary file beside `path` and renames it to `path`.
pub fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    write_with(path, |file| file.write_all(bytes))
}

/// Writes like [`write()`], with content that `produce` generates while it is written.
pub fn write_with(
    path: &Path,
    produce: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> anyhow::Result<()> {
    check(path)?;
    // A symbolic link stays a link: the file that it points to is replaced.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let folder = folder(&target);
    let cannot_write = || format!("{}: cannot write it", path.display());
    let mut builder = tempfile::Builder::new();
    builder.prefix(".").suffix(".tmp");
    #[cfg(unix)]
    // The process's umask removes the permissions that the user does not want.
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let temporary = builder.tempfile_in(folder).with_context(cannot_write)?;
    let mut file = io::BufWriter::new(temporary);
    produce(&mut file)
        .and_then(|()| file.flush())
        .with_context(cannot_write)?;
    let temporary = file.into_inner().map_err(|e| e.into_error())?;
    temporary.as_file().sync_all().with_context(cannot_write)?;
    temporary
        .persist(&target)
        .map_err(|e| e.error)
        .with_context(cannot_write)?;
    Ok(())
}

/// Checks that a file can be written to `path`, before any work is done for it.
pub fn check(path: &Path) -> anyhow::Result<()> {
    if path.is_dir() {
        bail!("{}: it is a folder; name a file in it", path.display());
    }
    // Renaming would replace a device or a pipe instead of writing to it.
    if path.exists() && !path.is_file() {
        bail!("{}: it is not a regular file", path.display());
    }
    if path.file_name().is_none() || path.as_os_str().as_encoded_bytes().ends_with(b"/") {
        bail!("{}: it is not a file's name", path.display());
    }
    let folder = folder(path);
    if !folder.is_dir() {
        let folder = folder.display();
        bail!("{}: the folder {folder} does not exist", path.display());
    }
    Ok(())
}

/// Checks that a command does not overwrite its own input.
pub fn check_not_input(out: &Path, input: &Path) -> anyhow::Result<()> {
    match (fs::canonicalize(out), fs::canonicalize(input)) {
        (Ok(a), Ok(b)) if a == b => {
            bail!("{}: it is the input; name another file", out.display())
        }
        _ => Ok(()),
    }
}

/// Returns the folder that holds `path`.
fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
        Some(folder) => folder,
        None => path,
    }
}
