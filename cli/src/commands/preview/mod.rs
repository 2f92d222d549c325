//! `preview`: one picture that tells how a model's grid shades, beside ray tracing.

mod picture;
mod setting;

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context;
use aogrid_bake_core::{Preset, TriangleMesh, mesh};
use aogrid_grid_format::Grid;
use aogrid_scene::compare::{ModeErrors, areas, errors};
use aogrid_scene::shade::{Mode, ShadeInput, Shaded, Target};
use aogrid_scene::suite::Area;
use aogrid_scene::{GBuffer, GridSource, Grids, Scene};
use glam::DVec3;
use serde::Serialize;

use crate::commands::bake::{named, resolution, use_threads};
use crate::commands::render::positive;
use crate::console::Console;
use crate::usage::usage;
use crate::{interrupt, output};
use setting::{Up, setting};

/// Bake a model, and draw its shadows beside ray-traced ones: one picture that tells how good they are
///
/// The model stands on a floor before a wall. The first row shows the truth, the grid and their
/// difference, the second the lit scene without and with the grid's occlusion and the errors by area, the
/// third the grid itself, cut through its middle.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The model: OBJ, glTF, GLB, STL or PLY, or .gz of one
    model: PathBuf,
    /// The PNG to write
    #[arg(short, long, value_name = "PNG")]
    out: PathBuf,
    /// Preset of the grid
    #[arg(long, default_value = "default", value_parser = named(Preset::ALL, Preset::name, &[]))]
    preset: Preset,
    /// Cells along an axis: one number, or three as 32x24x32 [default: the preset's]
    #[arg(long, value_parser = resolution)]
    resolution: Option<[u32; 3]>,
    /// The model's axis that points up
    #[arg(long, default_value = "y")]
    up: Up,
    /// Standard error of the truth to reach: smaller takes longer
    #[arg(long, value_name = "E", default_value = "0.004", value_parser = positive)]
    error: f64,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Report the errors as one JSON object on stdout
    #[arg(long)]
    json: bool,
    /// Threads to work with [default: as many as there are processors]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

/// The examples at the end of `preview --help`.
const EXAMPLES: &str = "\
Examples:
  aogrid preview assets/table.obj -o table.png
  aogrid preview part.stl --up z --preset economy -o part.png";

/// The report for a machine.
#[derive(Serialize)]
struct Report<'a> {
    model: String,
    bytes: usize,
    resolution: [u32; 3],
    half_extents: [f32; 3],
    /// The areas in the order of the errors.
    areas: [&'static str; Area::ALL.len()],
    errors: &'a ModeErrors,
}

/// A model in its setting, shaded by ray tracing and by its grid.
struct Previewed {
    title: String,
    mesh: Arc<TriangleMesh>,
    grid: Arc<Grid>,
    /// The size of the grid's texels.
    bytes: usize,
    target: Target,
    truth: Shaded,
    shaded: Shaded,
    errors: ModeErrors,
    up: DVec3,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<()> {
    use_threads(args.threads)?;
    interrupt::listen();
    if !args
        .out
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
    {
        return Err(usage(format!(
            "{}: a preview ends in .png",
            args.out.display()
        )));
    }
    output::check_not_input(&args.out, &args.model)?;
    output::check_new(&args.out, args.force)?;
    let shown = || args.model.display().to_string();
    let loaded = mesh::load(&args.model).with_context(shown)?;
    let bounds = loaded.mesh.bounds();
    drop(loaded);
    let mut scene = setting(args, &bounds)?;
    for warning in &scene.warnings {
        console.warning(warning);
    }
    let previewed = preview(args, &mut scene, console)?;
    output::write(&args.out, &picture::png(&previewed)?)?;
    console.note(&format!("wrote {}", args.out.display()));
    let spec = previewed.grid.spec();
    if args.json {
        return console.json(&Report {
            model: args.model.display().to_string(),
            bytes: previewed.bytes,
            resolution: spec.resolution(),
            half_extents: spec.half_extents(),
            areas: Area::ALL.map(Area::name),
            errors: &previewed.errors,
        });
    }
    Ok(())
}

/// Bakes the model's grid, and shades the scene by ray tracing and by the grid.
fn preview(args: &Args, scene: &mut Scene, console: &Console) -> anyhow::Result<Previewed> {
    let (idx, grid) = bake(scene, console)?;
    scene.meshes[idx].grid = GridSource::Given(grid.clone());
    let stage = console.stage("rays from the camera");
    let target = Target::of_picture(GBuffer::trace(scene, &*stage)?);
    drop(stage);
    let stages = |name: &str| console.stage(name);
    let mut input = ShadeInput::new(scene, &target);
    input.stages = &stages;
    let [truth, shaded] = ["truth", "cone"].map(|name| {
        let mode = Mode::named(name).expect("there are such modes");
        mode.shade(&input)
    });
    let (truth, shaded) = (truth?, shaded?);
    let areas = areas(scene, &target)?;
    let errors = errors("cone", &shaded, &truth, &areas);
    let name = args.model.file_name().unwrap_or_default().to_string_lossy();
    Ok(Previewed {
        title: format!("{name}, preset {}", args.preset.name()),
        mesh: scene.meshes[idx].mesh.clone(),
        bytes: grid.texels().len(),
        grid,
        truth,
        shaded,
        errors,
        up: scene.up,
        target,
    })
}

/// Returns the model's index among the scene's meshes, and its grid.
fn bake(scene: &Scene, console: &Console) -> anyhow::Result<(usize, Arc<Grid>)> {
    let mut grids = Grids::new();
    let stage = console.stage("grid");
    let resolved = grids.resolve(scene, &*stage)?;
    drop(stage);
    for warning in grids.take_warnings() {
        console.warning(&format!("{}: {warning}", scene.path.display()));
    }
    let found = resolved
        .into_iter()
        .enumerate()
        .find_map(|(idx, grid)| Some((idx, grid?)));
    found.context("the model casts")
}
