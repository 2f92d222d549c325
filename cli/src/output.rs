//! Atomic output files: a file appears whole or not at all.

use std::collections::HashSet;
use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex};
use std::time::Duration;

use anyhow::{Context, bail};

/// The age from which a temporary file is taken to be left by a command that was killed. Commands write
/// in seconds what they have computed.
const STALE: Duration = Duration::from_secs(3600);

/// The ending of temporary files.
const TEMPORARY: &str = ".aogrid.tmp";

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
    remove_stale(folder);
    let cannot_write = || format!("{}: cannot write it", path.display());
    let mut builder = tempfile::Builder::new();
    builder.prefix(".").suffix(TEMPORARY);
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

/// The folders that this process has cleared: looking again for each of a thousand files takes longer
/// than to write them.
static CLEARED: LazyLock<Mutex<HashSet<PathBuf>>> = LazyLock::new(Mutex::default);

/// Removes the temporary files of commands that were killed. What cannot be removed does no harm.
fn remove_stale(folder: &Path) {
    let mut cleared = CLEARED
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    if !cleared.insert(folder.to_owned()) {
        return;
    }
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.as_encoded_bytes();
        let is_ours = name.starts_with(b".") && name.ends_with(TEMPORARY.as_bytes());
        let age = || entry.metadata().ok()?.modified().ok()?.elapsed().ok();
        if is_ours && age().is_some_and(|age| age > STALE) {
            let _ = fs::remove_file(entry.path());
        }
    }
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
    // Renaming would replace it in spite of that.
    if fs::metadata(path).is_ok_and(|file| file.permissions().readonly()) {
        bail!("{}: it is read-only", path.display());
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

/// The bytes at a file's start that tell whether it may be replaced: all of any file that commands
/// replace, and little of one that is named by mistake.
const HEAD: u64 = 1 << 24;

/// Checks like [`check`], and that no file is there, or that it may be replaced.
///
/// # Errors
///
/// The file exists, has content, and there is no `--force`.
pub fn check_new(path: &Path, force: bool) -> anyhow::Result<()> {
    check(path)?;
    match force || head(path)?.is_empty() {
        true => Ok(()),
        false => bail!("{}: it exists; --force replaces it", path.display()),
    }
}

/// Checks like [`check_new`], but lets a command replace what it has written itself: a file whose
/// start `is_own` accepts. `kind` says in an error what it would be.
pub fn check_own(
    path: &Path,
    force: bool,
    kind: &str,
    is_own: fn(&[u8]) -> bool,
) -> anyhow::Result<()> {
    check(path)?;
    if force {
        return Ok(());
    }
    let head = head(path)?;
    if head.is_empty() || is_own(&head) {
        return Ok(());
    }
    let path = path.display();
    bail!("{path}: it exists and does not hold {kind}; --force replaces it")
}

/// Returns the start of a file; nothing if there is none.
fn head(path: &Path) -> anyhow::Result<Vec<u8>> {
    let mut head = Vec::new();
    let read = fs::File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    match read {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("{}: it exists", path.display()))
        }
        _ => Ok(head),
    }
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

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use super::*;

    #[test]
    fn temporary_files_of_killed_commands_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for (name, age) in [
            (".old.aogrid.tmp", 2 * STALE),
            (".new.aogrid.tmp", Duration::ZERO),
            (".old.tmp", 2 * STALE),
        ] {
            let file = fs::File::create(at(name)).unwrap();
            file.set_modified(SystemTime::now() - age).unwrap();
        }
        write(&at("out"), b"content").unwrap();
        assert_eq!(fs::read(at("out")).unwrap(), b"content");
        let remain =
            [".old.aogrid.tmp", ".new.aogrid.tmp", ".old.tmp"].map(|name| at(name).exists());
        assert_eq!(remain, [false, true, true]);
    }

    #[test]
    fn files_that_exist_are_replaced_if_they_are_own_or_by_force() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        let check_ours = |force| check_own(&path, force, "an A", |head| head == b"A");
        assert!(check_new(&path, false).is_ok() && check_ours(false).is_ok());
        fs::write(&path, b"").unwrap();
        assert!(check_new(&path, false).is_ok() && check_ours(false).is_ok());
        fs::write(&path, b"A").unwrap();
        assert!(check_new(&path, false).is_err() && check_ours(false).is_ok());
        fs::write(&path, b"B").unwrap();
        for error in [check_new(&path, false), check_ours(false)] {
            let error = error.unwrap_err().to_string();
            assert!(error.contains("--force"), "{error}");
        }
        assert!(check_new(&path, true).is_ok() && check_ours(true).is_ok());
    }

    #[test]
    fn read_only_files_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        write(&path, b"old").unwrap();
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        let error = write(&path, b"new").unwrap_err().to_string();
        assert!(error.contains("read-only"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
    }
}
