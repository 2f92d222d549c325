//! The bake of one model's grids: visibility, check, and the output file.

use std::time::Instant;

use anyhow::Context;
use aogrid_bake_core::mesh::{LoadedMesh, MeshReport};
use aogrid_bake_core::{
    BakeOptions, Placement, RawGrid, TriangleMesh, bake_grid, mesh_warnings, near_surface_lattice,
    option_warnings, warnings,
};
use aogrid_grid_format::{Grid, Source};

use super::Args;
use super::check::Checker;
use super::choose;
use super::estimate;
use super::jobs::Job;
use super::report::{BackendReport, Baked, Outcome, Plan, Times};
use crate::backend::{Backend, Provenance, TimedBake};
use crate::console::Console;
use crate::memory;

/// The estimated time of a bake from which it is told before the bake begins.
const MIN_SECONDS_TOLD: f64 = 10.0;

/// Bakes the jobs of one model.
pub(super) struct ModelBaker<'a> {
    pub backend: &'a mut Backend,
    pub loaded: &'a LoadedMesh,
    pub load_s: f64,
    pub placement: &'a Placement,
    pub options: &'a BakeOptions,
    pub args: &'a Args,
    pub console: &'a Console,
}

impl ModelBaker<'_> {
    /// Returns what baking a job would write and need.
    pub(super) fn dry_run(&self, job: &Job, mesh: &TriangleMesh) -> anyhow::Result<Outcome> {
        let report = MeshReport::new(mesh);
        let plan = self
            .plan(mesh, &report)
            .with_context(|| job.title.clone())?;
        self.warn(job, &option_warnings(mesh, &plan.spec, self.options));
        Ok(Outcome::dry_run(job, &report, &plan))
    }

    /// Bakes a job's grid.
    pub(super) fn run(&mut self, job: &Job, mesh: &TriangleMesh) -> anyhow::Result<Baked> {
        let report = MeshReport::new(mesh);
        let plan = self
            .plan(mesh, &report)
            .with_context(|| job.title.clone())?;
        // Those of the file are told when it is parsed, once for all its parts.
        let of_file = match job.part {
            None => self.loaded.warnings.clone(),
            Some(_) => vec![],
        };
        let mut of_mesh = mesh_warnings(mesh, &plan.spec, self.loaded.rounding);
        of_mesh.extend(option_warnings(mesh, &plan.spec, self.options));
        self.warn(job, &of_mesh);
        if let Some(seconds) = plan.seconds.filter(|seconds| *seconds >= MIN_SECONDS_TOLD) {
            let (time, memory) = (estimate::shown(seconds), memory::shown(plan.memory));
            let line = format!("{}: {time} on the CPU, about {memory}", job.title);
            self.console.note(&line);
        }
        let mut stages = Stages::default();
        let grid = self
            .chosen(job, mesh, &mut stages)
            .with_context(|| job.title.clone())?;
        let grid = grid.with_parts_left_out(self.args.without.clone());
        let of_grid = warnings(&grid, &report);
        self.warn(job, &of_grid);
        Ok(Baked {
            grid,
            report,
            warnings: [of_file, of_mesh, of_grid].concat(),
            backend: BackendReport::new(stages.provenance.context("nothing was baked")?),
            times: Times {
                load_s: self.load_s,
                prepare_s: stages.prepare_s,
                visibility_s: stages.visibility_s,
                post_s: stages.post_s,
                threads: rayon::current_num_threads(),
            },
        })
    }

    fn warn(&self, job: &Job, warnings: &[String]) {
        for warning in warnings {
            self.console.warning(&format!("{}: {warning}", job.title));
        }
    }

    /// Returns the grid's box and what the bake needs; the memory is there.
    fn plan(&self, mesh: &TriangleMesh, report: &MeshReport) -> anyhow::Result<Plan> {
        let spec = self.placement.place(&mesh.bounds())?;
        let texel_bytes = self.options.encoding.channels() * self.options.format.channel_bytes();
        let algorithm = self.args.shared.algorithm();
        let lattice = match self.options.fit {
            true => Some(near_surface_lattice(&spec, mesh)?),
            false => None,
        };
        let memory = memory::needed(mesh, &spec, lattice.as_ref(), texel_bytes, algorithm);
        memory::check(memory, self.args.max_memory)?;
        let (lattice, options) = (lattice.as_ref(), self.options);
        let is_checked = self.args.check;
        let seconds = || estimate::seconds(report, &spec, lattice, options, algorithm, is_checked);
        Ok(Plan {
            spec,
            memory,
            // Only bakes tell which resolutions an error asks for.
            seconds: self.args.max_error.is_none().then(seconds),
        })
    }

    /// Bakes the grid at the resolution that is asked for or chosen, checked if that is asked for.
    fn chosen(
        &mut self,
        job: &Job,
        mesh: &TriangleMesh,
        stages: &mut Stages,
    ) -> anyhow::Result<Grid> {
        let source = Source {
            part: job.part_name.clone(),
            triangles: mesh.triangles().len() as u64,
            ..Source::from(self.loaded)
        };
        let is_checked = self.args.check || self.args.max_error.is_some();
        let checker = match is_checked {
            true => Some(Checker::new(&job.title, mesh, &source, self.console)?),
            false => None,
        };
        let (placement, options, console) = (self.placement, self.options, self.console);
        let (max_error, max_bytes) = (self.args.max_error, self.args.max_bytes);
        let mut bake = |placement: &Placement| {
            *stages = Stages::default();
            let grid = self.bake(job, mesh, placement, source.clone(), stages)?;
            match &checker {
                Some(checker) => Ok(grid.clone().with_check(checker.check(&grid)?)),
                None => Ok(grid),
            }
        };
        let Some(max_error) = max_error else {
            return bake(placement);
        };
        let grid = choose::within_error(max_error, max_bytes, placement, options, bake)?;
        let n = grid.spec().resolution()[0];
        console.note(&format!(
            "{}: chose {n} cells an axis: the fewest with an error of {max_error} or less",
            job.title
        ));
        Ok(grid)
    }

    /// Bakes a grid and measures its stages.
    fn bake(
        &mut self,
        job: &Job,
        mesh: &TriangleMesh,
        placement: &Placement,
        source: Source,
        stages: &mut Stages,
    ) -> anyhow::Result<Grid> {
        let started = Instant::now();
        let (backend, console) = (&mut *self.backend, self.console);
        let visibility = |spec, options: &BakeOptions| {
            let bar = console.progress(&stages.title(&job.title));
            let timed = backend.bake(mesh, spec, options, &|progress| bar.observe(progress))?;
            drop(bar);
            if let Some(failure) = &timed.gpu_failure {
                console.warning(&format!("{}: baked on the CPU: {failure}", job.title));
            }
            Ok(stages.push(timed))
        };
        let grid: anyhow::Result<Grid> =
            bake_grid(mesh, placement, self.options, source, visibility);
        let in_bakes = stages.prepare_s + stages.visibility_s;
        stages.post_s = started.elapsed().as_secs_f64() - in_bakes;
        grid
    }
}

/// The device and times of a grid's bakes: of its cells, and of the lattices of points that refine it.
#[derive(Default)]
struct Stages {
    bakes: u32,
    /// The device and algorithm of the first.
    provenance: Option<Provenance>,
    prepare_s: f64,
    visibility_s: f64,
    post_s: f64,
}

impl Stages {
    /// Returns the title of the next bake's progress.
    fn title(&self, job: &str) -> String {
        match self.bakes {
            0 => job.to_owned(),
            n => format!("{job}, refinement {n}"),
        }
    }

    /// Adds a bake and returns its moments.
    fn push(&mut self, timed: TimedBake) -> RawGrid {
        self.bakes += 1;
        self.provenance.get_or_insert(timed.provenance);
        self.prepare_s += timed.prepare_s;
        self.visibility_s += timed.visibility_s;
        timed.raw
    }
}
