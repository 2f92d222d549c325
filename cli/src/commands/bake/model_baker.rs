//! The bake of one model's grids: visibility, check, and the output file.

use std::time::Instant;

use anyhow::Context;
use aogrid_bake_core::mesh::{LoadedMesh, MeshReport};
use aogrid_bake_core::{
    BakeOptions, Placement, RawGrid, TriangleMesh, bake_grid, mesh_warnings, near_surface_lattice,
    warnings,
};
use aogrid_grid_format::{Grid, GridSpec, Source};

use super::Args;
use super::check::Checker;
use super::choose;
use super::jobs::Job;
use super::report::{BackendReport, Baked, Outcome, Times};
use crate::backend::{Backend, Provenance, TimedBake};
use crate::console::Console;
use crate::memory;

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
        let (spec, needed) = self.plan(mesh).with_context(|| job.title.clone())?;
        Ok(Outcome::dry_run(job, &MeshReport::new(mesh), &spec, needed))
    }

    /// Bakes a job's grid.
    pub(super) fn run(&mut self, job: &Job, mesh: &TriangleMesh) -> anyhow::Result<Baked> {
        let (spec, _) = self.plan(mesh).with_context(|| job.title.clone())?;
        let report = MeshReport::new(mesh);
        let warn = |warning: &String| {
            self.console.warning(&format!("{}: {warning}", job.title));
        };
        // Those of the file are told when it is parsed, once for all its parts.
        let of_file = match job.part {
            None => self.loaded.warnings.clone(),
            Some(_) => vec![],
        };
        let of_mesh = mesh_warnings(mesh, &spec, self.loaded.rounding);
        of_mesh.iter().for_each(warn);
        let mut stages = Stages::default();
        let grid = self
            .chosen(job, mesh, &mut stages)
            .with_context(|| job.title.clone())?;
        let of_grid = warnings(&grid, &report);
        of_grid.iter().for_each(warn);
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

    /// Returns the grid's box and the memory that the bake needs, which is there.
    fn plan(&self, mesh: &TriangleMesh) -> anyhow::Result<(GridSpec, u64)> {
        let spec = self.placement.place(&mesh.bounds())?;
        let texel_bytes = self.options.encoding.channels() * self.options.format.channel_bytes();
        let algorithm = self.args.shared.algorithm();
        let lattice = match self.options.fit {
            true => Some(near_surface_lattice(&spec, mesh)?),
            false => None,
        };
        let needed = memory::needed(mesh, &spec, lattice.as_ref(), texel_bytes, algorithm);
        memory::check(needed, self.args.max_memory)?;
        Ok((spec, needed))
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

/// The device and times of a grid's bakes: of its cells, and of the finer lattice of the fit.
#[derive(Default)]
struct Stages {
    /// The device and algorithm of the first.
    provenance: Option<Provenance>,
    prepare_s: f64,
    visibility_s: f64,
    post_s: f64,
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
