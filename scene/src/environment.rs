//! Environment maps from EXR and HDR files, a single color, or a room's six walls.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use crate::error::{Context, bail, ensure};
use crate::reference::Environment;
use exr::meta::MetaData;
use exr::meta::attribute::EnvironmentMap;
use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel};
use glam::{DMat3, DVec3};
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;
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

/// The maximum size in bytes of a decoded EXR image with all its channels.
const MAX_EXR_BYTES: usize = 512 << 20;

/// The largest half float, which replaces infinities in files.
const MAX_HALF: f32 = 65504.0;

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

    /// Reads or generates the map, and returns it with warnings, one line each.
    ///
    /// # Errors
    ///
    /// The file cannot be read, is of an unsupported kind, or is too large.
    pub fn load(&self) -> crate::Result<(Environment, Vec<String>)> {
        let mut warnings = vec![];
        let mut picture = match &self.radiance {
            Radiance::File(path) => read(path, &mut warnings)?,
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

/// Reads an EXR or HDR file; its first bytes decide which.
fn read(path: &Path, warnings: &mut Vec<String>) -> crate::Result<Picture> {
    let shown = || path.display().to_string();
    let metadata = std::fs::metadata(path).with_context(shown)?;
    ensure!(metadata.is_file(), "{}: it is not a regular file", shown());
    let mut start = [0; 4];
    let mut file = File::open(path).with_context(shown)?;
    let is_whole = std::io::Read::read_exact(&mut file, &mut start).is_ok();
    let mut picture = match &start {
        [0x76, 0x2f, 0x31, 0x01] if is_whole => read_exr(path).with_context(shown)?,
        [b'#', b'?', ..] if is_whole => read_hdr(path).with_context(shown)?,
        _ => bail!("{}: it is neither an EXR nor a Radiance HDR file", shown()),
    };
    let [negative, non_finite] = sanitize(&mut picture.texels);
    if negative > 0 {
        warnings.push(format!(
            "{}: {negative} texels have negative radiance (clamped to 0)",
            shown()
        ));
    }
    if non_finite > 0 {
        warnings.push(format!(
            "{}: {non_finite} texels are infinite (clamped to {MAX_HALF}) or NaN (set to 0)",
            shown()
        ));
    }
    Ok(picture)
}

/// Replaces values that are no radiance, and returns how many texels were negative and how many
/// were infinite or NaN.
fn sanitize(texels: &mut [[f32; 3]]) -> [usize; 2] {
    let (mut negative, mut non_finite) = (0, 0);
    for texel in texels {
        negative += usize::from(texel.iter().any(|&v| v < 0.0));
        non_finite += usize::from(texel.iter().any(|v| !v.is_finite()));
        *texel = texel.map(|v| match v {
            v if v.is_nan() => 0.0,
            v if v.is_infinite() && v > 0.0 => MAX_HALF,
            v => v.max(0.0),
        });
    }
    [negative, non_finite]
}

fn check_size([width, height]: [usize; 2]) -> crate::Result<()> {
    match width.checked_mul(height) {
        Some(0) => bail!("it has no texels"),
        Some(n) if n <= MAX_TEXELS => Ok(()),
        _ => bail!("{width}×{height} texels are more than {MAX_TEXELS}: scale it down"),
    }
}

/// Reads the largest level of the first layer that has the channels R, G and B.
fn read_exr(path: &Path) -> crate::Result<Picture> {
    // Check the headers first, so that a hostile file cannot make us allocate much memory.
    let meta = MetaData::read_from_file(path, false)?;
    for header in &meta.headers {
        let size = [header.layer_size.width(), header.layer_size.height()];
        check_size(size)?;
        let layer = size[0]
            .checked_mul(size[1])
            .zip(Some(header.channels.bytes_per_pixel));
        let layer = layer.and_then(|(texels, bytes)| texels.checked_mul(bytes));
        let block = header.max_block_byte_size();
        ensure!(
            layer.is_some_and(|bytes| bytes <= MAX_EXR_BYTES) && block <= MAX_EXR_BYTES,
            "its channels take more than {} MiB: leave out all but R, G and B",
            MAX_EXR_BYTES >> 20
        );
        ensure!(
            header.own_attributes.environment_map != Some(EnvironmentMap::Cube),
            "it is a cube map; a latitude-longitude map is needed"
        );
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(
            |size, _| Picture {
                size: [size.width(), size.height()],
                texels: vec![[0.0; 3]; size.area()],
            },
            |picture: &mut Picture, at, (r, g, b): (f32, f32, f32)| {
                picture.texels[at.y() * picture.size[0] + at.x()] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_file(path)?;
    Ok(image.layer_data.channel_data.pixels)
}

fn read_hdr(path: &Path) -> crate::Result<Picture> {
    let decoder = HdrDecoder::new(BufReader::new(File::open(path)?))?;
    let (width, height) = decoder.dimensions();
    let size = [width as usize, height as usize];
    check_size(size)?;
    let mut bytes = vec![0; 12 * size[0] * size[1]];
    decoder.read_image(&mut bytes)?;
    let texels = bytes.chunks_exact(12).map(|texel| {
        std::array::from_fn(|c| {
            let bytes = [0, 1, 2, 3].map(|byte| texel[4 * c + byte]);
            f32::from_ne_bytes(bytes)
        })
    });
    Ok(Picture {
        size,
        texels: texels.collect(),
    })
}
