//! The WGSL library as text, and the constants that Rust and WGSL share.

use std::fmt::Write;

use aogrid_tables::{ClipTable, MergeTable};

use crate::EnvironmentMap;

/// The shading library: constants, then functions. Paste it in front of a shader of your own; it
/// holds pure functions and one struct, all with the prefix `aogrid`, no bindings, no entry points
/// and no directives, so that it can also be imported.
pub const SHADING: &str = concat!(include_str!("constants.wgsl"), include_str!("shading.wgsl"));

/// Light from an environment: paste it behind [`SHADING`]. Pure functions and two structs, with
/// the same prefix.
pub const ENVIRONMENT: &str = include_str!("environment.wgsl");

/// The raster pass, for reading and for measuring: what [`OcclusionPass`](crate::OcclusionPass)
/// compiles.
pub const OCCLUSION_PASS: &str = concat!(
    include_str!("constants.wgsl"),
    include_str!("shading.wgsl"),
    include_str!("frame/frame.wgsl"),
    include_str!("boxes/boxes.wgsl"),
    include_str!("occlusion_pass/occlusion_pass.wgsl")
);

/// The merging raster pass, likewise: what [`MergePass`](crate::MergePass) compiles.
pub const MERGE_PASS: &str = concat!(
    include_str!("constants.wgsl"),
    include_str!("shading.wgsl"),
    include_str!("frame/frame.wgsl"),
    include_str!("boxes/boxes.wgsl"),
    include_str!("merge_pass/merge_pass.wgsl")
);

/// The tiled pass, likewise: what [`TiledPass`](crate::TiledPass) compiles for a target whose format
/// has this name in WGSL.
pub fn tiled_pass(format: &str) -> String {
    let target = format!(
        "/// Written once a pixel.\n@group(2) @binding(3) \
         var target_image: texture_storage_2d<{format}, write>;\n"
    );
    let parts = [
        SHADING,
        include_str!("frame/frame.wgsl"),
        include_str!("tiled_pass/tiled_pass.wgsl"),
        &target,
    ];
    parts.concat()
}

/// What a forward or transparent shader reads the lists of a [`TiledPass`](crate::TiledPass) with:
/// bindings in bind group `group`, which [`TiledPass::lists`](crate::TiledPass::lists) makes, and the
/// functions `aogrid_multiply_listed` and `aogrid_merge_listed`. Behind [`SHADING`].
pub fn tile_lists(group: u32) -> String {
    include_str!("tiled_pass/tile_lists.wgsl").replace("GROUP", &group.to_string())
}

/// The environment pass, for reading and for measuring: what
/// [`EnvironmentPass`](crate::EnvironmentPass) compiles.
pub const ENVIRONMENT_PASS: &str = concat!(
    include_str!("constants.wgsl"),
    include_str!("shading.wgsl"),
    include_str!("environment.wgsl"),
    include_str!("environment_pass/environment_pass.wgsl")
);

/// The id of no object: an occluder without an id, an unused place of
/// [`Instance::excluded`](crate::Instance::excluded). No receiver may have it.
pub const AOGRID_NO_OBJECT: u32 = u32::MAX;

/// Pixels along a tile's side.
pub const AOGRID_TILE: u32 = 16;

/// The most words of 32 occluders that a tile has room for.
pub(crate) const AOGRID_TILE_WORDS: u32 = 128;

/// The list of what may shade the receivers that the G-buffer shows.
pub const AOGRID_LIST_OF_RECEIVERS: u32 = 0;

/// The list of what may shade anything else that is seen in a tile, at any depth.
pub const AOGRID_LIST_OF_ANYTHING: u32 = 1;

/// Squared length below which an axis is rounding and counts as none. A stored axis shorter than
/// an 8-bit step, 1/127, says nothing; rounding in the decoding is 1e-7; this is 1e-4.
pub(crate) const AOGRID_AXIS_GUARD: f32 = 1e-8;

/// Keeps the closed form finite: the root of it, 1e-6, is below single floats' rounding of the
/// angles that it enters.
pub(crate) const AOGRID_RIM_GUARD: f32 = 1e-12;

/// Of a fraction or a cosine: what is below it is none, and nothing is divided by less. A cone of
/// this fraction has a half-angle of 0.1 degrees.
pub(crate) const AOGRID_FRACTION_GUARD: f32 = 1e-6;

pub(crate) const AOGRID_ENVIRONMENT_LAST_LEVEL: f32 = (EnvironmentMap::LEVELS - 1) as f32;
pub(crate) const AOGRID_ENVIRONMENT_HEIGHT: f32 = EnvironmentMap::SIZE[1] as f32;

pub(crate) const AOGRID_PI: f32 = std::f32::consts::PI;

pub(crate) const AOGRID_CLIP_FRACTION_SCALE: f32 = scale(ClipTable::SIZE[0]);
pub(crate) const AOGRID_CLIP_FRACTION_OFFSET: f32 = 0.5 / ClipTable::SIZE[0] as f32;
pub(crate) const AOGRID_CLIP_COS_SCALE: f32 = 0.5 * scale(ClipTable::SIZE[1]);
/// ½ (N − 1)/N + ½/N.
pub(crate) const AOGRID_CLIP_COS_OFFSET: f32 = 0.5;

pub(crate) const AOGRID_MERGE_FRACTION_SCALE: f32 = -0.5 * scale(MergeTable::SIZE[0]);
/// The transmittance 1 is the fraction 0.
pub(crate) const AOGRID_MERGE_FRACTION_OFFSET: f32 =
    0.5 * scale(MergeTable::SIZE[0]) + 0.5 / MergeTable::SIZE[0] as f32;
pub(crate) const AOGRID_MERGE_ANGLE_SCALE: f32 = scale(MergeTable::SIZE[2]) / AOGRID_PI;
pub(crate) const AOGRID_MERGE_ANGLE_OFFSET: f32 = 0.5 / MergeTable::SIZE[2] as f32;

const fn scale(nodes: usize) -> f32 {
    (nodes - 1) as f32 / nodes as f32
}

/// What `constants.wgsl` must be.
pub fn constants() -> String {
    let mut text = String::from(
        "// aogrid: constants of the shading library, generated from Rust (`runtime/src/wgsl.rs`).\n\n",
    );
    let mut say = |comment: &str, lines: &[(&str, String)]| {
        if !comment.is_empty() {
            let _ = writeln!(text, "// {comment}");
        }
        for (name, value) in lines {
            let _ = writeln!(text, "const {name} = {value};");
        }
    };
    let float = |value: f32| format!("{value:?}");
    say(
        "T_clip's nodes lie at the ends of its axes: a look-up at x goes to x * SCALE + OFFSET.",
        &[
            (
                "AOGRID_CLIP_FRACTION_SCALE",
                float(AOGRID_CLIP_FRACTION_SCALE),
            ),
            (
                "AOGRID_CLIP_FRACTION_OFFSET",
                float(AOGRID_CLIP_FRACTION_OFFSET),
            ),
        ],
    );
    say(
        "The same for (cos beta + 1) / 2, with cos beta as the argument.",
        &[
            ("AOGRID_CLIP_COS_SCALE", float(AOGRID_CLIP_COS_SCALE)),
            ("AOGRID_CLIP_COS_OFFSET", float(AOGRID_CLIP_COS_OFFSET)),
        ],
    );
    say(
        "The same for T_merge: fractions AO/2 with 1 - AO as the argument, and gamma / pi with gamma.",
        &[
            (
                "AOGRID_MERGE_FRACTION_SCALE",
                float(AOGRID_MERGE_FRACTION_SCALE),
            ),
            (
                "AOGRID_MERGE_FRACTION_OFFSET",
                float(AOGRID_MERGE_FRACTION_OFFSET),
            ),
            ("AOGRID_MERGE_ANGLE_SCALE", float(AOGRID_MERGE_ANGLE_SCALE)),
            (
                "AOGRID_MERGE_ANGLE_OFFSET",
                float(AOGRID_MERGE_ANGLE_OFFSET),
            ),
        ],
    );
    say(
        "Squared length below which an axis is rounding and counts as none.",
        &[("AOGRID_AXIS_GUARD", float(AOGRID_AXIS_GUARD))],
    );
    say(
        "Keeps the closed form of T_clip finite where the plane touches the cone's rim.",
        &[("AOGRID_RIM_GUARD", float(AOGRID_RIM_GUARD))],
    );
    say(
        "Fractions and cosines below which there is none.",
        &[("AOGRID_FRACTION_GUARD", float(AOGRID_FRACTION_GUARD))],
    );
    say(
        "An environment's map: its last level, whose cones are hemispheres, and level 0's rows.",
        &[
            (
                "AOGRID_ENVIRONMENT_LAST_LEVEL",
                float(AOGRID_ENVIRONMENT_LAST_LEVEL),
            ),
            (
                "AOGRID_ENVIRONMENT_HEIGHT",
                float(AOGRID_ENVIRONMENT_HEIGHT),
            ),
        ],
    );
    say(
        "The id of no object.",
        &[("AOGRID_NO_OBJECT", format!("{AOGRID_NO_OBJECT}u"))],
    );
    say(
        "Pixels along a tile's side, words of 32 occluders that a tile has room for, its lists.",
        &[
            ("AOGRID_TILE", format!("{AOGRID_TILE}u")),
            ("AOGRID_TILE_WORDS", format!("{AOGRID_TILE_WORDS}u")),
            (
                "AOGRID_LIST_OF_RECEIVERS",
                format!("{AOGRID_LIST_OF_RECEIVERS}u"),
            ),
            (
                "AOGRID_LIST_OF_ANYTHING",
                format!("{AOGRID_LIST_OF_ANYTHING}u"),
            ),
        ],
    );
    say("", &[("AOGRID_PI", float(AOGRID_PI))]);
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_committed_constants_are_those_of_rust() {
        assert_eq!(
            include_str!("constants.wgsl"),
            constants(),
            "paste it from here"
        );
    }

    #[test]
    fn merge_look_ups_go_where_the_table_puts_its_nodes() {
        let [a1, a2, angle] = MergeTable::SIZE;
        for (first, second, gamma) in [(0.0, 0.0, 0.0), (0.3, 1.0, 1.0), (1.0, 0.6, AOGRID_PI)] {
            // Axes of unit length, as though occlusion were 2.
            let (sin, cos) = f32::sin_cos(gamma);
            let one = [0.0, 0.0, 1.0, 1.0 - first];
            let other = [sin, 0.0, cos, 1.0 - second];
            let found = crate::shading::aogrid_merge_coordinate(one, other);
            let expected = [
                aogrid_tables::texture_coordinate(first / 2.0, a1),
                aogrid_tables::texture_coordinate(second / 2.0, a2),
                aogrid_tables::texture_coordinate(gamma / AOGRID_PI, angle),
            ];
            for (found, expected) in found.iter().zip(expected) {
                // A rounding of cos gamma, 6e-8, is an angle of 3.5e-4 at 0 and pi.
                assert!((found - expected).abs() < 2e-4, "{found} {expected}");
            }
        }
    }

    #[test]
    fn look_ups_go_where_the_tables_put_their_nodes() {
        for x in [0.0_f32, 0.25, 1.0] {
            let expected = aogrid_tables::texture_coordinate(x, ClipTable::SIZE[0]);
            let [u, v] = crate::shading::aogrid_clip_coordinate(x, 2.0 * x - 1.0);
            // One rounding each way.
            assert!((u - expected).abs() < 2e-7 && (v - expected).abs() < 2e-7);
        }
    }
}
