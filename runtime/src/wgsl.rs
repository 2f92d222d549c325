//! The WGSL library as text, and the constants that Rust and WGSL share.

use std::fmt::Write;

use aogrid_tables::{ClipTable, MergeTable};

use crate::EnvironmentMap;
use crate::volumes::{AOGRID_WEIGHT_EDGES, AOGRID_WEIGHT_LINEAR, AOGRID_WEIGHT_NONE};

/// The files of the shading library, for `concat!`.
macro_rules! shading {
    () => {
        concat!(
            include_str!("constants.wgsl"),
            include_str!("lookup.wgsl"),
            include_str!("shading.wgsl")
        )
    };
}

/// The shading library: constants, then functions. Paste it in front of your own shader. It holds
/// pure functions and structs, all with the prefix `aogrid`, and no bindings, entry points or
/// directives, so that it can also be imported.
pub const SHADING: &str = shading!();

/// The environment-light library: paste it behind [`SHADING`]. It holds pure functions and two
/// structs, with the same prefix.
pub const ENVIRONMENT: &str = include_str!("environment.wgsl");

/// The library of [`surface`](crate::surface): paste it behind [`SHADING`] and [`ENVIRONMENT`]. It holds
/// pure functions, with the same prefix.
pub const SURFACE: &str = include_str!("surface.wgsl");

/// The library of [`volumes`](crate::volumes): paste it behind [`SHADING`]. It holds pure functions and
/// two structs, with the same prefix.
pub const VOLUMES: &str = include_str!("volumes.wgsl");

/// The source of the raster pass, for reading and for measuring, as
/// [`OcclusionPass`](crate::OcclusionPass) compiles it.
pub const OCCLUSION_PASS: &str = concat!(
    shading!(),
    include_str!("gbuffer/gbuffer.wgsl"),
    include_str!("boxes/boxes.wgsl"),
    include_str!("occlusion_pass/occlusion_pass.wgsl")
);

/// The source of the volume pass, as [`VolumePass`](crate::VolumePass) compiles it.
pub const VOLUME_PASS: &str = concat!(
    shading!(),
    include_str!("volumes.wgsl"),
    include_str!("gbuffer/gbuffer.wgsl"),
    include_str!("volume_pass/volume_pass.wgsl")
);

/// The source of the upsampling pass, as [`UpsamplePass`](crate::UpsamplePass) compiles it.
pub const UPSAMPLE_PASS: &str = concat!(
    shading!(),
    include_str!("volumes.wgsl"),
    include_str!("gbuffer/gbuffer.wgsl"),
    include_str!("volume_pass/upsample.wgsl")
);

/// The source of the merging raster pass, as [`MergePass`](crate::MergePass) compiles it.
pub const MERGE_PASS: &str = concat!(
    shading!(),
    include_str!("gbuffer/gbuffer.wgsl"),
    include_str!("boxes/boxes.wgsl"),
    include_str!("merge_pass/merge_pass.wgsl")
);

/// Returns the source of the tiled pass, as [`TiledPass`](crate::TiledPass) compiles it for a
/// target of the WGSL texel format `format`.
pub fn tiled_pass(format: &str) -> String {
    let target = format!(
        "/// Written once a pixel.\n@group(2) @binding(3) \
         var target_image: texture_storage_2d<{format}, write>;\n"
    );
    let parts = [
        SHADING,
        include_str!("gbuffer/gbuffer.wgsl"),
        include_str!("tiled_pass/tiled_pass.wgsl"),
        &target,
    ];
    parts.concat()
}

/// Returns the WGSL with which a forward or transparent shader reads the lists of a
/// [`TiledPass`](crate::TiledPass): the bindings of bind group `group`, which
/// [`TiledPass::lists`](crate::TiledPass::lists) returns, and the functions
/// `aogrid_multiply_listed` and `aogrid_merge_listed`. Paste it behind [`SHADING`].
pub fn tile_lists(group: u32) -> String {
    include_str!("tiled_pass/tile_lists.wgsl").replace("GROUP", &group.to_string())
}

/// The source of the environment pass, for reading and for measuring, as
/// [`EnvironmentPass`](crate::EnvironmentPass) compiles it.
pub const ENVIRONMENT_PASS: &str = concat!(
    shading!(),
    include_str!("environment.wgsl"),
    include_str!("environment_pass/environment_pass.wgsl")
);

/// The id that stands for no object: an occluder without an id, or an unused slot of
/// [`Instance::excluded`](crate::Instance::excluded). No receiver may have it.
pub const AOGRID_NO_OBJECT: u32 = u32::MAX;

/// The side length of a tile, in pixels.
pub const AOGRID_TILE: u32 = 16;

/// The maximum number of words in a tile's list, with one bit for each of 32 occluders.
pub(crate) const AOGRID_TILE_WORDS: u32 = 128;

/// The list of the occluders that may shade the receivers in the G-buffer.
pub const AOGRID_LIST_OPAQUE: u32 = 0;

/// The list of the occluders that may shade anything visible in a tile, at any depth.
pub const AOGRID_LIST_ALL_DEPTHS: u32 = 1;

/// The squared length below which an axis is rounding noise and counts as no axis. A stored axis
/// shorter than an 8-bit step, 1/127, carries no direction; decoding rounds by 1e-7; the threshold
/// length is 1e-4.
pub(crate) const AOGRID_AXIS_EPSILON: f32 = 1e-8;

/// The lower bound of a squared length in any unit that is a divisor.
pub(crate) const AOGRID_SQUARE_EPSILON: f32 = 1e-30;

/// The length of the cross product of two corners, in squared world units, up to which the edge between
/// them counts as seen from its end. Single precision rounds the coordinates of a receiver by more.
pub(crate) const AOGRID_LENGTH_EPSILON: f32 = 1e-18;

/// The lower bound of the radicand in the closed form of T_clip, which keeps it finite. Its root,
/// 1e-6, is below the single-precision rounding of the angles that it enters.
pub(crate) const AOGRID_RIM_EPSILON: f32 = 1e-12;

/// The lower bound for fractions and cosines used as divisors; smaller values count as zero. A cone
/// of this fraction has a half-angle of 0.1 degrees.
pub(crate) const AOGRID_FRACTION_EPSILON: f32 = 1e-6;

/// The upper bound of the flatness times the hull's sin²α.
pub(crate) const AOGRID_MAX_FLATNESS: f32 = aogrid_grid_format::MAX_FLATNESS;

pub(crate) const AOGRID_ENVIRONMENT_LAST_LEVEL: f32 = (EnvironmentMap::LEVELS - 1) as f32;
pub(crate) const AOGRID_ENVIRONMENT_HEIGHT: f32 = EnvironmentMap::SIZE[1] as f32;

pub(crate) const AOGRID_PI: f32 = std::f32::consts::PI;

pub(crate) const AOGRID_CLIP_FRACTION_SCALE: f32 = scale(ClipTable::SIZE[0]);
pub(crate) const AOGRID_CLIP_FRACTION_OFFSET: f32 = 0.5 / ClipTable::SIZE[0] as f32;
pub(crate) const AOGRID_CLIP_COS_SCALE: f32 = 0.5 * scale(ClipTable::SIZE[1]);
/// The sum ½ (N − 1)/N + ½/N.
pub(crate) const AOGRID_CLIP_COS_OFFSET: f32 = 0.5;

pub(crate) const AOGRID_MERGE_FRACTION_SCALE: f32 = -0.5 * scale(MergeTable::SIZE[0]);
/// The offset that maps the transmittance 1 to the fraction 0.
pub(crate) const AOGRID_MERGE_FRACTION_OFFSET: f32 =
    0.5 * scale(MergeTable::SIZE[0]) + 0.5 / MergeTable::SIZE[0] as f32;
pub(crate) const AOGRID_MERGE_ANGLE_SCALE: f32 = scale(MergeTable::SIZE[2]) / AOGRID_PI;
pub(crate) const AOGRID_MERGE_ANGLE_OFFSET: f32 = 0.5 / MergeTable::SIZE[2] as f32;

/// The distance between the centers of the first and the last texel, in texture coordinates.
const fn scale(nodes: usize) -> f32 {
    (nodes - 1) as f32 / nodes as f32
}

/// The names of constants of type f32 and their values in WGSL.
macro_rules! floats {
    ($($name:ident),+) => {
        &[$((stringify!($name), format!("{:?}", $name))),+]
    };
}

/// The same of type u32.
macro_rules! unsigned {
    ($($name:ident),+) => {
        &[$((stringify!($name), format!("{}u", $name))),+]
    };
}

/// Writes constants, behind a comment unless that is empty.
fn write_group(text: &mut String, comment: &str, lines: &[(&str, String)]) {
    if !comment.is_empty() {
        let _ = writeln!(text, "// {comment}");
    }
    for (name, value) in lines {
        let _ = writeln!(text, "const {name} = {value};");
    }
}

/// Returns the text that `constants.wgsl` must hold.
pub fn constants() -> String {
    let mut text = String::from(
        "// aogrid: constants of the shading library, generated from Rust (`runtime/src/wgsl.rs`).\n\n",
    );
    let mut group = |comment, lines: &[_]| write_group(&mut text, comment, lines);
    group(
        "T_clip has nodes at both ends of its axes: x is looked up at x * SCALE + OFFSET.",
        floats!(AOGRID_CLIP_FRACTION_SCALE, AOGRID_CLIP_FRACTION_OFFSET),
    );
    group(
        "The same for (cos beta + 1) / 2, with cos beta as the argument.",
        floats!(AOGRID_CLIP_COS_SCALE, AOGRID_CLIP_COS_OFFSET),
    );
    group(
        "The same for T_merge: fractions AO/2 with 1 - AO as the argument, and gamma / pi with gamma.",
        floats!(
            AOGRID_MERGE_FRACTION_SCALE,
            AOGRID_MERGE_FRACTION_OFFSET,
            AOGRID_MERGE_ANGLE_SCALE,
            AOGRID_MERGE_ANGLE_OFFSET
        ),
    );
    group(
        "The squared length below which an axis is rounding noise and counts as no axis.",
        floats!(AOGRID_AXIS_EPSILON),
    );
    group(
        "The lower bound of a squared length in any unit that is a divisor.",
        floats!(AOGRID_SQUARE_EPSILON),
    );
    group(
        "The cross product of two corners up to which the edge between them counts as seen from its end.",
        floats!(AOGRID_LENGTH_EPSILON),
    );
    group(
        "Keeps the closed form of T_clip finite where the tangent plane touches the cone's rim.",
        floats!(AOGRID_RIM_EPSILON),
    );
    group(
        "The lower bound for fractions and cosines used as divisors; smaller values count as zero.",
        floats!(AOGRID_FRACTION_EPSILON),
    );
    group(
        "The upper bound of the flatness times the hull's squared sine of alpha.",
        floats!(AOGRID_MAX_FLATNESS),
    );
    write_other_constants(&mut text);
    write_group(&mut text, "", floats!(AOGRID_PI));
    text
}

/// Writes the constants of the environment, of ids, tiles and volumes.
fn write_other_constants(text: &mut String) {
    let mut group = |comment, lines: &[_]| write_group(text, comment, lines);
    group(
        "The environment map: its last level, whose cones are hemispheres, and the rows of level 0.",
        floats!(AOGRID_ENVIRONMENT_LAST_LEVEL, AOGRID_ENVIRONMENT_HEIGHT),
    );
    group(
        "The id that stands for no object.",
        unsigned!(AOGRID_NO_OBJECT),
    );
    group(
        "Tiles: the side in pixels, the maximum number of words (32 occluders) in a list, the lists.",
        unsigned!(
            AOGRID_TILE,
            AOGRID_TILE_WORDS,
            AOGRID_LIST_OPAQUE,
            AOGRID_LIST_ALL_DEPTHS
        ),
    );
    group(
        "The weights of volumes.",
        unsigned!(
            AOGRID_WEIGHT_NONE,
            AOGRID_WEIGHT_LINEAR,
            AOGRID_WEIGHT_EDGES
        ),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn committed_constants_match_rust() {
        assert_eq!(
            include_str!("constants.wgsl"),
            constants(),
            "constants.wgsl is out of date: replace it by the text on the right"
        );
    }

    #[test]
    fn merge_lookups_hit_the_table_nodes() {
        let [a1, a2, angle] = MergeTable::SIZE;
        for (first, second, gamma) in [(0.0, 0.0, 0.0), (0.3, 1.0, 1.0), (1.0, 0.6, AOGRID_PI)] {
            // Axes of unit length, as if AO were 2.
            let (sin, cos) = f32::sin_cos(gamma);
            let first_cone = [0.0, 0.0, 1.0, 1.0 - first];
            let second_cone = [sin, 0.0, cos, 1.0 - second];
            let found = crate::shading::aogrid_merge_coordinate(first_cone, second_cone);
            let expected = [
                aogrid_tables::texture_coordinate(first / 2.0, a1),
                aogrid_tables::texture_coordinate(second / 2.0, a2),
                aogrid_tables::texture_coordinate(gamma / AOGRID_PI, angle),
            ];
            for (found, expected) in found.iter().zip(expected) {
                // Rounding cos gamma by 6e-8 changes the angle by 3.5e-4 at 0 and pi.
                assert!((found - expected).abs() < 2e-4, "{found} {expected}");
            }
        }
    }

    #[test]
    fn clip_lookups_hit_the_table_nodes() {
        for x in [0.0_f32, 0.25, 1.0] {
            let expected = aogrid_tables::texture_coordinate(x, ClipTable::SIZE[0]);
            let [u, v] = crate::shading::aogrid_clip_coordinate(x, 2.0 * x - 1.0);
            // One rounding on either side.
            assert!((u - expected).abs() < 2e-7 && (v - expected).abs() < 2e-7);
        }
    }
}
