//! The models that a command line names: files, folders and patterns, and the share of them to bake.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};

/// The endings of the models in a folder, each perhaps followed by `.gz`.
const ENDINGS: [&str; 5] = ["obj", "glb", "gltf", "stl", "ply"];

/// The models to bake.
pub(super) struct Inputs {
    /// All models that are named, in the order of their numbers from 1.
    pub all: Vec<PathBuf>,
    /// The numbers of those to bake.
    chosen: Vec<usize>,
    /// Whether there may be several, so that their grids need a folder.
    pub are_several: bool,
}

impl Inputs {
    /// Expands what was named to models and chooses some: those with numbers in `items`, and of them
    /// the share `shard`.
    pub(super) fn new(
        named: &[PathBuf],
        items: Option<&[RangeInclusive<usize>]>,
        shard: Option<(usize, usize)>,
    ) -> anyhow::Result<Self> {
        let mut all = Vec::new();
        for model in named {
            all.extend(expanded(model)?);
        }
        let is_single = matches!(&all[..], [only] if *only == named[0]);
        let mut chosen: Vec<usize> = (1..=all.len()).collect();
        if let Some(items) = items {
            if let Some(range) = items.iter().find(|range| *range.end() > all.len()) {
                let (last, n) = (range.end(), all.len());
                bail!("--items names model {last}, but there are {n}");
            }
            chosen.retain(|number| items.iter().any(|range| range.contains(number)));
        }
        if let Some((idx, count)) = shard {
            // Neighbors are often alike: turns share them more evenly than runs would.
            chosen = chosen.into_iter().skip(idx - 1).step_by(count).collect();
        }
        Ok(Self {
            all,
            chosen,
            are_several: !is_single,
        })
    }

    /// Returns the models to bake, with their numbers.
    pub(super) fn chosen(&self) -> impl Iterator<Item = (usize, &Path)> {
        let chosen = self.chosen.iter();
        chosen.map(|&number| (number, self.all[number - 1].as_path()))
    }
}

/// Returns the models that an argument stands for, sorted by name.
fn expanded(model: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let shown = || model.display().to_string();
    if model.is_dir() {
        let models = files_in(model, is_model).with_context(shown)?;
        ensure!(!models.is_empty(), "{}: it has no models", shown());
        return Ok(models);
    }
    let pattern = model.file_name().unwrap_or_default().to_string_lossy();
    if model.exists() || !pattern.contains(['*', '?']) {
        return Ok(vec![model.to_owned()]);
    }
    // A pattern arrives here if no shell has expanded it: in Windows, or between quotes.
    let folder = match model.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let models = files_in(folder, |name| matches(&pattern, name)).with_context(shown)?;
    ensure!(!models.is_empty(), "{}: no file matches", shown());
    Ok(models)
}

fn files_in(folder: &Path, is_chosen: impl Fn(&str) -> bool) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if is_chosen(&entry.file_name().to_string_lossy()) && entry.path().is_file() {
            files.push(entry.path());
        }
    }
    files.sort();
    Ok(files)
}

fn is_model(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let ending = name.rsplit_once('.').map(|(_, ending)| ending);
    ending.is_some_and(|ending| ENDINGS.contains(&ending))
}

/// Whether a name matches a pattern in which `*` stands for any characters and `?` for one.
fn matches(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) =
        (pattern.chars().collect(), name.chars().collect());
    let (mut p, mut n) = (0, 0);
    // The last star, and what it stands for so far: a longer match is tried only for it.
    let mut star: Option<(usize, usize)> = None;
    while n < name.len() {
        match pattern.get(p) {
            Some('*') => {
                star = Some((p, n));
                p += 1;
            }
            Some(c) if *c == '?' || *c == name[n] => {
                p += 1;
                n += 1;
            }
            _ => {
                let Some((at, end)) = &mut star else {
                    return false;
                };
                *end += 1;
                (p, n) = (*at + 1, *end);
            }
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

/// Parses a number from 1 or a range of them, as `2-5`.
pub(super) fn item(text: &str) -> Result<RangeInclusive<usize>, String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (first.trim().parse(), last.trim().parse()) {
        (Ok(first), Ok(last)) if 1 <= first && first <= last => Ok(first..=last),
        _ => Err("it is neither a number from 1 nor a range, as in 2-5,9".into()),
    }
}

/// Parses a share, as in `1/4`.
pub(super) fn shard(text: &str) -> Result<(usize, usize), String> {
    let numbers = text
        .split_once('/')
        .map(|(idx, count)| (idx.parse(), count.parse()));
    match numbers {
        Some((Ok(idx), Ok(count))) if 1 <= idx && idx <= count => Ok((idx, count)),
        _ => Err("it must be one of several, from 1, as in 1/4".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match_whole_names() {
        for (pattern, name, expected) in [
            ("*.obj", "a.obj", true),
            ("*.obj", "a.obj.gz", false),
            ("a*b*c", "aXbbYc", true),
            ("a*b*c", "aXbY", false),
            ("?.ply", "é.ply", true),
            ("?.ply", ".ply", false),
            ("*", "", true),
        ] {
            assert_eq!(matches(pattern, name), expected, "{pattern} {name}");
        }
        assert!(!matches(&"*a".repeat(30), &"a".repeat(29)));
    }

    #[test]
    fn items_and_shards_are_checked() {
        assert_eq!((item("2-4"), item(" 9")), (Ok(2..=4), Ok(9..=9)));
        for wrong in ["", "0", "3-2", "1-", "a", "0-2"] {
            assert!(item(wrong).is_err(), "{wrong}");
        }
        assert_eq!(shard("2/3"), Ok((2, 3)));
        for wrong in ["0/3", "4/3", "1", "1/0", "/"] {
            assert!(shard(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn models_are_told_by_their_endings() {
        assert!(is_model("a.OBJ") && is_model("b.ply.gz"));
        assert!(!is_model("a.mtl") && !is_model("obj") && !is_model("a.toml"));
    }
}
