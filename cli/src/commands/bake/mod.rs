//! `bake`: grid files from models.

mod args;
mod check;
mod choose;
mod inputs;
mod jobs;
mod model_baker;
mod parts;
mod report;
mod values;

use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use aogrid_bake_core::mesh::{LoadedMesh, MeshFile, PartMesh};
use aogrid_bake_core::{BakeOptions, Placement, TriangleMesh};

pub(crate) use args::Args;
pub use args::SharedArgs;
use inputs::Inputs;
use jobs::{Job, Jobs};
use model_baker::ModelBaker;
use report::{Outcome, Outputs};
pub use values::{face_size, resolution};
pub(crate) use values::{in_range, named};

use crate::backend::Backend;
use crate::console::Console;
use crate::{interrupt, output};

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let options = args.options().unwrap_or_else(|usage| usage.exit());
    let request = args.shared.backend().unwrap_or_else(|usage| usage.exit());
    let mut placement = args.placement();
    let inputs = Inputs::new(&args.models, args.items.as_deref(), args.shard)?;
    if args.list {
        for (number, model) in inputs.chosen() {
            console.result(&format!("{number} {}", model.display()));
        }
        return Ok(());
    }
    if let (Some(bytes), None) = (args.max_bytes, args.max_error) {
        placement.resolution = [choose::resolution_within(bytes, &options)?; 3];
        console.note(&format!(
            "chose {} cells an axis: the most whose texels take {bytes} bytes or less",
            placement.resolution[0]
        ));
    }
    use_threads(args.shared.threads)?;
    interrupt::listen();
    let mut batch = Batch {
        args,
        console,
        jobs: Jobs::new(args, &inputs)?,
        is_single: !inputs.are_several && !args.parts,
        backend: Backend::new(request, args.shared.algorithm()),
        placement: &placement,
        options: &options,
        outputs: Outputs::default(),
    };
    for (_, model) in inputs.chosen() {
        if let Err(error) = batch.model(model) {
            batch.fail(&model.display().to_string(), error)?;
        }
    }
    batch.outputs.finish(console, args.json)
}

/// Starts the global thread pool with this many threads; all processors if `None`.
pub fn use_threads(threads: Option<u16>) -> anyhow::Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0).into());
    pool.build_global().context("cannot start the threads")
}

/// All that a command line asks for, and what has come of it.
struct Batch<'a> {
    args: &'a Args,
    console: &'a Console,
    jobs: Jobs<'a>,
    /// Whether one grid is all that there is to bake.
    is_single: bool,
    backend: Backend,
    placement: &'a Placement,
    options: &'a BakeOptions,
    outputs: Outputs,
}

impl Batch<'_> {
    /// Bakes a model or its parts.
    fn model(&mut self, model: &Path) -> anyhow::Result<()> {
        let shown = model.display();
        let loading = Instant::now();
        let file = MeshFile::read(model).with_context(|| shown.to_string())?;
        // A whole model that is up to date need not even be parsed.
        let single = self.jobs.whole_job(model);
        if let Some(job) = &single
            && self.is_up_to_date(job, &file)
        {
            return Ok(());
        }
        let loaded = file.parse().with_context(|| shown.to_string())?;
        let load_s = loading.elapsed().as_secs_f64();
        for warning in &loaded.warnings {
            self.console.warning(&format!("{shown}: {warning}"));
        }
        match single {
            Some(job) => self.job(&job, &loaded, &loaded.mesh, load_s),
            None => self.parts(model, &file, &loaded, load_s),
        }
    }

    /// Bakes the parts of a model, each mesh that they share once, and writes the scene of them all.
    fn parts(
        &mut self,
        model: &Path,
        file: &MeshFile,
        loaded: &LoadedMesh,
        load_s: f64,
    ) -> anyhow::Result<()> {
        let jobs = self.jobs.part_jobs(model, &loaded.mesh);
        let mut posed: Vec<(&Job, PartMesh)> = Vec::new();
        for (idx, job) in jobs.iter().enumerate() {
            let part = loaded.part(idx).with_context(|| job.title.clone());
            let done = part.and_then(|part| {
                if part.same_as == idx && !self.is_up_to_date(job, file) {
                    self.job(job, loaded, &part.mesh, load_s)?;
                }
                Ok(part)
            });
            match done {
                Ok(part) => posed.push((job, part)),
                Err(error) => self.fail(&job.title, error)?,
            }
        }
        // A part that shares the mesh of one that failed has no grid either.
        let is_baked: Vec<bool> = (0..jobs.len())
            .map(|idx| posed.iter().any(|(job, _)| job.part == Some(idx)))
            .collect();
        posed.retain(|(_, part)| is_baked[part.same_as]);
        if self.args.dry_run || posed.is_empty() {
            return Ok(());
        }
        let out = self.jobs.scene_file(model);
        let scene = parts::scene(model, &out, &loaded.mesh, &jobs, &posed)?;
        output::write(&out, scene.as_bytes())?;
        self.console.note(&format!("wrote {}", out.display()));
        Ok(())
    }

    /// Keeps a failure for the end, so that the rest is baked; returns it if nothing else is to be
    /// done.
    fn fail(&mut self, title: &str, error: anyhow::Error) -> anyhow::Result<()> {
        if self.args.fail_fast || interrupt::requested() {
            return Err(error);
        }
        self.outputs
            .fail(title, error, self.is_single, self.console);
        Ok(())
    }

    /// Whether a job's output is up to date, which is then reported.
    fn is_up_to_date(&mut self, job: &Job, file: &MeshFile) -> bool {
        // Only a bake tells which resolution an error asks for.
        if self.args.force || self.args.max_error.is_some() {
            return false;
        }
        let must_be_checked = self.args.check;
        let current = jobs::up_to_date(job, self.placement, self.options, must_be_checked, file);
        let Some(grid) = current else {
            return false;
        };
        let outcome = Outcome::up_to_date(job, &grid);
        self.outputs.push(outcome, self.console, self.args.json);
        true
    }

    /// Bakes a job and writes its output; with `--dry-run` only reports it.
    fn job(
        &mut self,
        job: &Job,
        loaded: &LoadedMesh,
        mesh: &TriangleMesh,
        load_s: f64,
    ) -> anyhow::Result<()> {
        let mut baker = ModelBaker {
            backend: &mut self.backend,
            loaded,
            load_s,
            placement: self.placement,
            options: self.options,
            args: self.args,
            console: self.console,
        };
        let outcome = baker.run(job, mesh)?;
        self.outputs.push(outcome, self.console, self.args.json);
        Ok(())
    }
}

/// Returns a file's name without folder and extension, for the names of outputs.
fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}
