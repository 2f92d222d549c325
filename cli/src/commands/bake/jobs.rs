//! The grids that a command line asks for, and the check whether an output is up to date.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use aogrid_bake_core::mesh::MeshFile;
use aogrid_bake_core::{BakeOptions, Extent, Placement, TriangleMesh};
use aogrid_grid_format::Grid;

use super::inputs::Inputs;
use super::{Args, stem};
use crate::commands::info::read_grid;
use crate::output;

/// The extension of grid files.
const EXTENSION: &str = ".ao.ktx2";

/// One grid to bake.
pub(super) struct Job {
    /// The job's name in messages.
    pub title: String,
    /// Index of the model's part; `None` for the whole model.
    pub part: Option<usize>,
    /// The part's name, which the file records.
    pub part_name: Option<String>,
    pub out: PathBuf,
}

/// Maps models and parts to output files.
pub(super) struct Jobs<'a> {
    out: &'a Path,
    parts: bool,
    into_folder: bool,
    force: bool,
}

impl<'a> Jobs<'a> {
    pub(super) fn new(args: &'a Args, inputs: &Inputs) -> anyhow::Result<Self> {
        let jobs = Self {
            out: &args.out,
            parts: args.parts,
            into_folder: args.parts || inputs.are_several,
            force: args.force,
        };
        let shown = args.out.display();
        if !jobs.into_folder {
            if !args
                .out
                .extension()
                .is_some_and(|e| e.eq_ignore_ascii_case("ktx2"))
            {
                let hint = match args.out.is_dir() {
                    true => {
                        format!("it is a folder; name a file in it, such as NAME{EXTENSION}")
                    }
                    false => format!("a grid file's name ends in {EXTENSION}"),
                };
                bail!("{shown}: {hint}");
            }
            jobs.check_out(&args.out)?;
            return Ok(jobs);
        }
        jobs.check_collisions(&inputs.all)?;
        if args.out.exists() && !args.out.is_dir() {
            bail!("{shown}: it is a file; several grids need a folder");
        }
        if !args.dry_run {
            fs::create_dir_all(&args.out).with_context(|| format!("{shown}: cannot create it"))?;
        }
        Ok(jobs)
    }

    /// Checks that no two models have the same output.
    fn check_collisions(&self, models: &[PathBuf]) -> anyhow::Result<()> {
        let mut seen: HashMap<String, &Path> = HashMap::new();
        for model in models {
            // Some file systems ignore case.
            if let Some(other) = seen.insert(stem(model).to_lowercase(), model) {
                let (a, b) = (other.display(), model.display());
                if other == model {
                    bail!("{a} is named twice");
                }
                bail!("{a} and {b} would be baked into the same file: bake them one by one");
            }
        }
        Ok(())
    }

    /// Checks that a grid can be written to `out`, where an older one may be.
    pub(super) fn check_out(&self, out: &Path) -> anyhow::Result<()> {
        output::check_own(out, self.force, "a grid", is_grid)
    }

    /// Returns the job for a whole model; `None` if its parts are baked instead.
    pub(super) fn whole_job(&self, model: &Path) -> Option<Job> {
        let out = match self.into_folder {
            true => self.out.join(format!("{}{EXTENSION}", stem(model))),
            false => self.out.to_owned(),
        };
        (!self.parts).then(|| Job {
            title: model.display().to_string(),
            part: None,
            part_name: None,
            out,
        })
    }

    /// Returns the file of the scene that poses a model's parts.
    pub(super) fn scene_file(&self, model: &Path) -> PathBuf {
        self.out.join(format!("{}.toml", stem(model)))
    }

    /// Returns a job for each part of a model.
    pub(super) fn part_jobs(&self, model: &Path, mesh: &TriangleMesh) -> Vec<Job> {
        let mut uses: HashMap<String, usize> = HashMap::new();
        let jobs = mesh.parts().iter().enumerate().map(|(idx, part)| {
            let mut name = file_name(&part.name);
            // Number the names that become equal as file names or differ in case alone.
            let uses = uses.entry(name.to_lowercase()).or_default();
            *uses += 1;
            if *uses > 1 {
                name = format!("{name}~{uses}");
            }
            Job {
                title: format!("{} ({})", model.display(), part.name),
                part: Some(idx),
                part_name: Some(part.name.clone()),
                out: self.out.join(format!("{}.{name}{EXTENSION}", stem(model))),
            }
        });
        jobs.collect()
    }
}

/// Whether a file's start is that of a grid, which may be of any version, or damaged.
fn is_grid(head: &[u8]) -> bool {
    let key = b"aogrid\0";
    head.starts_with(b"\xABKTX 20\xBB") && head.windows(key.len()).any(|bytes| bytes == key)
}

/// Returns `name` with all characters replaced that a file name may not contain.
fn file_name(name: &str) -> String {
    let plain = |c: char| match c {
        c if c.is_alphanumeric() || c == '-' || c == '_' => c,
        _ => '_',
    };
    // File systems limit names to 255 bytes.
    name.chars().take(50).map(plain).collect()
}

/// Returns the grid at the job's output if baking would write the same again.
pub(super) fn up_to_date(
    job: &Job,
    placement: &Placement,
    options: &BakeOptions,
    args: &Args,
    file: &MeshFile,
) -> Option<Grid> {
    let grid = read_grid(&job.out).ok()?;
    let record = grid.record();
    let same_extent = match placement.extent {
        Extent::Epsilon(epsilon) => record.epsilon == Some(epsilon),
        Extent::HalfExtents(given) => {
            record.epsilon.is_none() && grid.spec().half_extents() == given
        }
    };
    let untouched = grid.is_unchanged();
    let same = same_extent
        && untouched
        && (record.check.is_some() || !args.check)
        && record.without == args.without
        && grid.writer() == Grid::current_writer()
        && grid.spec().resolution() == placement.resolution
        && grid.encoding() == options.encoding
        && grid.format() == options.format
        && record.sample_offset == options.sample_offset
        && record.sampling == options.sampling
        && record.max_distance == options.max_distance
        && record.interior == options.interior
        && record.boundary.requested == options.boundary
        && record.snap == (placement.snap && record.epsilon.is_some())
        && record.fit == options.fit
        && record.self_offset == options.self_offset_for(record.inside.as_ref())
        && record.source.name == file.name()
        && record.source.part == job.part_name
        && record.source.blake3 == file.blake3();
    same.then_some(grid)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn part_names_become_file_names() {
        assert_eq!(file_name("leg back left"), "leg_back_left");
        assert_eq!(file_name("../../etc/passwd"), "______etc_passwd");
        assert_eq!(file_name("Rücken-1"), "Rücken-1");
        assert_eq!(file_name(&"x".repeat(300)).len(), 50);
    }
}
