// aogrid: shading with baked ambient-occlusion grids.
//
// Generated from WGSL by naga: do not edit. For GLSL ES 3.00 and GLSL 3.30
// or later: write `#version` and, for ES, `precision highp float; precision highp int;` before it.

#ifndef AOGRID_GLSL
#define AOGRID_GLSL

// One occluder, in a uniform or storage buffer: 208 bytes. Rust: `AogridOccluder::new`.
struct AogridOccluder {
    vec4 grid_x;
    vec4 grid_y;
    vec4 grid_z;
    vec4 axis_x;
    vec4 axis_y;
    vec4 axis_z;
    uvec4 excluded;
    uint object_id;
    uint layers;
    float strength;
    float min_axis_length;
    vec3 per_hull;
    float fade_scale;
    vec3 per_reach;
    float min_factor;
    vec3 center;
    vec3 per_step;
    vec4 flatness;
};

// The place at which a receiver looks up a grid, see `aogrid_lookup`.
struct AogridLookup {
    vec3 position;
    bool is_reached;
    vec3 outward;
    float distance_;
    float remainder;
    float flatness;
};

// A cone of directions that covers a fraction of the sphere, and of which a uniform share, the
// density, is occluded.
struct AogridCone {
    vec3 axis;
    float fraction;
    float density;
};

// An occluder whose grid is a region of an atlas, in a storage buffer: 272 bytes. Rust:
// `AogridAtlasOccluder`.
struct AogridAtlasOccluder {
    AogridOccluder occluder;
    vec4 half_cell;
    vec4 atlas_scale;
    vec4 atlas_offset;
    vec4 pixels;
};

// The size of the target and of the lists of the tiled pass, in a uniform: 16 bytes.
struct AogridTiles {
    uvec2 size;
    uint words;
    uint occluders;
};
const uint AOGRID_NO_OBJECT = 4294967295u;
const uint AOGRID_TILE = 16u;
const uint AOGRID_TILE_WORDS = 128u;
const uint AOGRID_LIST_OPAQUE = 0u;
const uint AOGRID_LIST_ALL_DEPTHS = 1u;
const uint AOGRID_WEIGHT_NONE = 0u;
const uint AOGRID_WEIGHT_LINEAR = 1u;
const uint AOGRID_WEIGHT_EDGES = 2u;

// Whether the occluder shades a receiver with this id and these layers.
bool aogrid_shades(AogridOccluder occluder, uint object_id, uint layers) {
    bool local = false;
    if (((occluder.layers & layers) != 0u)) {
        local = all(notEqual(occluder.excluded, uvec4(object_id)));
    } else {
        local = false;
    }
    bool _e1 = local;
    return _e1;
}

// Whether a receiver with this id belongs to the occluder.
bool aogrid_is_on_itself(AogridOccluder occluder, uint object_id) {
    bool local = false;
    if ((object_id == occluder.object_id)) {
        local = (object_id != AOGRID_NO_OBJECT);
    } else {
        local = false;
    }
    bool _e1 = local;
    return _e1;
}

// Applies a row of an affine map to a point: three fused multiply-adds.
float aogrid_row(vec4 row, vec3 v) {
    return (row.x * v.x + (row.y * v.y + (row.z * v.z + row.w)));
}

// The position of a world-space point in the grid's box, [0,1]^3.
vec3 aogrid_grid_position(AogridOccluder occluder, vec3 position) {
    float _e1 = aogrid_row(occluder.grid_x, position);
    float _e2 = aogrid_row(occluder.grid_y, position);
    float _e3 = aogrid_row(occluder.grid_z, position);
    return vec3(_e1, _e2, _e3);
}

// The place at which a receiver at a world-space position looks up the grid; not reached for NaN.
// In the far field it is on the hull of the outer cells' centers, on the ray from the box's center.
AogridLookup aogrid_lookup(AogridOccluder occluder, vec3 position) {
    vec3 _e1 = aogrid_grid_position(occluder, position);
    vec3 off_center = (_e1 - vec3(0.5));
    vec3 scaled = (abs(off_center) * occluder.per_hull);
    float distance_ = max(max(scaled.x, scaled.y), max(scaled.z, 1.0));
    float per_distance = (1.0 / distance_);
    vec3 at = (off_center * vec3(per_distance) + vec3(0.5));
    vec3 of_reach = (abs(off_center) * occluder.per_reach);
    float share = max(max(of_reach.x, of_reach.y), of_reach.z);
    float fade = clamp((share * occluder.fade_scale + -3.0), 0.0, 1.0);
    float square = (per_distance * per_distance);
    float remainder = (((fade * fade) * (2.0 * fade + -3.0) + 1.0) * square);
    float flatness = (dot((scaled * scaled), occluder.flatness.xyz) * square + occluder.flatness.w);
    vec3 outward = (position - occluder.center);
    return AogridLookup(at, (share <= 1.0), outward, distance_, remainder, flatness);
}

// `aogrid_lookup` for a receiver that belongs to the occluder itself. Cells inside the object are
// filled from outside; a fraction of a cell along the unit normal they weigh little.
AogridLookup aogrid_lookup_on_itself(AogridOccluder occluder, vec3 position, vec3 normal) {
    vec3 steps = (occluder.per_step * vec3(dot(occluder.grid_x.xyz, normal), dot(occluder.grid_y.xyz, normal), dot(occluder.grid_z.xyz, normal)));
    float distance_ = inversesqrt(max(dot(steps, steps), 1e-30));
    AogridLookup _e1 = aogrid_lookup(occluder, (normal * vec3(distance_) + position));
    return _e1;
}

// The fraction that an object occludes farther away, which occludes the fraction `a` at the hull. A
// sphere's squared sine of alpha, k, falls with the distance squared, a disc's squared tangent does:
// 1/k is the flatness and a multiple of the distance squared. The part of a fraction beyond one half
// falls with the remainder.
float aogrid_distant_fraction(float a, AogridLookup lookup) {
    float in_front = clamp((-2.0 * a + 1.0), 0.0, 1.0);
    float behind = clamp((2.0 * a + -1.0), 0.0, 1.0);
    float at_hull = (-(in_front) * in_front + 1.0);
    float flat_ = min((lookup.flatness * at_hull), 0.97);
    float k = ((at_hull * lookup.remainder) / (lookup.remainder * flat_ + (1.0 - flat_)));
    return (-0.5 * (-(behind) * lookup.remainder + sqrt(clamp((1.0 - k), 0.0, 1.0))) + 0.5);
}

// 1 / |axis|, bounded for axes below the length that counts as no axis.
float aogrid_inverse_length(vec3 axis) {
    float square = (axis.x * axis.x + (axis.y * axis.y + (axis.z * axis.z)));
    return inversesqrt(max(square, 1e-8));
}

// The unit axis towards what a unit axis at the hull points to, from where the look-up is.
vec3 aogrid_distant_axis(vec3 axis, AogridLookup lookup) {
    float scale = ((1.0 - lookup.distance_) * inversesqrt(dot(lookup.outward, lookup.outward)));
    vec3 towards = (lookup.outward * vec3(scale) + axis);
    float _e1 = aogrid_inverse_length(towards);
    return (towards * _e1);
}

// The cone's axis in world space, not normalized, from a texel's rgb.
vec3 aogrid_axis(AogridOccluder occluder, vec3 rgb) {
    float _e1 = aogrid_row(occluder.axis_x, rgb);
    float _e2 = aogrid_row(occluder.axis_y, rgb);
    float _e3 = aogrid_row(occluder.axis_z, rgb);
    return vec3(_e1, _e2, _e3);
}

// The occluded fraction of the sphere from a texel's alpha at a look-up.
float aogrid_fraction(AogridOccluder occluder, float alpha, AogridLookup lookup) {
    float a = (alpha * max(alpha, occluder.min_factor));
    if ((lookup.distance_ > 1.0)) {
        float _e1 = aogrid_distant_fraction(a, lookup);
        return _e1;
    }
    return a;
}

// The cone of a grid's texel at a look-up. The axis of interpolated cells is shorter than 1 where theirs
// disagree: the cone then widens and thins so that it keeps both moments of the occluded
// directions, their fraction and their mean.
AogridCone aogrid_cone_of(AogridOccluder occluder, vec4 texel, AogridLookup lookup) {
    vec3 axis = vec3(0.0);
    vec3 _e1 = aogrid_axis(occluder, texel.xyz);
    float _e2 = aogrid_inverse_length(_e1);
    float length_ = clamp((dot(_e1, _e1) * _e2), occluder.min_axis_length, 1.0);
    axis = (_e1 * _e2);
    if ((lookup.distance_ > 1.0)) {
        vec3 _e3 = axis;
        vec3 _e4 = aogrid_distant_axis(_e3, lookup);
        axis = _e4;
    }
    float _e5 = aogrid_fraction(occluder, texel.w, lookup);
    float widened = ((_e5 - 1.0) * length_ + 1.0);
    vec3 _e6 = axis;
    return AogridCone(_e6, widened, (_e5 / max(widened, 1e-6)));
}

// The texture coordinates in T_clip of a cone of fraction `a` with its axis at `cos_beta`.
vec2 aogrid_clip_coordinate(float a, float cos_beta) {
    return vec2((a * 0.984375 + 0.0078125), (cos_beta * 0.4921875 + 0.5));
}

// 1 - AO of a clipped cone, from T_clip as transmittance (one channel).
float aogrid_clip_transmittance(highp sampler2D table, float a, float cos_beta) {
    vec2 _e1 = aogrid_clip_coordinate(a, cos_beta);
    vec4 _e2 = textureLod(table, vec2(_e1), 0.0);
    return _e2.x;
}

// The transmittance of a cone grid at a look-up within reach.
float aogrid_cone_at(AogridOccluder occluder, highp sampler3D grid, highp sampler2D table, AogridLookup lookup, vec3 normal) {
    vec4 texel = textureLod(grid, vec3(lookup.position), 0.0);
    AogridCone _e1 = aogrid_cone_of(occluder, texel, lookup);
    float _e2 = aogrid_clip_transmittance(table, _e1.fraction, dot(_e1.axis, normal));
    return ((_e1.density * occluder.strength) * (_e2 - 1.0) + 1.0);
}

// The transmittance of a cone grid at a receiver in world space; 1 beyond the occluder's reach: its
// far field, or without one its grid's box. `normal` is the receiver's unit normal, `table` T_clip
// as transmittance (RR-5779, 5.1). The receiver belongs to another object.
float aogrid_cone(AogridOccluder occluder, highp sampler3D grid, highp sampler2D table, vec3 position, vec3 normal) {
    AogridLookup _e1 = aogrid_lookup(occluder, position);
    float _e2 = aogrid_cone_at(occluder, grid, table, _e1, normal);
    return (_e1.is_reached ? _e2 : 1.0);
}

// `aogrid_cone` for a receiver that belongs to the occluder itself.
float aogrid_cone_on_itself(AogridOccluder occluder, highp sampler3D grid, highp sampler2D table, vec3 position, vec3 normal) {
    AogridLookup _e1 = aogrid_lookup_on_itself(occluder, position, normal);
    float _e2 = aogrid_cone_at(occluder, grid, table, _e1, normal);
    return (_e1.is_reached ? _e2 : 1.0);
}

// AO, the fraction a' and the axis weight f of a clipped cone, from T_clip with all channels.
vec3 aogrid_clip(highp sampler2D table, float a, float cos_beta) {
    vec2 _e1 = aogrid_clip_coordinate(a, cos_beta);
    vec4 _e2 = textureLod(table, vec2(_e1), 0.0);
    return _e2.xyz;
}

// The unit axis of a clipped cone with unit axis d, f d + (1 - f) n; zero if that sum is zero
// (RR-5779, 5.2.2).
vec3 aogrid_clipped_axis(vec3 axis, vec3 normal, float axis_weight) {
    vec3 sum = mix(normal, axis, axis_weight);
    float _e1 = aogrid_inverse_length(sum);
    return (sum * _e1);
}

// The contribution of one occluder where axes are accumulated: (AO/2) d' and 1 - AO, the strength
// included, from T_clip with all channels (RR-5779, 5.2.1). The product of all w is the
// transmittance; the normalized sum of all xyz is the axis of the occluded directions.
vec4 aogrid_cone_with_axis_at(AogridOccluder occluder, highp sampler3D grid, highp sampler2D table, AogridLookup lookup, vec3 normal) {
    vec4 texel = textureLod(grid, vec3(lookup.position), 0.0);
    AogridCone _e1 = aogrid_cone_of(occluder, texel, lookup);
    vec3 _e2 = aogrid_clip(table, _e1.fraction, dot(_e1.axis, normal));
    float occlusion = ((_e2.x * _e1.density) * occluder.strength);
    vec3 _e3 = aogrid_clipped_axis(_e1.axis, normal, _e2.z);
    return vec4(((0.5 * occlusion) * _e3), (1.0 - occlusion));
}

// The cosine of the angle between an axis of any length and a unit normal; 0 without an axis.
float aogrid_cos_beta(vec3 axis, vec3 normal) {
    float along = (axis.x * normal.x + (axis.y * normal.y + (axis.z * normal.z)));
    float _e1 = aogrid_inverse_length(axis);
    return (along * _e1);
}

// The texture coordinates in T_merge. Without an axis, gamma is a right angle.
vec3 aogrid_merge_coordinate(vec4 accumulated, vec4 contribution) {
    float _e1 = aogrid_cos_beta(accumulated.xyz, contribution.xyz);
    float _e2 = aogrid_inverse_length(contribution.xyz);
    float cos_gamma = (_e1 * _e2);
    float gamma = acos(clamp(cos_gamma, -1.0, 1.0));
    return vec3((accumulated.w * -0.48958334 + 0.5), (contribution.w * -0.48958334 + 0.5), (gamma * 0.3083627 + 0.015625));
}

// Combines occluders as cones around their axes: AO = 2 T_merge(AO1/2, AO2/2, gamma), which is AO1
// + AO2 less twice the fraction that both cones cover, from `overlaps` (RR-5779, 5.2.2; JGT
// supplement).
vec4 aogrid_merge(vec4 accumulated, vec4 contribution, highp sampler3D overlaps) {
    vec3 _e1 = aogrid_merge_coordinate(accumulated, contribution);
    vec4 _e2 = textureLod(overlaps, vec3(_e1), 0.0);
    float overlap = _e2.x;
    float t = (2.0 * overlap + (accumulated.w + (contribution.w - 1.0)));
    return vec4((accumulated.xyz + contribution.xyz), max(t, 0.0));
}

// Merges a cone grid into `accumulated` (RR-5779, 5.2.2), for objects that overlap as seen from
// the receiver. Start with vec4f(0, 0, 0, 1); the last w is the transmittance. The result depends
// on the order of three or more occluders: keep it fixed. `clip` is T_clip with all channels,
// `overlaps` the overlap table of T_merge.
vec4 aogrid_merge_cone(vec4 accumulated, AogridOccluder occluder, highp sampler3D grid, highp sampler2D clip, highp sampler3D overlaps, vec3 position, vec3 normal) {
    AogridLookup _e1 = aogrid_lookup(occluder, position);
    if (!(_e1.is_reached)) {
        return accumulated;
    }
    vec4 _e2 = aogrid_cone_with_axis_at(occluder, grid, clip, _e1, normal);
    vec4 _e3 = aogrid_merge(accumulated, _e2, overlaps);
    return _e3;
}

// `aogrid_cone` without the box test, for a grid whose outer cells are all open, as after either
// boundary treatment: the clamped sampler extends the open cells beyond the box. There is no far
// field then.
float aogrid_cone_faded(AogridOccluder occluder, highp sampler3D grid, highp sampler2D table, vec3 position, vec3 normal) {
    vec3 _e1 = aogrid_grid_position(occluder, position);
    AogridLookup lookup = AogridLookup(_e1, true, vec3(0.0), 1.0, 1.0, 0.0);
    float _e2 = aogrid_cone_at(occluder, grid, table, lookup, normal);
    return _e2;
}

// 1 - AO from the occlusion fraction alone: AO = 2a on other surfaces, and 2a - 1 on the
// occluder's own, which blocks half of all directions itself (RR-5779, 4.2, which prints half of
// that).
float aogrid_occlusion_transmittance(float a, bool on_itself) {
    return clamp((-2.0 * a + (on_itself ? 2.0 : 1.0)), 0.0, 1.0);
}

// Applies the occluder's strength to a transmittance: 1 - strength * AO.
float aogrid_strengthen(AogridOccluder occluder, float transmittance) {
    return ((transmittance - 1.0) * occluder.strength + 1.0);
}

// The transmittance of an occlusion-only grid, independent of the receiver's normal (RR-5779, 4);
// 1 beyond the occluder's reach. `on_itself`: the receiver belongs to the occluder.
float aogrid_occlusion(AogridOccluder occluder, highp sampler3D grid, vec3 position, bool on_itself) {
    AogridLookup _e1 = aogrid_lookup(occluder, position);
    vec4 _e2 = textureLod(grid, vec3(_e1.position), 0.0);
    float stored = _e2.x;
    float _e3 = aogrid_fraction(occluder, stored, _e1);
    float _e4 = aogrid_occlusion_transmittance(_e3, on_itself);
    float _e5 = aogrid_strengthen(occluder, _e4);
    return (_e1.is_reached ? _e5 : 1.0);
}

// `aogrid_occlusion` for a grid that holds cones.
float aogrid_occlusion_of_cone(AogridOccluder occluder, highp sampler3D grid, vec3 position, bool on_itself) {
    AogridLookup _e1 = aogrid_lookup(occluder, position);
    vec4 _e2 = textureLod(grid, vec3(_e1.position), 0.0);
    float stored = _e2.w;
    float _e3 = aogrid_fraction(occluder, stored, _e1);
    float _e4 = aogrid_occlusion_transmittance(_e3, on_itself);
    float _e5 = aogrid_strengthen(occluder, _e4);
    return (_e1.is_reached ? _e5 : 1.0);
}

// 1 - AO of a clipped cone in closed form, an alternative to the table: no fetch, two arc
// tangents. The derivation is that of `aogrid_tables::clip`, with sin t0 cos t0 and sin phi0 cos
// phi0 written out, so that AO = (p cos beta + q)/pi needs no quotient.
float aogrid_clip_transmittance_closed_form(float a, float cos_beta) {
    float cos_alpha = (-2.0 * a + 1.0);
    float sin_alpha_squared = ((4.0 * a) * (1.0 - a));
    float root = sqrt(max((-(cos_beta) * cos_beta + sin_alpha_squared), 1e-12));
    float half_rim = atan(root, (-(cos_alpha) * cos_beta));
    float half_horizon = atan(root, cos_alpha);
    float occlusion = ((sin_alpha_squared * cos_beta) * half_rim + (half_horizon - (root * cos_alpha)));
    return (1.0 - clamp((occlusion / 3.1415927), 0.0, 1.0));
}

// Combines occluders as statistically independent: transmittances are multiplied (RR-5779, 5.2.1).
vec4 aogrid_multiply(vec4 accumulated, vec4 contribution) {
    return vec4((accumulated.xyz + contribution.xyz), (accumulated.w * contribution.w));
}

// Combines occluders as halfway between independent and united cones: the mean of both
// transmittances, of everything so far and one more occluder.
vec4 aogrid_mean(vec4 accumulated, vec4 contribution, highp sampler3D overlaps) {
    vec4 _e1 = aogrid_merge(accumulated, contribution, overlaps);
    return vec4(_e1.xyz, (0.5 * (accumulated.w * contribution.w + _e1.w)));
}

// A look-up with its position in the atlas. It stays between the centers of the grid's outer
// cells, so that linear filtering never reaches a neighboring grid.
AogridLookup aogrid_atlas_lookup(AogridAtlasOccluder occluder, AogridLookup lookup) {
    AogridLookup of_atlas = AogridLookup(vec3(0.0), false, vec3(0.0), 0.0, 0.0, 0.0);
    vec3 half_cell = occluder.half_cell.xyz;
    vec3 own = clamp(lookup.position, half_cell, (vec3(1.0) - half_cell));
    vec3 position = (own * occluder.atlas_scale.xyz + occluder.atlas_offset.xyz);
    of_atlas = lookup;
    of_atlas.position = position;
    AogridLookup _e1 = of_atlas;
    return _e1;
}

// The index of the first word of a list of the tile that contains a pixel. `list`:
// AOGRID_LIST_OPAQUE or AOGRID_LIST_ALL_DEPTHS. A list has `tiles.words` words, one bit per
// occluder.
uint aogrid_first_word(AogridTiles tiles, uvec2 pixel, uint list) {
    uvec2 tile = (pixel / uvec2(16u));
    uint tiles_per_row = (((tiles.size.x + AOGRID_TILE) - 1u) / AOGRID_TILE);
    return (((((tile.y * tiles_per_row) + tile.x) * 2u) + list) * tiles.words);
}

#if (defined(GL_ES) && __VERSION__ >= 310) || __VERSION__ >= 400
// The index of the first occluder in word `word` of a list; continue with bits & (bits - 1) until
// that is 0.
uint aogrid_listed_occluder(uint word, uint bits) {
    return ((32u * word) + uint(findLSB(bits)));
}
#endif

// The world position of a pixel: `ndc` x and y in -1..1, y up, and the depth buffer's value.
vec3 aogrid_world_position(mat4x4 world_from_clip, vec2 ndc, float depth) {
    vec4 p = (world_from_clip * vec4(ndc, depth, 1.0));
    return (p.xyz / vec3(p.w));
}

#endif
