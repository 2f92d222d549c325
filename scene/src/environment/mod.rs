//! Environment maps from EXR and HDR files, a single color, or a room's six walls.

mod file;
mod openexr;
mod radiance_hdr;

use std::path::PathBuf;

use crate::error::bail;
use crate::reference::Environment;
use glam::{DMat3, DVec3};
use toml::Spanned;

use super::diagnostics::SceneText;
use super::paths::resolve;
use super::schema::{EnvironmentFile, RoomFile, UpAxis};
use super::values::color;

/// The description of an environment, not yet loaded.
#[derive(Clone, Debug)]
pub struct EnvironmentSource {
    radiance: Radiance,
    map_from_world: DMat3,
    scale: f32,
}

#[derive(Clone, Debug)]
enum Radiance {
    File(PathBuf),
    Color([f32; 3]),
    /// The walls towards +x, −x, +y, −y, +z, −z of the map.
    Room([[f32; 3]; 6]),
}

/// A lat-long image of radiance, rows from the top.
struct Picture {
    size: [usize; 2],
    texels: Vec<[f32; 3]>,
}

/// The maximum number of texels of a map: 8192 by 4096.
const MAX_TEXELS: usize = 8192 * 4096;

/// The size of a room's map: texels of 0.7 degrees.
const ROOM_SIZE: [usize; 2] = [512, 256];

impl EnvironmentSource {
    pub(super) fn new(
        source: &SceneText<'_>,
        spanned: Spanned<EnvironmentFile>,
        scene_up: UpAxis,
    ) -> crate::Result<Self> {
        let span = Spanned::new(spanned.span(), ());
        let file = spanned.into_inner();
        let radiance = match (file.file, file.color, file.room) {
            (Some(name), None, None) => Radiance::File(resolve(source.path, &name)),
            (None, Some(given), None) => Radiance::Color(color(given)),
            (None, None, Some(room)) => Radiance::Room(walls(&room)),
            _ => {
                let message = "exactly one of `file`, `color` and `room` is needed";
                return Err(source.error_at(&span, "environment", message));
            }
        };
        let yaw = file.yaw.map_or(0.0, |v| v.0).to_radians();
        let map_from_upright = match file.up.unwrap_or(scene_up) {
            UpAxis::Y => DMat3::IDENTITY,
            // Rotate the z-up world into the y-up map: world z becomes y, world −y becomes z.
            UpAxis::Z => DMat3::from_cols(DVec3::X, -DVec3::Z, DVec3::Y),
        };
        Ok(Self {
            radiance,
            map_from_world: DMat3::from_rotation_y(-yaw) * map_from_upright,
            scale: file.scale.map_or(1.0, |v| v.0 as f32),
        })
    }

    /// Returns the map that the bytes of an EXR or HDR file hold, upright and as bright as there, with
    /// warnings; for programs without a file system. Messages call the file `name`.
    ///
    /// # Errors
    ///
    /// The file is of an unsupported kind, malformed, or too large.
    pub fn load_bytes(name: &str, bytes: &[u8]) -> crate::Result<(Environment, Vec<String>)> {
        let mut warnings = vec![];
        let picture = file::parse(name, bytes, &mut warnings)?;
        let rows = DMat3::IDENTITY.to_cols_array_2d();
        let environment = Environment::new(picture.size, picture.texels, rows)?;
        Ok((environment, warnings))
    }

    /// Reads or generates the map, and returns it with warnings, one line each.
    ///
    /// # Errors
    ///
    /// The file cannot be read, is of an unsupported kind, or is too large.
    pub fn load(&self) -> crate::Result<(Environment, Vec<String>)> {
        let mut warnings = vec![];
        let mut picture = match &self.radiance {
            Radiance::File(path) => file::read(path, &mut warnings)?,
            Radiance::Color(color) => Picture {
                size: [1, 1],
                texels: vec![*color],
            },
            Radiance::Room(walls) => room(walls),
        };
        for texel in &mut picture.texels {
            *texel = texel.map(|v| (v * self.scale).min(f32::MAX));
        }
        let rows = self.map_from_world.transpose().to_cols_array_2d();
        let environment = Environment::new(picture.size, picture.texels, rows)?;
        Ok((environment, warnings))
    }
}

/// Returns a room's walls in the order of [`Radiance::Room`].
fn walls(room: &RoomFile) -> [[f32; 3]; 6] {
    let RoomFile {
        right,
        left,
        ceiling,
        floor,
        front,
        back,
    } = room;
    [right, left, ceiling, floor, front, back].map(|c| color(*c))
}

/// Renders a cube's walls into a lat-long map with 4×4 samples a texel.
fn room(walls: &[[f32; 3]; 6]) -> Picture {
    const SAMPLES: usize = 4;
    let [width, height] = ROOM_SIZE;
    let wall = |x: usize, y: usize| {
        let at = |i: usize, n: usize| (i as f64 + 0.5) / (n * SAMPLES) as f64;
        // The direction of the sample: +z at the center of the map, +x at u = ¼.
        let (u, v) = (at(x, width), at(y, height));
        let (sin, cos) = ((0.5 - u) * std::f64::consts::TAU).sin_cos();
        let (up, level) = ((0.5 - v) * std::f64::consts::PI).sin_cos();
        let d = [level * sin, up, level * cos];
        let major = (0..3).max_by(|&a, &b| d[a].abs().total_cmp(&d[b].abs()));
        let major = major.expect("there are three axes");
        walls[2 * major + usize::from(d[major] < 0.0)]
    };
    let texel = |idx: usize| {
        let (x, y) = (idx % width * SAMPLES, idx / width * SAMPLES);
        let mut sum = [0.0; 3];
        for sample in 0..SAMPLES * SAMPLES {
            let color = wall(x + sample % SAMPLES, y + sample / SAMPLES);
            sum = std::array::from_fn(|c| sum[c] + color[c]);
        }
        sum.map(|v| v / (SAMPLES * SAMPLES) as f32)
    };
    Picture {
        size: ROOM_SIZE,
        texels: (0..width * height).map(texel).collect(),
    }
}

/// Checks the width and height of a picture before it is read.
fn check_size([width, height]: [usize; 2]) -> crate::Result<()> {
    match width.checked_mul(height) {
        Some(0) => bail!("it has no texels"),
        Some(n) if n <= MAX_TEXELS => Ok(()),
        _ => bail!("{width}×{height} texels are more than {MAX_TEXELS}: scale it down"),
    }
}
