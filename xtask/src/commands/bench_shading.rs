//! `bench-shading`: the time that the look-ups of a picture take on the CPU.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::Context;
use aogrid::console::Console;
use aogrid::{interrupt, use_threads};
use aogrid_bake_core::UNOBSERVED;
use aogrid_scene::reference::Environment;
use aogrid_scene::shade::{self, Mode, ShadeInput, Target};
use aogrid_scene::{GBuffer, GridSource, Grids, LoadOptions, Scene, load};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde::Serialize;

/// Time the shading of pictures on the CPU: medians over repeats, without rays and bakes
///
/// Every combination of scene, number of occluders and mode is a row. Rows take turns, so that
/// their ratios hold on a busy machine, too.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Scene files with a camera
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// Shading mode; several with commas between
    #[arg(long, value_parser = modes(), value_delimiter = ',', default_value = "cone")]
    mode: Vec<&'static Mode>,
    /// Keep only the first N occluders; several numbers with commas between [default: all]
    #[arg(long, value_name = "N", value_delimiter = ',')]
    occluders: Vec<usize>,
    /// Number of repeats to measure
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeat: u32,
    /// Threads to work with [default: as many as there are processors]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Report as one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// The examples at the end of `bench-shading --help`.
const EXAMPLES: &str = "\
Examples:
  cargo xtask bench-shading scenes/robot.toml --mode occlusion,cone,merge
  cargo xtask bench-shading scenes/occluders.toml --occluders 1,10,40 --threads 1 --json";

/// The modes that look grids up; the others trace rays.
fn modes() -> impl TypedValueParser<Value = &'static Mode> {
    let known = shade::ALL.iter().filter(|mode| mode.runs_on_gpu());
    let known = known.map(|mode| PossibleValue::new(mode.name).help(mode.summary));
    PossibleValuesParser::new(known).map(|name| Mode::named(&name).expect("clap has checked it"))
}

/// A picture that is shaded again and again.
struct Picture {
    scene: Scene,
    target: Target,
    environment: Option<Environment>,
    row: Row,
}

/// The report on a row.
#[derive(Clone, Serialize)]
struct Row {
    scene: PathBuf,
    /// The number of occluders.
    occluders: usize,
    /// The number of the occluders' triangles.
    triangles: usize,
    mode: &'static str,
    receivers: usize,
    /// The median time of a picture, in seconds.
    seconds: f64,
}

#[derive(Serialize)]
struct Report {
    rows: Vec<Row>,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    use_threads(args.threads)?;
    interrupt::listen();
    let mut pictures = Vec::new();
    for path in &args.scenes {
        let counts = match args.occluders.is_empty() {
            true => vec![None],
            false => args.occluders.iter().copied().map(Some).collect(),
        };
        for occluders in counts {
            for &mode in &args.mode {
                pictures.push(picture(path, occluders, mode)?);
            }
        }
    }
    let rows = measure(&mut pictures, args.repeat)?;
    if args.json {
        return console.json(&Report { rows });
    }
    console.result("occluders  triangles  mode                      ms  ns per pixel  scene");
    for row in rows {
        console.result(&format!(
            "{:9}  {:9}  {:18}  {:8.2}  {:12.1}  {}",
            row.occluders,
            row.triangles,
            row.mode,
            1e3 * row.seconds,
            1e9 * row.seconds / row.receivers.max(1) as f64,
            row.scene.display()
        ));
    }
    Ok(())
}

/// Loads a scene, traces its picture's points, and bakes its grids.
fn picture(path: &Path, occluders: Option<usize>, mode: &'static Mode) -> anyhow::Result<Picture> {
    let mut scene = load(path, LoadOptions { occluders })?;
    let camera = scene.camera.is_some();
    anyhow::ensure!(camera, "{}: it has no [camera]", path.display());
    let grids = Grids::new().resolve(&scene, UNOBSERVED)?;
    for (mesh, grid) in scene.meshes.iter_mut().zip(grids) {
        if let Some(grid) = grid {
            mesh.grid = GridSource::Given(grid);
        }
    }
    let environment = scene.environment.as_ref().map(|source| source.load());
    let environment = environment.transpose()?.map(|(environment, _)| environment);
    let target = Target::of_picture(GBuffer::trace(&scene, UNOBSERVED)?);
    let casters: Vec<_> = scene.casters().collect();
    let triangles = |mesh: usize| Arc::as_ref(&scene.meshes[mesh].mesh).triangles().len();
    let row = Row {
        scene: path.to_owned(),
        occluders: casters.len(),
        triangles: casters.iter().map(|caster| triangles(caster.mesh)).sum(),
        mode: mode.name,
        receivers: target.receivers.len(),
        seconds: 0.0,
    };
    Ok(Picture {
        scene,
        target,
        environment,
        row,
    })
}

/// Shades the pictures in turns, once to warm up, and returns their median times.
fn measure(pictures: &mut [Picture], repeat: u32) -> anyhow::Result<Vec<Row>> {
    let mut times = vec![Vec::new(); pictures.len()];
    for round in 0..=repeat {
        for (picture, times) in pictures.iter().zip(&mut times) {
            let mut input = ShadeInput::new(&picture.scene, &picture.target);
            input.environment = picture.environment.as_ref();
            let mode = Mode::named(picture.row.mode).context("the mode exists")?;
            let start = Instant::now();
            mode.shade(&input)?;
            if round > 0 {
                times.push(start.elapsed().as_secs_f64());
            }
        }
    }
    let rows = pictures.iter().zip(times).map(|(picture, mut times)| {
        times.sort_by(f64::total_cmp);
        let mut row = picture.row.clone();
        row.seconds = times[times.len() / 2];
        row
    });
    Ok(rows.collect())
}
