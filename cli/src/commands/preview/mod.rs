//! `preview`: one picture that tells how a model's grid shades, beside ray tracing.

mod grid;
mod picture;
mod setting;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use aogrid_bake_core::{Preset, TriangleMesh, mesh, mesh_warnings};
use aogrid_grid_format::Grid;
use aogrid_scene::compare::{ModeErrors, areas, errors};
use aogrid_scene::shade::{Mode, ShadeInput, Shaded, Target};
use aogrid_scene::suite::Area;
use aogrid_scene::{GBuffer, GridSource, Grids, Scene};
use glam::DVec3;
use serde::Serialize;

use crate::commands::bake::{named, resolution, use_threads, without};
use crate::commands::render::positive;
use crate::console::Console;
use crate::pictures::baked_model::BakedModel;
use crate::usage::usage;
use crate::{interrupt, output};
use setting::{MODEL, Up, setting};

/// Bake a model, and draw its shadows beside ray-traced ones: a picture that tells how good they are
///
/// The model stands on a floor before a wall. The first row shows the truth, the grid and their
/// difference, the second the lit scene without and with the grid's occlusion, and the errors by area.
/// A second picture, NAME-grid.png, shows the grid itself, cut through its middle.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The model: OBJ, glTF, GLB, STL or PLY, or .gz of one
    model: PathBuf,
    /// The PNG to write; the grid's picture goes beside it, as NAME-grid.png
    #[arg(short, long, value_name = "PNG")]
    out: PathBuf,
    /// Preset of the grid
    #[arg(long, default_value = "default", value_parser = named(Preset::ALL, Preset::name, &[]))]
    preset: Preset,
    /// Cells along an axis: one number, or three as 32x24x32 [default: the preset's]
    #[arg(long, value_parser = resolution)]
    resolution: Option<[u32; 3]>,
    /// Leave out a part of the model, by its name; may be given several times
    #[arg(long, value_name = "PART")]
    without: Vec<String>,
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
  aogrid preview part.stl --up z --preset economy -o part.png
  aogrid preview palm.glb --without Landscape -o palm.png";

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
    /// The axis that points up.
    vertical: usize,
    /// The id of the model among the receivers'.
    model_id: u32,
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
    let grid_picture = grid_picture(&args.out);
    for out in [&args.out, &grid_picture] {
        output::check_new(out, args.force)?;
    }
    let mesh = mesh(args, console)?;
    let mut scene = setting(args, &mesh.bounds())?;
    // The scene has the whole model.
    let model = scene.meshes.iter_mut().find(|mesh| mesh.name == MODEL);
    model.context("the scene has the model")?.mesh = Arc::new(mesh);
    for warning in &scene.warnings {
        console.warning(warning);
    }
    let previewed = preview(args, &mut scene, console)?;
    let model = BakedModel::new(&previewed.grid, previewed.mesh.clone(), console)?;
    let pictures = [
        (&args.out, picture::png(&previewed)?),
        (&grid_picture, grid::png(&previewed, &model)?),
    ];
    for (out, png) in pictures {
        output::write(out, &png)?;
        console.note(&format!("wrote {}", out.display()));
    }
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

/// Reads the model's mesh without the parts that the user leaves out, and tells what is odd about it.
fn mesh(args: &Args, console: &Console) -> anyhow::Result<TriangleMesh> {
    let shown = || args.model.display().to_string();
    let loaded = mesh::load(&args.model).with_context(shown)?;
    let (rounding, mut warnings) = (loaded.rounding, loaded.warnings);
    let mesh = match args.without.is_empty() {
        true => loaded.mesh,
        false => without(&loaded.mesh, &args.without).with_context(shown)?,
    };
    let mut placement = args.preset.placement();
    placement.resolution = args.resolution.unwrap_or(placement.resolution);
    let spec = placement.place(&mesh.bounds()).with_context(shown)?;
    warnings.extend(mesh_warnings(&mesh, &spec, rounding));
    for warning in warnings {
        console.warning(&format!("{}: {warning}", args.model.display()));
    }
    Ok(mesh)
}

/// Returns the path of the second picture: NAME-grid.png beside NAME.png.
fn grid_picture(out: &Path) -> PathBuf {
    let mut name = out.file_stem().unwrap_or_default().to_owned();
    name.push("-grid.png");
    out.with_file_name(name)
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
    let model_id = scene.instances.iter().find(|instance| instance.mesh == idx);
    let model_id = model_id.map(|instance| instance.id);
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
        vertical: args.up.axis(),
        model_id: model_id.context("the model stands in the scene")?,
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
