//! The files that outputs are made from, for build systems: rules in the syntax of Makefiles.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use crate::output;

/// The dependencies of all outputs of a command, written at its end.
pub(super) struct Depfile {
    path: PathBuf,
    rules: String,
}

impl Depfile {
    /// Checks that the file can be written. A file that is there is replaced if it has such rules.
    pub(super) fn new(path: &Path, force: bool) -> anyhow::Result<Self> {
        output::check_own(path, force, "rules of grids", is_depfile)?;
        Ok(Self {
            path: path.to_owned(),
            rules: String::new(),
        })
    }

    /// Adds that `outs` are made from `inputs`; nothing without outputs.
    pub(super) fn add(&mut self, outs: &[PathBuf], inputs: &[PathBuf]) -> anyhow::Result<()> {
        if outs.is_empty() {
            return Ok(());
        }
        let escaped = |paths: &[PathBuf]| -> anyhow::Result<Vec<String>> {
            let escaped = |path: &PathBuf| {
                escaped(path).with_context(|| format!("{}: --depfile", path.display()))
            };
            paths.iter().map(escaped).collect()
        };
        let [outs, inputs] = [escaped(outs)?.join(" "), escaped(inputs)?.join(" \\\n ")];
        self.rules += &format!("{outs}: {inputs}\n");
        Ok(())
    }

    pub(super) fn write(&self) -> anyhow::Result<()> {
        output::write(&self.path, self.rules.as_bytes())
    }
}

/// Whether a file's first line is a rule with a grid as its target.
fn is_depfile(bytes: &[u8]) -> bool {
    let line = bytes.split(|byte| *byte == b'\n').next();
    let line = String::from_utf8_lossy(line.unwrap_or_default()).to_ascii_lowercase();
    line.split_once(": ")
        .is_some_and(|(targets, _)| targets.contains(".ktx2"))
}

/// Returns a path as Make and Ninja read it.
fn escaped(path: &Path) -> anyhow::Result<String> {
    let Some(text) = path.to_str() else {
        bail!("a Makefile cannot hold a name that is not UTF-8");
    };
    let mut escaped = String::with_capacity(text.len());
    let mut backslashes = 0;
    for c in text.chars() {
        match c {
            '\n' | '\r' => bail!("a Makefile cannot hold a name of several lines"),
            // Backslashes are themselves but before what one escapes.
            ' ' | '\t' | '#' => escaped.extend(std::iter::repeat_n('\\', backslashes + 1)),
            '$' => escaped.push('$'),
            _ => {}
        }
        escaped.push(c);
        backslashes = if c == '\\' { backslashes + 1 } else { 0 };
    }
    Ok(escaped)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped_as_compilers_do() {
        for (name, expected) in [
            ("a/b.obj", "a/b.obj"),
            ("Screw #6 $x.obj", r"Screw\ \#6\ $$x.obj"),
            (r"oak\ .obj", r"oak\\\ .obj"),
            (r"C:\m\a.obj", r"C:\m\a.obj"),
        ] {
            assert_eq!(escaped(Path::new(name)).unwrap(), expected);
        }
        assert!(escaped(Path::new("a\nb")).is_err());
    }

    #[test]
    fn only_rules_of_grids_are_replaced() {
        assert!(is_depfile(b"out/a.ao.ktx2: a.glb \\\n a.bin\n"));
        assert!(!is_depfile(b"all: main.c\n") && !is_depfile(b"\x00\xFF"));
    }
}
