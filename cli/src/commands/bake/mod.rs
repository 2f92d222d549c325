//! `bake`: grid files from models.

mod args;
mod cache;
mod check;
mod choose;
mod depfile;
mod estimate;
mod inputs;
mod jobs;
mod model_baker;
mod parts;
mod report;
mod values;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail};
use aogrid_bake_core::mesh::{LoadedMesh, MeshFile, PartMesh};
use aogrid_bake_core::{BakeOptions, Placement, TriangleMesh};

pub(crate) use args::Args;
pub use args::SharedArgs;
use cache::Cache;
use depfile::Depfile;
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
    let options = args.options()?;
    let request = args.shared.backend()?;
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
    let cache = args.cache.as_ref();
    let depfile = args.depfile.as_ref();
    let mut batch = Batch {
        args,
        console,
        jobs: Jobs::new(args, &inputs)?,
        cache: cache
            .map(|folder| Cache::open(folder, args, &placement, &options))
            .transpose()?,
        depfile: depfile
            .map(|path| Depfile::new(path, args.force))
            .transpose()?,
        written: vec![],
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
    if let Some(depfile) = &batch.depfile {
        depfile.write()?;
    }
    batch.outputs.finish(console, args.json)
}

/// The parts of a model that an error names.
const MAX_NAMED: usize = 12;

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
    cache: Option<Cache>,
    depfile: Option<Depfile>,
    /// The outputs of the current model that are written or up to date.
    written: Vec<PathBuf>,
    backend: Backend,
    placement: &'a Placement,
    options: &'a BakeOptions,
    outputs: Outputs,
}

impl Batch<'_> {
    /// Bakes a model or its parts, and notes what the outputs were made from.
    fn model(&mut self, model: &Path) -> anyhow::Result<()> {
        let loading = Instant::now();
        let file = MeshFile::read(model).with_context(|| model.display().to_string())?;
        self.written.clear();
        let result = self.grids(model, &file, loading);
        if let Some(depfile) = &mut self.depfile {
            let folder = model.parent().unwrap_or(Path::new(""));
            let companions = file.companions().map(|path| folder.join(path));
            let inputs: Vec<PathBuf> = [model.to_owned()].into_iter().chain(companions).collect();
            depfile.add(&self.written, &inputs)?;
        }
        result
    }

    /// Bakes the grids of a model.
    fn grids(&mut self, model: &Path, file: &MeshFile, loading: Instant) -> anyhow::Result<()> {
        let shown = model.display();
        // A whole model that is up to date need not even be parsed.
        let single = self.jobs.whole_job(model);
        if let Some(job) = &single
            && self.is_done(job, file)?
        {
            return Ok(());
        }
        let loaded = file.parse().with_context(|| shown.to_string())?;
        let load_s = loading.elapsed().as_secs_f64();
        for warning in &loaded.warnings {
            self.console.warning(&format!("{shown}: {warning}"));
        }
        match single {
            Some(job) if self.args.without.is_empty() => {
                self.job(&job, file, &loaded, &loaded.mesh, load_s)
            }
            Some(job) => {
                let mesh = without(&loaded.mesh, &self.args.without);
                let mesh = mesh.with_context(|| shown.to_string())?;
                self.job(&job, file, &loaded, &mesh, load_s)
            }
            None => self.parts(model, file, &loaded, load_s),
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
        let out = self.jobs.scene_file(model);
        let reference = match self.args.dry_run {
            true => String::new(),
            false => {
                parts::model_reference(model, &out).with_context(|| model.display().to_string())?
            }
        };
        let mut posed: Vec<(&Job, PartMesh)> = Vec::new();
        for (idx, job) in jobs.iter().enumerate() {
            let part = loaded.part(idx).with_context(|| job.title.clone());
            let done = part.and_then(|part| {
                if part.same_as == idx && !self.is_done(job, file)? {
                    self.job(job, file, loaded, &part.mesh, load_s)?;
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
        let scene = parts::scene(&reference, &loaded.mesh, &jobs, &posed)?;
        self.write_scene(out, &scene)
    }

    /// Writes the scene of a model's parts, unless a person has edited it.
    fn write_scene(&mut self, out: PathBuf, scene: &str) -> anyhow::Result<()> {
        let (force, kind) = (self.args.force, "an unedited scene");
        match output::check_own(&out, force, kind, parts::is_unedited) {
            Ok(()) => {
                output::write(&out, scene.as_bytes())?;
                self.console.note(&format!("wrote {}", out.display()));
            }
            // An articulated model is posed by editing it.
            Err(error) => self.console.warning(&format!("{error:#}")),
        }
        self.written.push(out);
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

    /// Whether a job's output is up to date, or is in the cache and now written; that is reported.
    fn is_done(&mut self, job: &Job, file: &MeshFile) -> anyhow::Result<bool> {
        if self.is_up_to_date(job, file) {
            return Ok(true);
        }
        let cached = self.cache.as_ref().and_then(|cache| {
            let path = cache.path(job, file);
            cache.get(&path)
        });
        let Some(entry) = cached else {
            return Ok(false);
        };
        self.jobs.check_out(&job.out)?;
        for warning in &entry.warnings {
            self.console.warning(&format!("{}: {warning}", job.title));
        }
        output::write(&job.out, &entry.bytes)?;
        self.push(job, Outcome::cached(job, &entry.grid));
        Ok(true)
    }

    /// Whether a job's output is up to date, which is then reported.
    fn is_up_to_date(&mut self, job: &Job, file: &MeshFile) -> bool {
        // Only a bake tells which resolution an error asks for.
        if self.args.force || self.args.max_error.is_some() {
            return false;
        }
        let current = jobs::up_to_date(job, self.placement, self.options, self.args, file);
        let Some(grid) = current else {
            return false;
        };
        self.push(job, Outcome::up_to_date(job, &grid));
        true
    }

    /// Reports what has come of a job.
    fn push(&mut self, job: &Job, outcome: Outcome) {
        self.outputs.push(outcome, self.console, self.args.json);
        self.written.push(job.out.clone());
    }

    /// Bakes a job and writes its output; with `--dry-run` only reports it.
    fn job(
        &mut self,
        job: &Job,
        file: &MeshFile,
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
        if self.args.dry_run {
            let outcome = baker.dry_run(job, mesh)?;
            self.push(job, outcome);
            return Ok(());
        }
        self.jobs.check_out(&job.out)?;
        let baked = baker.run(job, mesh)?;
        let bytes = baked.grid.to_bytes();
        output::write(&job.out, &bytes)?;
        if let Some(cache) = &self.cache
            && let Err(error) = cache.put(&cache.path(job, file), &bytes, &baked.warnings)
        {
            // The grid itself is written: a full or read-only cache costs time only.
            self.console.warning(&format!("not cached: {error:#}"));
        }
        self.push(job, Outcome::baked(job, baked));
        Ok(())
    }
}

/// Returns a mesh without the parts of these names, each of which it has.
pub(crate) fn without(mesh: &TriangleMesh, names: &[String]) -> anyhow::Result<TriangleMesh> {
    let parts = mesh.parts();
    if let Some(name) = names
        .iter()
        .find(|name| parts.iter().all(|part| part.name != **name))
    {
        let known = parts
            .iter()
            .take(MAX_NAMED)
            .map(|part| format!("`{}`", part.name));
        let mut known = known.collect::<Vec<_>>().join(", ");
        if parts.len() > MAX_NAMED {
            known += &format!(" and {} more", parts.len() - MAX_NAMED);
        }
        bail!("--without `{name}`: it has no such part; its parts are {known}");
    }
    Ok(mesh.without(names)?)
}

/// Returns a file's name without folder and extension, for the names of outputs.
fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}
