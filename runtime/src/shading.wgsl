// aogrid: shading with baked ambient-occlusion grids (Malmer et al., INRIA RR-5779).
//
// Pure functions, all named aogrid_*: no bindings, no entry points, no directives. Paste this
// file behind the constants and `lookup.wgsl`, or import it, and call one of
//
//     aogrid_cone, aogrid_cone_faded, aogrid_occlusion, aogrid_occlusion_of_cone
//
// per occluder. Each returns a transmittance, 1 - AO: multiply them together, and multiply ambient
// light, and only ambient light, by the product. Or merge cones with aogrid_merge_cone. Textures
// are sampled with a linear, clamped sampler. The CPU twin, `shading.rs`, has the same functions
// under the same names.

/// A cone of directions that covers a fraction of the sphere, and of which a uniform share, the
/// density, is occluded.
struct AogridCone {
    /// The unit axis in world space, towards the occluder; zero without an axis.
    axis: vec3f,
    fraction: f32,
    density: f32,
}

/// An occluder whose grid is a region of an atlas, in a storage buffer: 272 bytes. Rust:
/// `AogridAtlasOccluder`.
struct AogridAtlasOccluder {
    occluder: AogridOccluder,
    /// Half a cell, in [0,1]^3 of the grid's box; w is unused, here and below.
    half_cell: vec4f,
    /// Atlas coordinates are scale * position + offset.
    atlas_scale: vec4f,
    atlas_offset: vec4f,
    /// The pixels that its reach covers: minimum x and y, maximum x and y.
    pixels: vec4f,
}

/// The size of the target and of the lists of the tiled pass, in a uniform: 16 bytes.
struct AogridTiles {
    /// The target's size in pixels.
    size: vec2u,
    /// The number of words in a list, with one bit for each of 32 occluders.
    words: u32,
    occluders: u32,
}

// ---- One call per occluder --------------------------------------------------------------------

/// The transmittance of a cone grid at a receiver in world space; 1 beyond the occluder's reach: its
/// far field, or without one its grid's box. `normal` is the receiver's unit normal, `table` T_clip
/// as transmittance (RR-5779, 5.1). The receiver belongs to another object.
fn aogrid_cone(occluder: AogridOccluder, grid: texture_3d<f32>, table: texture_2d<f32>,
               linear_clamp: sampler, position: vec3f, normal: vec3f) -> f32 {
    let lookup = aogrid_lookup(occluder, position);
    let t = aogrid_cone_at(occluder, grid, table, linear_clamp, lookup, normal);
    return select(1.0, t, lookup.is_reached);
}

/// `aogrid_cone` for a receiver that belongs to the occluder itself.
fn aogrid_cone_on_itself(occluder: AogridOccluder, grid: texture_3d<f32>, table: texture_2d<f32>,
                         linear_clamp: sampler, position: vec3f, normal: vec3f) -> f32 {
    let lookup = aogrid_lookup_on_itself(occluder, position, normal);
    let t = aogrid_cone_at(occluder, grid, table, linear_clamp, lookup, normal);
    return select(1.0, t, lookup.is_reached);
}

/// Merges a cone grid into `accumulated` (RR-5779, 5.2.2), for objects that overlap as seen from
/// the receiver. Start with vec4f(0, 0, 0, 1); the last w is the transmittance. The result depends
/// on the order of three or more occluders: keep it fixed. `clip` is T_clip with all channels,
/// `overlaps` the overlap table of T_merge.
fn aogrid_merge_cone(accumulated: vec4f, occluder: AogridOccluder, grid: texture_3d<f32>,
                     clip: texture_2d<f32>, overlaps: texture_3d<f32>, linear_clamp: sampler,
                     position: vec3f, normal: vec3f) -> vec4f {
    let lookup = aogrid_lookup(occluder, position);
    if !lookup.is_reached {
        return accumulated;
    }
    let contribution = aogrid_cone_with_axis_at(occluder, grid, clip, linear_clamp, lookup, normal);
    return aogrid_merge(accumulated, contribution, overlaps, linear_clamp);
}

/// `aogrid_cone` without the box test, for a grid whose outer cells are all open, as after either
/// boundary treatment: the clamped sampler extends the open cells beyond the box. There is no far
/// field then.
fn aogrid_cone_faded(occluder: AogridOccluder, grid: texture_3d<f32>, table: texture_2d<f32>,
                     linear_clamp: sampler, position: vec3f, normal: vec3f) -> f32 {
    let p_grid = aogrid_grid_position(occluder, position);
    let lookup = AogridLookup(p_grid, true, vec3f(), 1.0, 1.0, 0.0);
    return aogrid_cone_at(occluder, grid, table, linear_clamp, lookup, normal);
}

/// The transmittance of an occlusion-only grid, independent of the receiver's normal (RR-5779, 4);
/// 1 beyond the occluder's reach. `on_itself`: the receiver belongs to the occluder.
fn aogrid_occlusion(occluder: AogridOccluder, grid: texture_3d<f32>, linear_clamp: sampler,
                    position: vec3f, on_itself: bool) -> f32 {
    let lookup = aogrid_lookup(occluder, position);
    let stored = textureSampleLevel(grid, linear_clamp, lookup.position, 0.0).r;
    let t = aogrid_occlusion_transmittance(aogrid_fraction(occluder, stored, lookup), on_itself);
    return select(1.0, aogrid_strengthen(occluder, t), lookup.is_reached);
}

/// `aogrid_occlusion` for a grid that holds cones.
fn aogrid_occlusion_of_cone(occluder: AogridOccluder, grid: texture_3d<f32>,
                            linear_clamp: sampler, position: vec3f, on_itself: bool) -> f32 {
    let lookup = aogrid_lookup(occluder, position);
    let stored = textureSampleLevel(grid, linear_clamp, lookup.position, 0.0).a;
    let t = aogrid_occlusion_transmittance(aogrid_fraction(occluder, stored, lookup), on_itself);
    return select(1.0, aogrid_strengthen(occluder, t), lookup.is_reached);
}

// ---- Building blocks ---------------------------------------------------------------------------

/// The transmittance of a cone grid at a look-up within reach.
fn aogrid_cone_at(occluder: AogridOccluder, grid: texture_3d<f32>, table: texture_2d<f32>,
                  linear_clamp: sampler, lookup: AogridLookup, normal: vec3f) -> f32 {
    let texel = textureSampleLevel(grid, linear_clamp, lookup.position, 0.0);
    let cone = aogrid_cone_of(occluder, texel, lookup);
    let t = aogrid_clip_transmittance(table, linear_clamp, cone.fraction, dot(cone.axis, normal));
    return fma(cone.density * occluder.strength, t - 1.0, 1.0);
}

/// The cone of a grid's texel at a look-up. The axis of interpolated cells is shorter than 1 where theirs
/// disagree: the cone then widens and thins so that it keeps both moments of the occluded
/// directions, their fraction and their mean.
fn aogrid_cone_of(occluder: AogridOccluder, texel: vec4f, lookup: AogridLookup) -> AogridCone {
    let stored = aogrid_axis(occluder, texel.rgb);
    let per_length = aogrid_inverse_length(stored);
    let length = clamp(dot(stored, stored) * per_length, occluder.min_axis_length, 1.0);
    var axis = stored * per_length;
    if lookup.distance > 1.0 {
        axis = aogrid_distant_axis(axis, lookup);
    }
    let a = aogrid_fraction(occluder, texel.a, lookup);
    let widened = fma(a - 1.0, length, 1.0);
    return AogridCone(axis, widened, a / max(widened, AOGRID_FRACTION_EPSILON));
}

/// The occluded fraction of the sphere from a texel's alpha at a look-up.
fn aogrid_fraction(occluder: AogridOccluder, alpha: f32, lookup: AogridLookup) -> f32 {
    let a = alpha * max(alpha, occluder.min_factor);
    if lookup.distance > 1.0 {
        return aogrid_distant_fraction(a, lookup);
    }
    return a;
}

/// The cone's axis in world space, not normalized, from a texel's rgb.
fn aogrid_axis(occluder: AogridOccluder, rgb: vec3f) -> vec3f {
    return vec3f(
        aogrid_row(occluder.axis_x, rgb),
        aogrid_row(occluder.axis_y, rgb),
        aogrid_row(occluder.axis_z, rgb),
    );
}

/// The cosine of the angle between an axis of any length and a unit normal; 0 without an axis.
fn aogrid_cos_beta(axis: vec3f, normal: vec3f) -> f32 {
    let along = fma(axis.x, normal.x, fma(axis.y, normal.y, axis.z * normal.z));
    return along * aogrid_inverse_length(axis);
}

/// 1 - AO from the occlusion fraction alone: AO = 2a on other surfaces, and 2a - 1 on the
/// occluder's own, which blocks half of all directions itself (RR-5779, 4.2, which prints half of
/// that).
fn aogrid_occlusion_transmittance(a: f32, on_itself: bool) -> f32 {
    return saturate(fma(-2.0, a, select(1.0, 2.0, on_itself)));
}

/// The texture coordinates in T_clip of a cone of fraction `a` with its axis at `cos_beta`.
fn aogrid_clip_coordinate(a: f32, cos_beta: f32) -> vec2f {
    return vec2f(
        fma(a, AOGRID_CLIP_FRACTION_SCALE, AOGRID_CLIP_FRACTION_OFFSET),
        fma(cos_beta, AOGRID_CLIP_COS_SCALE, AOGRID_CLIP_COS_OFFSET),
    );
}

/// 1 - AO of a clipped cone, from T_clip as transmittance (one channel).
fn aogrid_clip_transmittance(table: texture_2d<f32>, linear_clamp: sampler, a: f32,
                             cos_beta: f32) -> f32 {
    return textureSampleLevel(table, linear_clamp, aogrid_clip_coordinate(a, cos_beta), 0.0).r;
}

/// 1 - AO of a clipped cone in closed form, an alternative to the table: no fetch, two arc
/// tangents. The derivation is that of `aogrid_tables::clip`, with sin t0 cos t0 and sin phi0 cos
/// phi0 written out, so that AO = (p cos beta + q)/pi needs no quotient.
fn aogrid_clip_transmittance_closed_form(a: f32, cos_beta: f32) -> f32 {
    let cos_alpha = fma(-2.0, a, 1.0);
    let sin_alpha_squared = 4.0 * a * (1.0 - a);
    // Zero where the tangent plane touches the rim of the cone: bounded for the arc tangents.
    let root = sqrt(max(fma(-cos_beta, cos_beta, sin_alpha_squared), AOGRID_RIM_EPSILON));
    let half_rim = atan2(root, -cos_alpha * cos_beta);
    let half_horizon = atan2(root, cos_alpha);
    let occlusion = fma(sin_alpha_squared * cos_beta, half_rim, half_horizon - root * cos_alpha);
    return 1.0 - saturate(occlusion / AOGRID_PI);
}

/// AO, the fraction a' and the axis weight f of a clipped cone, from T_clip with all channels.
fn aogrid_clip(table: texture_2d<f32>, linear_clamp: sampler, a: f32, cos_beta: f32) -> vec3f {
    return textureSampleLevel(table, linear_clamp, aogrid_clip_coordinate(a, cos_beta), 0.0).rgb;
}

/// The unit axis of a clipped cone with unit axis d, f d + (1 - f) n; zero if that sum is zero
/// (RR-5779, 5.2.2).
fn aogrid_clipped_axis(axis: vec3f, normal: vec3f, axis_weight: f32) -> vec3f {
    let sum = mix(normal, axis, axis_weight);
    return sum * aogrid_inverse_length(sum);
}

/// The contribution of one occluder where axes are accumulated: (AO/2) d' and 1 - AO, the strength
/// included, from T_clip with all channels (RR-5779, 5.2.1). The product of all w is the
/// transmittance; the normalized sum of all xyz is the axis of the occluded directions.
fn aogrid_cone_with_axis_at(occluder: AogridOccluder, grid: texture_3d<f32>,
                            table: texture_2d<f32>, linear_clamp: sampler,
                            lookup: AogridLookup, normal: vec3f) -> vec4f {
    let texel = textureSampleLevel(grid, linear_clamp, lookup.position, 0.0);
    let cone = aogrid_cone_of(occluder, texel, lookup);
    let clipped = aogrid_clip(table, linear_clamp, cone.fraction, dot(cone.axis, normal));
    let occlusion = clipped.x * cone.density * occluder.strength;
    let towards = aogrid_clipped_axis(cone.axis, normal, clipped.z);
    return vec4f(0.5 * occlusion * towards, 1.0 - occlusion);
}

/// Applies the occluder's strength to a transmittance: 1 - strength * AO.
fn aogrid_strengthen(occluder: AogridOccluder, transmittance: f32) -> f32 {
    return fma(transmittance - 1.0, occluder.strength, 1.0);
}

// ---- Several occluders --------------------------------------------------------------------------
//
// The accumulated occluders, and the contribution of each, are a vec4f: the transmittance 1 - AO in
// w, the sum of all (AO/2) d' in xyz. No occlusion is vec4f(0, 0, 0, 1).

/// Combines occluders as statistically independent: transmittances are multiplied (RR-5779, 5.2.1).
fn aogrid_multiply(accumulated: vec4f, contribution: vec4f) -> vec4f {
    return vec4f(accumulated.xyz + contribution.xyz, accumulated.w * contribution.w);
}

/// Combines occluders as cones around their axes: AO = 2 T_merge(AO1/2, AO2/2, gamma), which is AO1
/// + AO2 less twice the fraction that both cones cover, from `overlaps` (RR-5779, 5.2.2; JGT
/// supplement).
fn aogrid_merge(accumulated: vec4f, contribution: vec4f, overlaps: texture_3d<f32>,
                linear_clamp: sampler) -> vec4f {
    let coordinate = aogrid_merge_coordinate(accumulated, contribution);
    let overlap = textureSampleLevel(overlaps, linear_clamp, coordinate, 0.0).r;
    let t = fma(2.0, overlap, accumulated.w + (contribution.w - 1.0));
    return vec4f(accumulated.xyz + contribution.xyz, max(t, 0.0));
}

/// Combines occluders as halfway between independent and united cones: the mean of both
/// transmittances, of everything so far and one more occluder.
fn aogrid_mean(accumulated: vec4f, contribution: vec4f, overlaps: texture_3d<f32>,
               linear_clamp: sampler) -> vec4f {
    let merged = aogrid_merge(accumulated, contribution, overlaps, linear_clamp);
    return vec4f(merged.xyz, 0.5 * fma(accumulated.w, contribution.w, merged.w));
}

/// The texture coordinates in T_merge. Without an axis, gamma is a right angle.
fn aogrid_merge_coordinate(accumulated: vec4f, contribution: vec4f) -> vec3f {
    let cos_gamma = aogrid_cos_beta(accumulated.xyz, contribution.xyz)
        * aogrid_inverse_length(contribution.xyz);
    let gamma = acos(clamp(cos_gamma, -1.0, 1.0));
    return vec3f(
        fma(accumulated.w, AOGRID_MERGE_FRACTION_SCALE, AOGRID_MERGE_FRACTION_OFFSET),
        fma(contribution.w, AOGRID_MERGE_FRACTION_SCALE, AOGRID_MERGE_FRACTION_OFFSET),
        fma(gamma, AOGRID_MERGE_ANGLE_SCALE, AOGRID_MERGE_ANGLE_OFFSET),
    );
}

// ---- Occluders in tiles ------------------------------------------------------------------------

/// A look-up with its position in the atlas. It stays between the centers of the grid's outer
/// cells, so that linear filtering never reaches a neighboring grid.
fn aogrid_atlas_lookup(occluder: AogridAtlasOccluder, lookup: AogridLookup) -> AogridLookup {
    let half_cell = occluder.half_cell.xyz;
    let own = clamp(lookup.position, half_cell, 1.0 - half_cell);
    let position = fma(own, occluder.atlas_scale.xyz, occluder.atlas_offset.xyz);
    var of_atlas = lookup;
    of_atlas.position = position;
    return of_atlas;
}

/// The index of the first word of a list of the tile that contains a pixel. `list`:
/// AOGRID_LIST_OPAQUE or AOGRID_LIST_ALL_DEPTHS. A list has `tiles.words` words, one bit per
/// occluder.
fn aogrid_first_word(tiles: AogridTiles, pixel: vec2u, list: u32) -> u32 {
    let tile = pixel / AOGRID_TILE;
    let tiles_per_row = (tiles.size.x + AOGRID_TILE - 1u) / AOGRID_TILE;
    return ((tile.y * tiles_per_row + tile.x) * 2u + list) * tiles.words;
}

/// The index of the first occluder in word `word` of a list; continue with bits & (bits - 1) until
/// that is 0.
fn aogrid_listed_occluder(word: u32, bits: u32) -> u32 {
    return 32u * word + firstTrailingBit(bits);
}

// ---- Positions from depth ----------------------------------------------------------------------

/// The world position of a pixel: `ndc` x and y in -1..1, y up, and the depth buffer's value.
fn aogrid_world_position(world_from_clip: mat4x4f, ndc: vec2f, depth: f32) -> vec3f {
    let p = world_from_clip * vec4f(ndc, depth, 1.0);
    return p.xyz / p.w;
}
