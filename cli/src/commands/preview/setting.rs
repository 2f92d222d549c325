//! The setting of a preview: a model on a floor before a wall, as a scene.

use std::fmt::Write;
use std::path::Path;

use anyhow::Context;
use aogrid_bake_core::mesh::Bounds;
use aogrid_scene::{LoadOptions, Scene, parse};
use glam::DVec3;

use super::Args;

/// The axis of a model that points up.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(super) enum Up {
    /// As in glTF.
    Y,
    /// As in CAD.
    Z,
}

/// The name of the model in the scene.
pub(super) const MODEL: &str = "model";

/// The size of a panel's picture in pixels.
const SIZE: [u32; 2] = [420, 315];

/// The distances of the camera, and the size of floor and wall, relative to the radius of the model's
/// bounding box.
const VIEW: DVec3 = DVec3::new(1.5, 1.0, 2.3);
const FLOOR: f64 = 24.0;
const WALL_GAP: f64 = 0.25;

/// The directions of a setting in the model's axes.
struct Axes {
    right: DVec3,
    up: DVec3,
    towards: DVec3,
}

impl Up {
    fn axes(self) -> Axes {
        match self {
            Self::Y => Axes {
                right: DVec3::X,
                up: DVec3::Y,
                towards: DVec3::Z,
            },
            Self::Z => Axes {
                right: DVec3::X,
                up: DVec3::Z,
                towards: DVec3::NEG_Y,
            },
        }
    }

    /// Returns the index of the axis.
    pub(super) fn axis(self) -> usize {
        match self {
            Self::Y => 1,
            Self::Z => 2,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Y => "y",
            Self::Z => "z",
        }
    }

    /// The degrees around x by which a rectangle across y becomes the floor, and the wall.
    fn turns(self) -> [f64; 2] {
        match self {
            Self::Y => [0.0, 90.0],
            Self::Z => [90.0, 180.0],
        }
    }
}

/// Returns the scene of a model with these bounds.
pub(super) fn setting(args: &Args, bounds: &Bounds) -> anyhow::Result<Scene> {
    let path =
        std::path::absolute(&args.model).with_context(|| args.model.display().to_string())?;
    let text = text(args, bounds, &path)?;
    // Files are named by their whole paths; errors name the model.
    let scene = parse(&args.model, &text, LoadOptions::default())?;
    Ok(scene)
}

fn text(args: &Args, bounds: &Bounds, path: &Path) -> anyhow::Result<String> {
    let axes = args.up.axes();
    let [low, high] = [bounds.min, bounds.max].map(|p| DVec3::from(p.map(f64::from)));
    let origin = DVec3::from(bounds.origin);
    let (center, half) = (origin + 0.5 * (low + high), 0.5 * (high - low));
    let radius = half.length();
    let along = |axis: DVec3| (half * axis).length();
    let foot = center - along(axes.up) * axes.up;
    let wall = foot - (along(axes.towards) + WALL_GAP * radius) * axes.towards;
    let camera = center + radius * (VIEW.x * axes.right + VIEW.y * axes.up + VIEW.z * axes.towards);
    let size = FLOOR * radius;
    let [floor_turn, wall_turn] = args.up.turns();
    let model = path.to_str().with_context(|| {
        format!(
            "{}: its path is not UTF-8, which previews need",
            path.display()
        )
    })?;
    // JSON's strings are strings of TOML, too.
    let model = serde_json::to_string(model)?;
    let grid = match args.resolution {
        Some([x, y, z]) => format!(
            "preset = '{}', resolution = [{x}, {y}, {z}]",
            args.preset.name()
        ),
        None => format!("preset = '{}'", args.preset.name()),
    };
    let mut text = format!(
        "up = '{}'\n[camera]\nposition = {}\ntarget = {}\nvertical_fov = 40\nresolution = {SIZE:?}\n\
         [truth]\nerror = {}\n",
        args.up.name(),
        point(camera),
        point(center),
        args.error,
    );
    write!(
        text,
        "[[mesh]]\nname = 'ground'\nrectangle = [{size}, {size}]\n\
         [[mesh]]\nname = '{MODEL}'\nfile = {model}\ngrid = {{ {grid} }}\n\
         [[instance]]\nmesh = '{MODEL}'\n"
    )?;
    let middle = wall + 0.5 * size * axes.up;
    for (name, place, turn) in [("floor", foot, floor_turn), ("wall", middle, wall_turn)] {
        write!(
            text,
            "[[instance]]\nmesh = 'ground'\nname = '{name}'\ntranslate = {}\n\
             rotate = {{ axis = [1, 0, 0], degrees = {turn} }}\n",
            point(place)
        )?;
    }
    Ok(text)
}

/// Returns a point in TOML.
fn point(p: DVec3) -> String {
    format!("[{:?}, {:?}, {:?}]", p.x, p.y, p.z)
}
