//! Environments: maps from EXR and HDR files, one colour, or a room's six walls.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use aogrid_baker_cpu::truth::Environment;
use exr::meta::MetaData;
use exr::meta::attribute::EnvironmentMap;
use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel};
use glam::{DMat3, DVec3};
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;
use toml::Spanned;

use super::build::resolve;
use super::numbers::colour;
use super::places::Source;
use super::schema::{EnvironmentFile, RoomFile, UpAxis};

/// Where an environment's radiance comes from, not yet read.
#[derive(Clone, Debug)]
pub struct EnvironmentSource {
    radiance: Radiance,
    map_from_world: DMat3,
    scale: f32,
}

#[derive(Clone, Debug)]
enum Radiance {
    File(PathBuf),
    Colour([f32; 3]),
    /// Towards +x, −x, +y, −y, +z, −z of the map.
    Room([[f32; 3]; 6]),
}

/// A picture of radiance, rows from the top.
struct Picture {
    size: [usize; 2],
    texels: Vec<[f32; 3]>,
}

/// The most texels of a map: 8192 by 4096.
const MAX_TEXELS: usize = 8192 * 4096;

/// The most bytes that an EXR file's picture may take with all its channels.
const MAX_EXR_BYTES: usize = 512 << 20;

/// What half floats can hold: where a file says infinity it means at least this.
const BRIGHTEST: f32 = 65504.0;

/// A room's map: texels of 0.7 degrees.
const ROOM: [usize; 2] = [512, 256];

impl EnvironmentSource {
    pub(super) fn new(
        source: &Source<'_>,
        spanned: Spanned<EnvironmentFile>,
        scene_up: UpAxis,
    ) -> anyhow::Result<Self> {
        let place = Spanned::new(spanned.span(), ());
        let file = spanned.into_inner();
        let radiance = match (file.file, file.color, file.room) {
            (Some(name), None, None) => Radiance::File(resolve(source.path, &name)),
            (None, Some(given), None) => Radiance::Colour(colour(given)),
            (None, None, Some(room)) => Radiance::Room(walls(&room)),
            _ => {
                let message = "exactly one of `file`, `color` and `room` is needed";
                return Err(source.at(&place, "environment", message));
            }
        };
        let yaw = file.yaw.map_or(0.0, |v| v.0).to_radians();
        let stand = match file.up.unwrap_or(scene_up) {
            UpAxis::Y => DMat3::IDENTITY,
            // World z becomes the map's y, world −y its z.
            UpAxis::Z => DMat3::from_cols(DVec3::X, -DVec3::Z, DVec3::Y),
        };
        Ok(Self {
            radiance,
            map_from_world: DMat3::from_rotation_y(-yaw) * stand,
            scale: file.scale.map_or(1.0, |v| v.0 as f32),
        })
    }

    /// Reads or makes the map; with it come warnings, a line each.
    ///
    /// # Errors
    ///
    /// The file is no map of a kind that is read, or too large.
    pub fn load(&self) -> anyhow::Result<(Environment, Vec<String>)> {
        let mut warnings = vec![];
        let mut picture = match &self.radiance {
            Radiance::File(path) => read(path, &mut warnings)?,
            Radiance::Colour(colour) => Picture {
                size: [1, 1],
                texels: vec![*colour],
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

fn walls(room: &RoomFile) -> [[f32; 3]; 6] {
    let RoomFile {
        right,
        left,
        ceiling,
        floor,
        front,
        back,
    } = room;
    [right, left, ceiling, floor, front, back].map(|c| colour(*c))
}

/// A cube's walls as a latitude-longitude map, 4×4 points a texel.
fn room(walls: &[[f32; 3]; 6]) -> Picture {
    const POINTS: usize = 4;
    let [width, height] = ROOM;
    let wall = |x: usize, y: usize| {
        let at = |i: usize, n: usize| (i as f64 + 0.5) / (n * POINTS) as f64;
        let (u, v) = (at(x, width), at(y, height));
        let (sin, cos) = ((0.5 - u) * std::f64::consts::TAU).sin_cos();
        let (up, level) = ((0.5 - v) * std::f64::consts::PI).sin_cos();
        let d = [level * sin, up, level * cos];
        let major = (0..3).max_by(|&a, &b| d[a].abs().total_cmp(&d[b].abs()));
        let major = major.expect("there are three axes");
        walls[2 * major + usize::from(d[major] < 0.0)]
    };
    let texel = |idx: usize| {
        let (x, y) = (idx % width * POINTS, idx / width * POINTS);
        let mut sum = [0.0; 3];
        for point in 0..POINTS * POINTS {
            let colour = wall(x + point % POINTS, y + point / POINTS);
            sum = std::array::from_fn(|c| sum[c] + colour[c]);
        }
        sum.map(|v| v / (POINTS * POINTS) as f32)
    };
    Picture {
        size: ROOM,
        texels: (0..width * height).map(texel).collect(),
    }
}

/// Reads an EXR or HDR file, by its first bytes.
fn read(path: &Path, warnings: &mut Vec<String>) -> anyhow::Result<Picture> {
    let shown = || path.display().to_string();
    let metadata = std::fs::metadata(path).with_context(shown)?;
    ensure!(metadata.is_file(), "{}: it is not a regular file", shown());
    let mut start = [0; 4];
    let mut file = File::open(path).with_context(shown)?;
    let is_whole = std::io::Read::read_exact(&mut file, &mut start).is_ok();
    let mut picture = match &start {
        [0x76, 0x2f, 0x31, 0x01] if is_whole => read_exr(path).with_context(shown)?,
        [b'#', b'?', ..] if is_whole => read_hdr(path).with_context(shown)?,
        _ => bail!(
            "{}: it is neither an EXR nor a Radiance HDR picture",
            shown()
        ),
    };
    let [negative, odd] = clean(&mut picture.texels);
    if negative > 0 {
        warnings.push(format!(
            "{}: {negative} texels have negative radiance, which was clamped to 0",
            shown()
        ));
    }
    if odd > 0 {
        warnings.push(format!(
            "{}: {odd} texels are infinite, which was clamped to {BRIGHTEST}, or no number, which became 0",
            shown()
        ));
    }
    Ok(picture)
}

/// Makes radiance of what a file may hold; how many texels were negative, and how many infinite
/// or no number.
fn clean(texels: &mut [[f32; 3]]) -> [usize; 2] {
    let (mut negative, mut odd) = (0, 0);
    for texel in texels {
        negative += usize::from(texel.iter().any(|&v| v < 0.0));
        odd += usize::from(texel.iter().any(|v| !v.is_finite()));
        *texel = texel.map(|v| match v {
            v if v.is_nan() => 0.0,
            v if v.is_infinite() && v > 0.0 => BRIGHTEST,
            v => v.max(0.0),
        });
    }
    [negative, odd]
}

fn check_size([width, height]: [usize; 2]) -> anyhow::Result<()> {
    match width.checked_mul(height) {
        Some(0) => bail!("it has no texels"),
        Some(n) if n <= MAX_TEXELS => Ok(()),
        _ => bail!("{width}×{height} texels are more than {MAX_TEXELS}: scale it down"),
    }
}

/// The largest level of the first layer with colours.
fn read_exr(path: &Path) -> anyhow::Result<Picture> {
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
            "its channels take more than {} MiB: leave out what is not a colour",
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

fn read_hdr(path: &Path) -> anyhow::Result<Picture> {
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
