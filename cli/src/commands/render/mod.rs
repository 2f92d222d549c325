//! `render`: a scene's picture or its receivers, shaded in one or more modes.

mod args;
mod output;

use anyhow::{bail, ensure};
use aogrid_baker_gpu::Context;
use aogrid_scene::reference::Environment;
use aogrid_scene::shade::{Gpu, Mode, ShadeInput, Shaded, Target};
use aogrid_scene::{EnvironmentSource, GBuffer, LoadOptions, Scene};

use args::OutputKind;
pub(crate) use args::{Args, BackendArg, mode_parser, override_truth, positive, selected_gpu};

use crate::commands::bake::use_threads;
use crate::console::Console;
use crate::usage::usage;
use crate::{interrupt, output as files};

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    let kind = args.kind()?;
    files::check_new(&args.out, args.force)?;
    files::check_not_input(&args.out, &args.scene)?;
    if let Some(dump) = &args.gbuffer {
        files::check_new(dump, args.force)?;
        ensure!(
            *dump != args.out,
            "{}: the picture goes there; name another file for the G-buffer",
            dump.display()
        );
    }
    let gpu = match args.gpu()? {
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
    if let Some(exposure) = args.exposure {
        ensure_exposure_counts(&scene, kind)?;
        scene.exposure = exposure as f32;
    }
    let target = target(args, kind, &scene, console)?;
    let environment = match &scene.environment {
        Some(source) => Some(load_environment(source, console)?),
        None => None,
    };
    let stages = |name: &str| console.stage(name);
    let mut input = ShadeInput::new(&scene, &target);
    input.environment = environment.as_ref();
    input.gpu = gpu.as_ref().map(|gpu| Gpu {
        device: gpu.device(),
        queue: gpu.queue(),
    });
    input.stages = &stages;
    let shade = |&mode: &&'static Mode| {
        let shaded = mode.shade(&input);
        let warnings = input.take_warnings();
        warnings.iter().for_each(|line| console.warning(line));
        Ok((mode, shaded?))
    };
    let shaded: anyhow::Result<Vec<(&Mode, Shaded)>> = args.mode.iter().map(shade).collect();
    let shaded = shaded?;
    let bytes = match (kind, &target.picture, &scene.receivers) {
        (OutputKind::Png, Some(picture), _) => output::png(&input, picture, &shaded)?,
        (OutputKind::Exr, Some(picture), _) => output::exr(&input, picture, &shaded)?,
        (_, _, Some(list)) => output::csv(&input, list, &shaded)?,
        (_, _, None) => unreachable!("the target is a picture or the scene's list"),
    };
    files::write(&args.out, &bytes)?;
    console.note(&format!("wrote {}", args.out.display()));
    Ok(())
}

/// Refuses an exposure that would change nothing.
fn ensure_exposure_counts(scene: &Scene, kind: OutputKind) -> anyhow::Result<()> {
    let shown = scene.path.display();
    if kind != OutputKind::Png {
        return Err(usage(format!(
            "{shown}: --exposure is for PNG; EXR and CSV hold radiance itself"
        )));
    }
    ensure!(
        scene.shows_light,
        "{shown}: --exposure needs a lit scene: this one's picture shows 1 − AO"
    );
    Ok(())
}

/// Reads the map of an environment, and tells its warnings.
pub(crate) fn load_environment(
    source: &EnvironmentSource,
    console: &Console,
) -> anyhow::Result<Environment> {
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
