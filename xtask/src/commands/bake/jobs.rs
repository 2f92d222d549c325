//! Which grids a command line asks for, and which of them are there already.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use aogrid_bake_core::{BakeOptions, Extent, Placement, TriangleMesh};
use aogrid_grid_format::Grid;

use super::{Args, stem};
use crate::commands::info::read_grid;
use crate::output;

/// The ending of grid files.
const ENDING: &str = ".ao.ktx2";

/// One grid to bake.
pub(super) struct Job {
    /// What messages call it.
    pub title: String,
    /// Which part of the model; none: all of it.
    pub part: Option<usize>,
    /// The part's name, as the file will record it.
    pub part_name: Option<String>,
    pub out: PathBuf,
}

/// Where outputs go.
pub(super) struct Jobs<'a> {
    out: &'a Path,
    parts: bool,
    into_folder: bool,
}

impl<'a> Jobs<'a> {
    pub(super) fn new(args: &'a Args) -> anyhow::Result<Self> {
        let jobs = Self {
            out: &args.out,
            parts: args.parts,
            into_folder: args.parts || args.models.len() > 1,
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
                        format!("it is a folder; name a file in it, such as NAME{ENDING}")
                    }
                    false => format!("a grid file's name ends in {ENDING}"),
                };
                bail!("{shown}: {hint}");
            }
            output::check(&args.out)?;
            return Ok(jobs);
        }
        jobs.refuse_collisions(&args.models)?;
        if args.out.exists() && !args.out.is_dir() {
            bail!("{shown}: it is a file; several grids need a folder");
        }
        if !args.dry_run {
            fs::create_dir_all(&args.out).with_context(|| format!("{shown}: cannot create it"))?;
        }
        Ok(jobs)
    }

    fn refuse_collisions(&self, models: &[PathBuf]) -> anyhow::Result<()> {
        let mut seen: HashMap<String, &Path> = HashMap::new();
        for model in models {
            // Some file systems do not tell upper from lower case.
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

    /// The job for a whole model; none if its parts are baked.
    pub(super) fn of_whole(&self, model: &Path) -> Option<Job> {
        let out = match self.into_folder {
            true => self.out.join(format!("{}{ENDING}", stem(model))),
            false => self.out.to_owned(),
        };
        (!self.parts).then(|| Job {
            title: model.display().to_string(),
            part: None,
            part_name: None,
            out,
        })
    }

    /// A job for each part of a model.
    pub(super) fn of_parts(&self, model: &Path, mesh: &TriangleMesh) -> anyhow::Result<Vec<Job>> {
        let mut uses: HashMap<String, usize> = HashMap::new();
        let jobs = mesh.parts().iter().enumerate().map(|(idx, part)| {
            let mut name = file_name(&part.name);
            // Names that differ in what a file's name cannot hold, or in case alone.
            let uses = uses.entry(name.to_lowercase()).or_default();
            *uses += 1;
            if *uses > 1 {
                name = format!("{name}~{uses}");
            }
            Job {
                title: format!("{} ({})", model.display(), part.name),
                part: Some(idx),
                part_name: Some(part.name.clone()),
                out: self.out.join(format!("{}.{name}{ENDING}", stem(model))),
            }
        });
        Ok(jobs.collect())
    }
}

/// `name` with everything that a file system may not like replaced.
fn file_name(name: &str) -> String {
    let plain = |c: char| match c {
        c if c.is_alphanumeric() || c == '-' || c == '_' => c,
        _ => '_',
    };
    // File systems end names at 255 bytes.
    name.chars().take(50).map(plain).collect()
}

/// The grid at the job's output, if it is what baking would write there.
pub(super) fn up_to_date(
    job: &Job,
    placement: &Placement,
    options: &BakeOptions,
    name: &str,
    blake3: &str,
) -> Option<Grid> {
    let grid = read_grid(&job.out).ok()?;
    let record = grid.record();
    let same_extent = match placement.extent {
        Extent::Epsilon(epsilon) => record.epsilon == Some(epsilon),
        Extent::HalfExtents(given) => {
            record.epsilon.is_none() && grid.spec().half_extents() == given
        }
    };
    let untouched = grid.statistics() == grid.measure();
    let same = same_extent
        && untouched
        && grid.writer() == Grid::current_writer()
        && grid.spec().resolution() == placement.resolution
        && grid.encoding() == options.encoding
        && grid.format() == options.format
        && record.sample_offset == options.sample_offset
        && record.method == options.method
        && record.max_distance == options.max_distance
        && record.interior == options.interior
        && record.boundary.requested == options.boundary
        && record.source.name == name
        && record.source.part == job.part_name
        && record.source.blake3 == blake3;
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
