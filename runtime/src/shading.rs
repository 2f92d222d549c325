//! The CPU twin of `shading.wgsl`: the same functions under the same names, in single floats.
//!
//! The un-idiomatic parts (free functions with a prefix, the occluder as first argument) allow it
//! to be read side by side with the WGSL. An `fma` there is a multiplication and an addition here:
//! the difference is one rounding, far below the error of a texture filter.

use crate::lookup::dot;
pub use crate::lookup::{
    AogridLookup, aogrid_distant_axis, aogrid_distant_fraction, aogrid_grid_position,
    aogrid_inverse_length, aogrid_is_on_itself, aogrid_lookup, aogrid_lookup_on_itself, aogrid_row,
    aogrid_shades,
};
use crate::wgsl::{
    AOGRID_CLIP_COS_OFFSET, AOGRID_CLIP_COS_SCALE, AOGRID_CLIP_FRACTION_OFFSET,
    AOGRID_CLIP_FRACTION_SCALE, AOGRID_FRACTION_EPSILON, AOGRID_MERGE_ANGLE_OFFSET,
    AOGRID_MERGE_ANGLE_SCALE, AOGRID_MERGE_FRACTION_OFFSET, AOGRID_MERGE_FRACTION_SCALE, AOGRID_PI,
    AOGRID_RIM_EPSILON, AOGRID_TILE,
};
use crate::{AogridAtlasOccluder, AogridOccluder, AogridTiles, CpuTexture};

/// A cone of directions that covers a fraction of the sphere, and of which a uniform share, the
/// density, is occluded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AogridCone {
    /// The unit axis in world space, towards the occluder; zero without an axis.
    pub axis: [f32; 3],
    /// The fraction of the sphere, 0..=1.
    pub fraction: f32,
    /// The share of its directions that is occluded, 0..=1.
    pub density: f32,
}

impl AogridCone {
    /// A cone of density 1.
    pub fn new(axis: [f32; 3], fraction: f32) -> Self {
        Self {
            axis,
            fraction,
            density: 1.0,
        }
    }
}

// ---- One call per occluder --------------------------------------------------------------------

/// The transmittance 1 − AO of a cone grid at a receiver in world space; 1 beyond the occluder's
/// reach: its far field, or without one its grid's box. `normal` is the receiver's unit normal,
/// `table` T_clip as transmittance (RR-5779, 5.1). The receiver belongs to another object.
pub fn aogrid_cone(
    occluder: &AogridOccluder,
    grid: &CpuTexture,
    table: &CpuTexture,
    position: [f32; 3],
    normal: [f32; 3],
) -> f32 {
    let lookup = aogrid_lookup(occluder, position);
    match lookup.is_reached {
        true => aogrid_cone_at(occluder, grid, table, lookup, normal),
        false => 1.0,
    }
}

/// [`aogrid_cone`] for a receiver that belongs to the occluder itself.
pub fn aogrid_cone_on_itself(
    occluder: &AogridOccluder,
    grid: &CpuTexture,
    table: &CpuTexture,
    position: [f32; 3],
    normal: [f32; 3],
) -> f32 {
    let lookup = aogrid_lookup_on_itself(occluder, position, normal);
    match lookup.is_reached {
        true => aogrid_cone_at(occluder, grid, table, lookup, normal),
        false => 1.0,
    }
}

/// Merges a cone grid into `accumulated` (RR-5779, 5.2.2), for objects that overlap as seen from
/// the receiver. Start with \[0, 0, 0, 1\]; the last w is the transmittance. The result depends on
/// the order of three or more occluders: keep it fixed. `clip` is T_clip with all channels,
/// `overlaps` the overlap table of T_merge.
pub fn aogrid_merge_cone(
    accumulated: [f32; 4],
    occluder: &AogridOccluder,
    grid: &CpuTexture,
    clip: &CpuTexture,
    overlaps: &CpuTexture,
    position: [f32; 3],
    normal: [f32; 3],
) -> [f32; 4] {
    let lookup = aogrid_lookup(occluder, position);
    if !lookup.is_reached {
        return accumulated;
    }
    let contribution = aogrid_cone_with_axis_at(occluder, grid, clip, lookup, normal);
    aogrid_merge(accumulated, contribution, overlaps)
}

/// [`aogrid_cone`] without the box test, for a grid whose outer cells are all open, as after either
/// boundary treatment: the clamped sampler extends the open cells beyond the box. There is no far
/// field then.
pub fn aogrid_cone_faded(
    occluder: &AogridOccluder,
    grid: &CpuTexture,
    table: &CpuTexture,
    position: [f32; 3],
    normal: [f32; 3],
) -> f32 {
    let lookup = AogridLookup {
        position: aogrid_grid_position(occluder, position),
        is_reached: true,
        outward: [0.0; 3],
        distance: 1.0,
        remainder: 1.0,
        flatness: 0.0,
    };
    aogrid_cone_at(occluder, grid, table, lookup, normal)
}

/// The transmittance of an occlusion-only grid, independent of the receiver's normal (RR-5779, 4);
/// 1 beyond the occluder's reach. `on_itself`: the receiver belongs to the occluder.
pub fn aogrid_occlusion(
    occluder: &AogridOccluder,
    grid: &CpuTexture,
    position: [f32; 3],
    on_itself: bool,
) -> f32 {
    let lookup = aogrid_lookup(occluder, position);
    let stored = grid.sample(lookup.position)[0];
    let t = aogrid_occlusion_transmittance(aogrid_fraction(occluder, stored, lookup), on_itself);
    match lookup.is_reached {
        true => aogrid_strengthen(occluder, t),
        false => 1.0,
    }
}

/// [`aogrid_occlusion`] for a grid that holds cones.
pub fn aogrid_occlusion_of_cone(
    occluder: &AogridOccluder,
    grid: &CpuTexture,
    position: [f32; 3],
    on_itself: bool,
) -> f32 {
    let lookup = aogrid_lookup(occluder, position);
    let stored = grid.sample(lookup.position)[3];
    let t = aogrid_occlusion_transmittance(aogrid_fraction(occluder, stored, lookup), on_itself);
    match lookup.is_reached {
        true => aogrid_strengthen(occluder, t),
        false => 1.0,
    }
}

// ---- Building blocks ---------------------------------------------------------------------------

/// The transmittance of a cone grid at a look-up within reach.
pub fn aogrid_cone_at(
    occluder: &AogridOccluder,
    grid: &CpuTexture,
    table: &CpuTexture,
    lookup: AogridLookup,
    normal: [f32; 3],
) -> f32 {
    let cone = aogrid_cone_of(occluder, grid.sample(lookup.position), lookup);
    let t = aogrid_clip_transmittance(table, cone.fraction, dot(cone.axis, normal));
    cone.density * occluder.strength * (t - 1.0) + 1.0
}

/// The cone of a grid's texel at a look-up. The axis of interpolated cells is shorter than 1 where theirs
/// disagree: the cone then widens and thins so that it keeps both moments of the occluded
/// directions, their fraction and their mean.
pub fn aogrid_cone_of(
    occluder: &AogridOccluder,
    [r, g, b, alpha]: [f32; 4],
    lookup: AogridLookup,
) -> AogridCone {
    let stored = aogrid_axis(occluder, [r, g, b]);
    let per_length = aogrid_inverse_length(stored);
    let length = (dot(stored, stored) * per_length).clamp(occluder.min_axis_length, 1.0);
    let mut axis = stored.map(|x| x * per_length);
    if lookup.distance > 1.0 {
        axis = aogrid_distant_axis(axis, lookup);
    }
    let a = aogrid_fraction(occluder, alpha, lookup);
    let widened = (a - 1.0) * length + 1.0;
    AogridCone {
        axis,
        fraction: widened,
        density: a / widened.max(AOGRID_FRACTION_EPSILON),
    }
}

/// The occluded fraction of the sphere from a texel's alpha at a look-up.
pub fn aogrid_fraction(occluder: &AogridOccluder, alpha: f32, lookup: AogridLookup) -> f32 {
    let a = alpha * alpha.max(occluder.min_factor);
    match lookup.distance > 1.0 {
        true => aogrid_distant_fraction(a, lookup),
        false => a,
    }
}

/// The cone's axis in world space, not normalized, from a texel's rgb.
pub fn aogrid_axis(occluder: &AogridOccluder, rgb: [f32; 3]) -> [f32; 3] {
    [
        aogrid_row(occluder.axis_x, rgb),
        aogrid_row(occluder.axis_y, rgb),
        aogrid_row(occluder.axis_z, rgb),
    ]
}

/// The cosine of the angle between an axis of any length and a unit normal; 0 without an axis.
pub fn aogrid_cos_beta(axis: [f32; 3], normal: [f32; 3]) -> f32 {
    dot(axis, normal) * aogrid_inverse_length(axis)
}

/// 1 − AO from the occlusion fraction alone: AO = 2a on other surfaces, and 2a − 1 on the
/// occluder's own, which blocks half of all directions itself (RR-5779, 4.2, which prints half of
/// that).
pub fn aogrid_occlusion_transmittance(a: f32, on_itself: bool) -> f32 {
    let open = if on_itself { 2.0 } else { 1.0 };
    (open - 2.0 * a).clamp(0.0, 1.0)
}

/// The texture coordinates in T_clip of a cone of fraction `a` with its axis at `cos_beta`.
pub fn aogrid_clip_coordinate(a: f32, cos_beta: f32) -> [f32; 2] {
    [
        a * AOGRID_CLIP_FRACTION_SCALE + AOGRID_CLIP_FRACTION_OFFSET,
        cos_beta * AOGRID_CLIP_COS_SCALE + AOGRID_CLIP_COS_OFFSET,
    ]
}

/// 1 − AO of a clipped cone, from T_clip as transmittance (one channel).
pub fn aogrid_clip_transmittance(table: &CpuTexture, a: f32, cos_beta: f32) -> f32 {
    let [x, y] = aogrid_clip_coordinate(a, cos_beta);
    table.sample([x, y, 0.5])[0]
}

/// 1 − AO of a clipped cone in closed form, an alternative to the table.
pub fn aogrid_clip_transmittance_closed_form(a: f32, cos_beta: f32) -> f32 {
    let cos_alpha = 1.0 - 2.0 * a;
    let sin_alpha_squared = 4.0 * a * (1.0 - a);
    // Zero where the tangent plane touches the rim of the cone: bounded for the arc tangents.
    let root = (sin_alpha_squared - cos_beta * cos_beta)
        .max(AOGRID_RIM_EPSILON)
        .sqrt();
    let half_rim = root.atan2(-cos_alpha * cos_beta);
    let half_horizon = root.atan2(cos_alpha);
    let occlusion = sin_alpha_squared * cos_beta * half_rim + (half_horizon - root * cos_alpha);
    1.0 - (occlusion / AOGRID_PI).clamp(0.0, 1.0)
}

/// AO, the fraction a′ and the axis weight f of a clipped cone, from T_clip with all channels.
pub fn aogrid_clip(table: &CpuTexture, a: f32, cos_beta: f32) -> [f32; 3] {
    let [x, y] = aogrid_clip_coordinate(a, cos_beta);
    let [occlusion, fraction, axis_weight, _] = table.sample([x, y, 0.5]);
    [occlusion, fraction, axis_weight]
}

/// The unit axis of a clipped cone with unit axis d, f d + (1 − f) n; zero if that sum is zero
/// (RR-5779, 5.2.2).
pub fn aogrid_clipped_axis(axis: [f32; 3], normal: [f32; 3], axis_weight: f32) -> [f32; 3] {
    let sum: [f32; 3] =
        std::array::from_fn(|x| normal[x] * (1.0 - axis_weight) + axis[x] * axis_weight);
    sum.map(|x| x * aogrid_inverse_length(sum))
}

/// The contribution of one occluder where axes are accumulated: (AO/2) d′ and 1 − AO, the strength
/// included, from T_clip with all channels (RR-5779, 5.2.1). The product of all last components is
/// the transmittance; the normalized sum of the others is the axis of the occluded directions.
pub fn aogrid_cone_with_axis_at(
    occluder: &AogridOccluder,
    grid: &CpuTexture,
    table: &CpuTexture,
    lookup: AogridLookup,
    normal: [f32; 3],
) -> [f32; 4] {
    let cone = aogrid_cone_of(occluder, grid.sample(lookup.position), lookup);
    let clipped = aogrid_clip(table, cone.fraction, dot(cone.axis, normal));
    let occlusion = clipped[0] * cone.density * occluder.strength;
    let towards = aogrid_clipped_axis(cone.axis, normal, clipped[2]);
    let [x, y, z] = towards.map(|d| 0.5 * occlusion * d);
    [x, y, z, 1.0 - occlusion]
}

/// Applies the occluder's strength to a transmittance: 1 − strength · AO.
pub fn aogrid_strengthen(occluder: &AogridOccluder, transmittance: f32) -> f32 {
    (transmittance - 1.0) * occluder.strength + 1.0
}

// ---- Several occluders --------------------------------------------------------------------------
//
// The accumulated occluders, and the contribution of each, are four floats: the sum of all (AO/2)
// d′, then the transmittance 1 − AO. No occlusion is [0, 0, 0, 1].

/// Combines occluders as statistically independent: transmittances are multiplied (RR-5779, 5.2.1).
pub fn aogrid_multiply(accumulated: [f32; 4], contribution: [f32; 4]) -> [f32; 4] {
    let [x, y, z] = std::array::from_fn(|c| accumulated[c] + contribution[c]);
    [x, y, z, accumulated[3] * contribution[3]]
}

/// Combines occluders as cones around their axes: AO = 2 T_merge(AO₁/2, AO₂/2, γ), which is AO₁ +
/// AO₂ less twice the fraction that both cones cover, from `overlaps` (RR-5779, 5.2.2; JGT
/// supplement).
pub fn aogrid_merge(
    accumulated: [f32; 4],
    contribution: [f32; 4],
    overlaps: &CpuTexture,
) -> [f32; 4] {
    let overlap = overlaps.sample(aogrid_merge_coordinate(accumulated, contribution))[0];
    let t = 2.0 * overlap + (accumulated[3] + (contribution[3] - 1.0));
    let [x, y, z] = std::array::from_fn(|c| accumulated[c] + contribution[c]);
    [x, y, z, t.max(0.0)]
}

/// Combines occluders as halfway between independent and united cones: the mean of both
/// transmittances, of everything so far and one more occluder.
pub fn aogrid_mean(
    accumulated: [f32; 4],
    contribution: [f32; 4],
    overlaps: &CpuTexture,
) -> [f32; 4] {
    let [x, y, z, merged] = aogrid_merge(accumulated, contribution, overlaps);
    [x, y, z, 0.5 * (accumulated[3] * contribution[3] + merged)]
}

/// The texture coordinates in T_merge. Without an axis, γ is a right angle.
pub fn aogrid_merge_coordinate(accumulated: [f32; 4], contribution: [f32; 4]) -> [f32; 3] {
    let [d1, d2] = [accumulated, contribution].map(|[x, y, z, _]| [x, y, z]);
    let cos_gamma = aogrid_cos_beta(d1, d2) * aogrid_inverse_length(d2);
    let gamma = cos_gamma.clamp(-1.0, 1.0).acos();
    [
        accumulated[3] * AOGRID_MERGE_FRACTION_SCALE + AOGRID_MERGE_FRACTION_OFFSET,
        contribution[3] * AOGRID_MERGE_FRACTION_SCALE + AOGRID_MERGE_FRACTION_OFFSET,
        gamma * AOGRID_MERGE_ANGLE_SCALE + AOGRID_MERGE_ANGLE_OFFSET,
    ]
}

// ---- Occluders in tiles ------------------------------------------------------------------------

/// A look-up with its position in the atlas. It stays between the centers of the grid's outer
/// cells, so that linear filtering never reaches a neighboring grid.
pub fn aogrid_atlas_lookup(occluder: &AogridAtlasOccluder, lookup: AogridLookup) -> AogridLookup {
    let position = std::array::from_fn(|x| {
        let half_cell = occluder.half_cell[x];
        let own = lookup.position[x].clamp(half_cell, 1.0 - half_cell);
        own * occluder.atlas_scale[x] + occluder.atlas_offset[x]
    });
    AogridLookup { position, ..lookup }
}

/// The index of the first word of a list of the tile that contains a pixel. `list`:
/// [`AOGRID_LIST_OPAQUE`](crate::AOGRID_LIST_OPAQUE) or
/// [`AOGRID_LIST_ALL_DEPTHS`](crate::AOGRID_LIST_ALL_DEPTHS). A list has `tiles.words` words, one
/// bit per occluder.
pub fn aogrid_first_word(tiles: &AogridTiles, pixel: [u32; 2], list: u32) -> u32 {
    let tile = pixel.map(|x| x / AOGRID_TILE);
    let tiles_per_row = tiles.size[0].div_ceil(AOGRID_TILE);
    ((tile[1] * tiles_per_row + tile[0]) * 2 + list) * tiles.words
}

/// The index of the first occluder in word `word` of a list; continue with bits & (bits − 1) until
/// that is 0.
pub fn aogrid_listed_occluder(word: u32, bits: u32) -> u32 {
    32 * word + bits.trailing_zeros()
}

// ---- Positions from depth ----------------------------------------------------------------------

/// The world position of a pixel: `ndc` x and y in −1..1, y up, and the depth buffer's value.
/// `world_from_clip` is given in columns.
pub fn aogrid_world_position(
    world_from_clip: [[f32; 4]; 4],
    ndc: [f32; 2],
    depth: f32,
) -> [f32; 3] {
    let clip = [ndc[0], ndc[1], depth, 1.0];
    let p: [f32; 4] = std::array::from_fn(|row| {
        (0..4)
            .map(|col| world_from_clip[col][row] * clip[col])
            .sum()
    });
    [p[0] / p[3], p[1] / p[3], p[2] / p[3]]
}
