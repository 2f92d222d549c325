//! `render`: a scene's picture or its receivers, shaded in one or more modes.

mod args;
mod casters;
mod environment;
mod glossy;
mod output;
mod raster;
mod target;
mod truth;
mod twin;

use std::cell::RefCell;
use std::collections::HashMap;

use anyhow::{bail, ensure};
use aogrid_baker_gpu::Context;
use aogrid_scene::reference::Environment;

pub(crate) use args::Args;
use args::{Mode, OutputKind};
use casters::GridShading;
use target::{Shaded, Target};

use crate::commands::bake::use_threads;
use crate::console::Console;
use crate::{interrupt, output as files};
use aogrid_scene::{EnvironmentSource, GBuffer, Grids, Instance, LoadOptions, Scene};

/// The input of every mode; a new mode is a file with a function that takes a job.
pub(crate) struct Job<'a> {
    pub scene: &'a Scene,
    /// The points to shade.
    pub target: &'a Target,
    /// The scene's environment, if it has one.
    pub environment: Option<Environment>,
    /// The grids that some mode has asked for, shared by the modes.
    pub grids: RefCell<Grids>,
    /// The GPU that looks up grids; `None` for the CPU.
    pub gpu: Option<Context>,
    pub console: &'a Console,
    /// The instances by the ids of receivers on them.
    instances: InstancesById<'a>,
}

/// The instances of a scene by their ids.
struct InstancesById<'a>(HashMap<u32, &'a Instance>);

impl<'a> InstancesById<'a> {
    fn new(scene: &'a Scene) -> Self {
        Self(scene.instances.iter().map(|i| (i.id, i)).collect())
    }

    /// Returns the instance that receivers with this id lie on.
    fn get(&self, id: u32) -> Option<&'a Instance> {
        self.0.get(&id).copied()
    }

    /// Returns the layers of receivers with this id: all if the id is unknown.
    fn layers(&self, id: u32) -> u32 {
        self.get(id).map_or(u32::MAX, |instance| instance.layers)
    }
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let kind = args.kind()?;
    files::check(&args.out)?;
    files::check_not_input(&args.out, &args.scene)?;
    if let Some(dump) = &args.gbuffer {
        files::check(dump)?;
        ensure!(
            *dump != args.out,
            "{}: the picture goes there; name another file for the G-buffer",
            dump.display()
        );
    }
    let gpu = match args.gpu().unwrap_or_else(|usage| usage.exit()) {
        Some(choice) => Some(Context::new(&choice)?),
        None => None,
    };
    use_threads(args.threads)?;
    interrupt::listen();
    let load = LoadOptions {
        occluders: args.occluders,
    };
    let mut scene = aogrid_scene::load(&args.scene, load)?;
    for warning in &scene.warnings {
        console.warning(&format!("{}: {warning}", scene.path.display()));
    }
    args.apply_to(&mut scene.truth);
    let target = target(args, kind, &scene, console)?;
    let environment = match &scene.environment {
        Some(source) => Some(load_environment(source, console)?),
        None => None,
    };
    let job = Job {
        scene: &scene,
        target: &target,
        environment,
        grids: RefCell::default(),
        gpu,
        console,
        instances: InstancesById::new(&scene),
    };
    let shaded = args.mode.iter().map(|&mode| Ok((mode, shade(mode, &job)?)));
    let shaded: Vec<(Mode, Shaded)> = shaded.collect::<anyhow::Result<_>>()?;
    let bytes = match (kind, &target.picture, &scene.receivers) {
        (OutputKind::Png, Some(picture), _) => output::png(&job, picture, &shaded)?,
        (OutputKind::Exr, Some(picture), _) => output::exr(&job, picture, &shaded)?,
        (_, _, Some(list)) => output::csv(&job, list, &shaded)?,
        (_, _, None) => unreachable!("the target is a picture or the scene's list"),
    };
    files::write(&args.out, &bytes)?;
    console.note(&format!("wrote {}", args.out.display()));
    Ok(())
}

fn shade(mode: Mode, job: &Job<'_>) -> anyhow::Result<Shaded> {
    match mode {
        Mode::Truth => truth::shade(job),
        Mode::Occlusion => shade_by_grids(job, GridShading::Occlusion),
        Mode::Cone => shade_by_grids(job, GridShading::Cone),
        Mode::Merge => shade_by_grids(job, GridShading::Merge),
        Mode::Environment => shade_by_grids_and_map(job, GridShading::Cone),
        Mode::EnvironmentMerge => shade_by_grids_and_map(job, GridShading::Merge),
    }
}

fn shade_by_grids(job: &Job<'_>, shading: GridShading) -> anyhow::Result<Shaded> {
    match &job.gpu {
        Some(gpu) => raster::shade(job, gpu, shading),
        None => twin::shade(job, shading),
    }
}

fn shade_by_grids_and_map(job: &Job<'_>, shading: GridShading) -> anyhow::Result<Shaded> {
    match &job.gpu {
        Some(gpu) => raster::environment::shade(job, gpu, shading),
        None => environment::shade(job, shading),
    }
}

fn load_environment(source: &EnvironmentSource, console: &Console) -> anyhow::Result<Environment> {
    let (environment, warnings) = source.load()?;
    warnings.iter().for_each(|line| console.warning(line));
    Ok(environment)
}

/// Returns the points to shade; writes the G-buffer if it is asked for.
fn target(
    args: &Args,
    kind: OutputKind,
    scene: &Scene,
    console: &Console,
) -> anyhow::Result<Target> {
    if let OutputKind::Csv = kind {
        let Some(list) = &scene.receivers else {
            bail!(
                "{}: receivers: a CSV file needs a list: add [receivers], or name a picture",
                args.scene.display()
            );
        };
        return Ok(Target::of_list(list));
    }
    let bar = console.progress("rays from the camera");
    let gbuffer = GBuffer::trace(scene, &|progress| bar.observe(progress))?;
    drop(bar);
    if let Some(dump) = &args.gbuffer {
        files::write(dump, &gbuffer.to_exr()?)?;
        console.note(&format!("wrote {}", dump.display()));
    }
    Ok(Target::of_picture(gbuffer))
}
