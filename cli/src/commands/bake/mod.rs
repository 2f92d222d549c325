//! `bake`: grid files from models.

mod args;
mod jobs;
mod report;

use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use aogrid_bake_core::mesh::{LoadedMesh, MeshFile, MeshReport};
use aogrid_bake_core::{BakeOptions, Placement, RawGrid, TriangleMesh, bake_grid, warnings};
use aogrid_grid_format::Source;

pub(crate) use args::Args;
pub use args::{SharedArgs, face_size, resolution};
use jobs::{Job, Jobs};
use report::{BackendReport, Baked, Outcome, Outputs, Times};

use crate::backend::{Backend, Provenance, TimedBake};
use crate::console::Console;
use crate::{interrupt, output};

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let options = args.options().unwrap_or_else(|usage| usage.exit());
    let request = args.shared.backend().unwrap_or_else(|usage| usage.exit());
    let placement = args.placement();
    use_threads(args.shared.threads)?;
    interrupt::listen();
    let jobs = Jobs::new(args)?;
    let mut backend = Backend::new(request, args.shared.algorithm());
    let mut outputs = Outputs::default();
    for model in &args.models {
        let shown = model.display();
        let loading = Instant::now();
        let file = MeshFile::read(model).with_context(|| shown.to_string())?;
        // A whole model that is up to date need not even be parsed.
        let single = jobs.whole_job(model);
        if let (Some(job), false) = (&single, args.force)
            && let Some(grid) = jobs::up_to_date(job, &placement, &options, &file)
        {
            outputs.push(Outcome::up_to_date(job, &grid), console, args.json);
            continue;
        }
        let loaded = file.parse().with_context(|| shown.to_string())?;
        let load_s = loading.elapsed().as_secs_f64();
        let of_model = match single {
            Some(job) => vec![job],
            None => jobs.part_jobs(model, &loaded.mesh)?,
        };
        for job in of_model {
            let current = match args.force || job.part.is_none() {
                true => None,
                false => jobs::up_to_date(&job, &placement, &options, &file),
            };
            let outcome = match current {
                Some(grid) => Outcome::up_to_date(&job, &grid),
                None => {
                    let mut baker = ModelBaker {
                        backend: &mut backend,
                        loaded: &loaded,
                        load_s,
                        placement: &placement,
                        options: &options,
                    };
                    baker.run(&job, args.dry_run, console)?
                }
            };
            outputs.push(outcome, console, args.json);
        }
    }
    outputs.finish(console, args.json)
}

/// Starts the global thread pool with this many threads; all processors if `None`.
pub fn use_threads(threads: Option<u16>) -> anyhow::Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0).into());
    pool.build_global().context("cannot start the threads")
}

/// Bakes the jobs of one model.
struct ModelBaker<'a> {
    backend: &'a mut Backend,
    loaded: &'a LoadedMesh,
    load_s: f64,
    placement: &'a Placement,
    options: &'a BakeOptions,
}

impl ModelBaker<'_> {
    /// Bakes a job and writes its output; with `dry_run` only reports it.
    fn run(&mut self, job: &Job, dry_run: bool, console: &Console) -> anyhow::Result<Outcome> {
        let part;
        let mesh = match job.part {
            Some(idx) => {
                part = self
                    .loaded
                    .mesh
                    .part(idx)
                    .with_context(|| job.title.clone())?;
                &part
            }
            None => &self.loaded.mesh,
        };
        let spec = self
            .placement
            .place(&mesh.bounds())
            .with_context(|| job.title.clone())?;
        let report = MeshReport::new(mesh);
        if dry_run {
            return Ok(Outcome::dry_run(job, &report, &spec));
        }
        output::check(&job.out)?;
        let baked = self.bake(job, mesh, report, console)?;
        for warning in warnings(&baked.grid, &baked.report) {
            console.warning(&format!("{}: {warning}", job.title));
        }
        output::write(&job.out, &baked.grid.to_bytes())?;
        Ok(Outcome::baked(job, baked))
    }

    fn bake(
        &mut self,
        job: &Job,
        mesh: &TriangleMesh,
        report: MeshReport,
        console: &Console,
    ) -> anyhow::Result<Baked> {
        let source = Source {
            part: job
                .part
                .map(|idx| self.loaded.mesh.parts()[idx].name.clone()),
            triangles: mesh.triangles().len() as u64,
            ..Source::from(self.loaded)
        };
        let mut stages = Stages::default();
        let started = Instant::now();
        let backend = &mut *self.backend;
        let grid = bake_grid(
            mesh,
            self.placement,
            self.options,
            source,
            |spec, options| {
                let bar = console.progress(&stages.title(&job.title));
                let timed = backend.bake(mesh, spec, options, &|progress| bar.observe(progress))?;
                drop(bar);
                if let Some(failure) = &timed.gpu_failure {
                    console.warning(&format!("{}: baked on the CPU: {failure}", job.title));
                }
                Ok(stages.push(timed))
            },
        );
        let grid = grid.map_err(|error: anyhow::Error| error.context(job.title.clone()))?;
        let total_s = started.elapsed().as_secs_f64();
        Ok(Baked {
            grid,
            report,
            backend: BackendReport::new(stages.provenance.context("nothing was baked")?),
            times: Times {
                load_s: self.load_s,
                prepare_s: stages.prepare_s,
                visibility_s: stages.visibility_s,
                post_s: total_s - stages.prepare_s - stages.visibility_s,
                threads: rayon::current_num_threads(),
            },
        })
    }
}

/// The device and times of a grid's bakes: of its cells, and of the finer lattice of the fit.
#[derive(Default)]
struct Stages {
    /// The device and algorithm of the first.
    provenance: Option<Provenance>,
    prepare_s: f64,
    visibility_s: f64,
}

impl Stages {
    /// Returns the title of the next bake's progress.
    fn title(&self, job: &str) -> String {
        match self.provenance {
            None => job.to_owned(),
            Some(_) => format!("{job}, near the surface"),
        }
    }

    /// Adds a bake and returns its moments.
    fn push(&mut self, timed: TimedBake) -> RawGrid {
        self.provenance.get_or_insert(timed.provenance);
        self.prepare_s += timed.prepare_s;
        self.visibility_s += timed.visibility_s;
        timed.raw
    }
}

/// Returns a file's name without folder and extension, for the names of outputs.
fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}
