//! The steps of figures: commands whose outputs are kept, so that a run that was cut off goes on.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, bail};
use aogrid::console::Console;
use aogrid::output;
use aogrid_bake_core::ALGORITHM_VERSION;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A command of a figure.
pub(super) struct Step {
    /// The name, unique in the figure.
    pub(super) name: String,
    /// The command line after `cargo xtask`, with `{png}` for its picture; words are split at spaces.
    pub(super) line: String,
}

impl Step {
    /// Creates a step.
    pub(super) fn new(name: impl Into<String>, line: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            line: line.into(),
        }
    }

    /// Returns the name of the step's picture, if it makes one.
    pub(super) fn picture(&self, figure: &str) -> Option<String> {
        self.line
            .contains("{png}")
            .then(|| format!("{figure}-{}.png", self.name))
    }

    /// Returns the command line with the name of its picture.
    pub(super) fn command(&self, figure: &str) -> String {
        match self.picture(figure) {
            Some(png) => self.line.replace("{png}", &png),
            None => self.line.clone(),
        }
    }
}

/// The kept output of a step.
#[derive(Serialize, Deserialize)]
struct Kept {
    /// The hash of all that the output depends on.
    key: String,
    output: Value,
}

/// Runs a step in the report's folder, or takes its output from an earlier run. `inputs` are the texts of
/// the scenes.
///
/// # Errors
///
/// The command fails: with its own message.
pub(super) fn run(
    folder: &Path,
    figure: &str,
    step: &Step,
    inputs: &str,
    console: &Console,
) -> anyhow::Result<Value> {
    let line = step.command(figure);
    let key = format!(
        "{ALGORITHM_VERSION} {} {line} {inputs}",
        env!("CARGO_PKG_VERSION")
    );
    let key = blake3::hash(key.as_bytes()).to_hex().to_string();
    let file = folder.join(format!("data/{figure}-{}.json", step.name));
    let picture = step.picture(figure).map(|png| folder.join(png));
    let is_drawn = picture.as_ref().is_none_or(|png| png.exists());
    if let Ok(text) = fs::read_to_string(&file)
        && let Ok(kept) = serde_json::from_str::<Kept>(&text)
        && kept.key == key
        && is_drawn
    {
        return Ok(kept.output);
    }
    console.note(&format!("{figure}: cargo xtask {line}"));
    let program = std::env::current_exe().context("the path of this program")?;
    let done = Command::new(program)
        .args(["--quiet"])
        .args(line.split_whitespace())
        .current_dir(folder)
        .output()
        .context("cannot start a command")?;
    if !done.status.success() {
        let errors = String::from_utf8_lossy(&done.stderr);
        let last = errors.lines().last().unwrap_or("it was cut off");
        bail!("{figure}: `cargo xtask {line}`: {last}; the same command goes on from here");
    }
    let text = String::from_utf8_lossy(&done.stdout);
    let output = match text.trim() {
        "" => Value::Null,
        text => serde_json::from_str(text).with_context(|| format!("the output of `{line}`"))?,
    };
    let kept = Kept { key, output };
    output::write(&file, serde_json::to_string_pretty(&kept)?.as_bytes())?;
    Ok(kept.output)
}
