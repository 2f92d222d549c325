// aogrid: shading with baked ambient-occlusion grids.
//
// Generated from WGSL by naga: do not edit. For shader model 5.0 or later.

#ifndef AOGRID_HLSL
#define AOGRID_HLSL

// One occluder, in a uniform or storage buffer: 208 bytes. Rust: `AogridOccluder::new`.
struct AogridOccluder {
    float4 grid_x;
    float4 grid_y;
    float4 grid_z;
    float4 axis_x;
    float4 axis_y;
    float4 axis_z;
    uint4 excluded;
    uint object_id;
    uint layers;
    float strength;
    float min_axis_length;
    float3 per_hull;
    float fade_scale;
    float3 per_reach;
    float min_factor;
    float3 center_;
    int _pad16_0;
    float3 per_step;
    int _pad17_0;
    float4 flatness;
};

// The place at which a receiver looks up a grid, see `aogrid_lookup`.
struct AogridLookup {
    float3 position;
    bool is_reached;
    float3 outward;
    float distance_;
    float remainder;
    float flatness;
    int _end_pad_0;
    int _end_pad_1;
};

// A cone of directions that covers a fraction of the sphere, and of which a uniform share, the
// density, is occluded.
struct AogridCone {
    float3 axis;
    float fraction;
    float density;
    int _end_pad_0;
    int _end_pad_1;
    int _end_pad_2;
};

// An occluder whose grid is a region of an atlas, in a storage buffer: 272 bytes. Rust:
// `AogridAtlasOccluder`.
struct AogridAtlasOccluder {
    AogridOccluder occluder;
    float4 half_cell;
    float4 atlas_scale;
    float4 atlas_offset;
    float4 pixels;
};

// The size of the target and of the lists of the tiled pass, in a uniform: 16 bytes.
struct AogridTiles {
    uint2 size;
    uint words;
    uint occluders;
};
static const uint AOGRID_NO_OBJECT = 4294967295u;
static const uint AOGRID_TILE = 16u;
static const uint AOGRID_TILE_WORDS = 128u;
static const uint AOGRID_LIST_OPAQUE = 0u;
static const uint AOGRID_LIST_ALL_DEPTHS = 1u;
static const uint AOGRID_WEIGHT_NONE = 0u;
static const uint AOGRID_WEIGHT_LINEAR = 1u;
static const uint AOGRID_WEIGHT_EDGES = 2u;

// Whether the occluder shades a receiver with this id and these layers.
bool aogrid_shades(AogridOccluder occluder, uint object_id, uint layers)
{
    bool local = (bool)0;

    if (((occluder.layers & layers) != 0u)) {
        local = all((occluder.excluded != (object_id).xxxx));
    } else {
        local = false;
    }
    bool _e1 = local;
    return _e1;
}

// Whether a receiver with this id belongs to the occluder.
bool aogrid_is_on_itself(AogridOccluder occluder, uint object_id)
{
    bool local = (bool)0;

    if ((object_id == occluder.object_id)) {
        local = (object_id != AOGRID_NO_OBJECT);
    } else {
        local = false;
    }
    bool _e1 = local;
    return _e1;
}

// Applies a row of an affine map to a point: three fused multiply-adds.
float aogrid_row(float4 row, float3 v)
{
    return mad(row.x, v.x, mad(row.y, v.y, mad(row.z, v.z, row.w)));
}

// The position of a world-space point in the grid's box, [0,1]^3.
float3 aogrid_grid_position(AogridOccluder occluder, float3 position)
{
    const float _e1 = aogrid_row(occluder.grid_x, position);
    const float _e2 = aogrid_row(occluder.grid_y, position);
    const float _e3 = aogrid_row(occluder.grid_z, position);
    return float3(_e1, _e2, _e3);
}

AogridLookup ConstructAogridLookup(float3 arg0, bool arg1, float3 arg2, float arg3, float arg4, float arg5) {
    AogridLookup ret = (AogridLookup)0;
    ret.position = arg0;
    ret.is_reached = arg1;
    ret.outward = arg2;
    ret.distance_ = arg3;
    ret.remainder = arg4;
    ret.flatness = arg5;
    return ret;
}

// The place at which a receiver at a world-space position looks up the grid; not reached for NaN.
// In the far field it is on the hull of the outer cells' centers, on the ray from the box's center.
AogridLookup aogrid_lookup(AogridOccluder occluder, float3 position)
{
    const float3 _e1 = aogrid_grid_position(occluder, position);
    float3 off_center = (_e1 - (0.5).xxx);
    float3 scaled = (abs(off_center) * occluder.per_hull);
    float distance_ = max(max(scaled.x, scaled.y), max(scaled.z, 1.0));
    float per_distance = (1.0 / distance_);
    float3 at = mad(off_center, (per_distance).xxx, (0.5).xxx);
    float3 of_reach = (abs(off_center) * occluder.per_reach);
    float share = max(max(of_reach.x, of_reach.y), of_reach.z);
    float fade = saturate(mad(share, occluder.fade_scale, -3.0));
    float square = (per_distance * per_distance);
    float remainder = (mad((fade * fade), mad(2.0, fade, -3.0), 1.0) * square);
    float flatness = mad(dot((scaled * scaled), occluder.flatness.xyz), square, occluder.flatness.w);
    float3 outward = (position - occluder.center_);
    const AogridLookup aogridlookup = ConstructAogridLookup(at, (share <= 1.0), outward, distance_, remainder, flatness);
    return aogridlookup;
}

// `aogrid_lookup` for a receiver that belongs to the occluder itself. Cells inside the object are
// filled from outside; a fraction of a cell along the unit normal they weigh little.
AogridLookup aogrid_lookup_on_itself(AogridOccluder occluder, float3 position, float3 normal)
{
    float3 steps = (occluder.per_step * float3(dot(occluder.grid_x.xyz, normal), dot(occluder.grid_y.xyz, normal), dot(occluder.grid_z.xyz, normal)));
    float distance_ = rsqrt(max(dot(steps, steps), 1e-30));
    const AogridLookup _e1 = aogrid_lookup(occluder, mad(normal, (distance_).xxx, position));
    const AogridLookup aogridlookup = _e1;
    return aogridlookup;
}

// The fraction that an object occludes farther away, which occludes the fraction `a` at the hull. A
// sphere's squared sine of alpha, k, falls with the distance squared, a disc's squared tangent does:
// 1/k is the flatness and a multiple of the distance squared. The part of a fraction beyond one half
// falls with the remainder.
float aogrid_distant_fraction(float a, AogridLookup lookup)
{
    float in_front = saturate(mad(-2.0, a, 1.0));
    float behind = saturate(mad(2.0, a, -1.0));
    float at_hull = mad(-(in_front), in_front, 1.0);
    float flat = min((lookup.flatness * at_hull), 0.97);
    float k = ((at_hull * lookup.remainder) / mad(lookup.remainder, flat, (1.0 - flat)));
    return mad(-0.5, mad(-(behind), lookup.remainder, sqrt(saturate((1.0 - k)))), 0.5);
}

// 1 / |axis|, bounded for axes below the length that counts as no axis.
float aogrid_inverse_length(float3 axis)
{
    float square = mad(axis.x, axis.x, mad(axis.y, axis.y, (axis.z * axis.z)));
    return rsqrt(max(square, 1e-8));
}

// The unit axis towards what a unit axis at the hull points to, from where the look-up is.
float3 aogrid_distant_axis(float3 axis, AogridLookup lookup)
{
    float scale = ((1.0 - lookup.distance_) * rsqrt(dot(lookup.outward, lookup.outward)));
    float3 towards = mad(lookup.outward, (scale).xxx, axis);
    const float _e1 = aogrid_inverse_length(towards);
    return (towards * _e1);
}

// The cone's axis in world space, not normalized, from a texel's rgb.
float3 aogrid_axis(AogridOccluder occluder, float3 rgb)
{
    const float _e1 = aogrid_row(occluder.axis_x, rgb);
    const float _e2 = aogrid_row(occluder.axis_y, rgb);
    const float _e3 = aogrid_row(occluder.axis_z, rgb);
    return float3(_e1, _e2, _e3);
}

// The occluded fraction of the sphere from a texel's alpha at a look-up.
float aogrid_fraction(AogridOccluder occluder, float alpha, AogridLookup lookup)
{
    float a = (alpha * max(alpha, occluder.min_factor));
    if ((lookup.distance_ > 1.0)) {
        const float _e1 = aogrid_distant_fraction(a, lookup);
        return _e1;
    }
    return a;
}

AogridCone ConstructAogridCone(float3 arg0, float arg1, float arg2) {
    AogridCone ret = (AogridCone)0;
    ret.axis = arg0;
    ret.fraction = arg1;
    ret.density = arg2;
    return ret;
}

// The cone of a grid's texel at a look-up. The axis of interpolated cells is shorter than 1 where theirs
// disagree: the cone then widens and thins so that it keeps both moments of the occluded
// directions, their fraction and their mean.
AogridCone aogrid_cone_of(AogridOccluder occluder, float4 texel, AogridLookup lookup)
{
    float3 axis = (float3)0;

    const float3 _e1 = aogrid_axis(occluder, texel.xyz);
    const float _e2 = aogrid_inverse_length(_e1);
    float length_ = clamp((dot(_e1, _e1) * _e2), occluder.min_axis_length, 1.0);
    axis = (_e1 * _e2);
    if ((lookup.distance_ > 1.0)) {
        float3 _e3 = axis;
        const float3 _e4 = aogrid_distant_axis(_e3, lookup);
        axis = _e4;
    }
    const float _e5 = aogrid_fraction(occluder, texel.w, lookup);
    float widened = mad((_e5 - 1.0), length_, 1.0);
    float3 _e6 = axis;
    const AogridCone aogridcone = ConstructAogridCone(_e6, widened, (_e5 / max(widened, 1e-6)));
    return aogridcone;
}

// The texture coordinates in T_clip of a cone of fraction `a` with its axis at `cos_beta`.
float2 aogrid_clip_coordinate(float a, float cos_beta)
{
    return float2(mad(a, 0.984375, 0.0078125), mad(cos_beta, 0.4921875, 0.5));
}

// 1 - AO of a clipped cone, from T_clip as transmittance (one channel).
float aogrid_clip_transmittance(Texture2D<float4> table, SamplerState linear_clamp, float a, float cos_beta)
{
    const float2 _e1 = aogrid_clip_coordinate(a, cos_beta);
    float4 _e2 = table.SampleLevel(linear_clamp, _e1, 0.0);
    return _e2.x;
}

// The transmittance of a cone grid at a look-up within reach.
float aogrid_cone_at(AogridOccluder occluder, Texture3D<float4> grid, Texture2D<float4> table, SamplerState linear_clamp, AogridLookup lookup, float3 normal)
{
    float4 texel = grid.SampleLevel(linear_clamp, lookup.position, 0.0);
    const AogridCone _e1 = aogrid_cone_of(occluder, texel, lookup);
    const float _e2 = aogrid_clip_transmittance(table, linear_clamp, _e1.fraction, dot(_e1.axis, normal));
    return mad((_e1.density * occluder.strength), (_e2 - 1.0), 1.0);
}

// The transmittance of a cone grid at a receiver in world space; 1 beyond the occluder's reach: its
// far field, or without one its grid's box. `normal` is the receiver's unit normal, `table` T_clip
// as transmittance (RR-5779, 5.1). The receiver belongs to another object.
float aogrid_cone(AogridOccluder occluder, Texture3D<float4> grid, Texture2D<float4> table, SamplerState linear_clamp, float3 position, float3 normal)
{
    const AogridLookup _e1 = aogrid_lookup(occluder, position);
    const float _e2 = aogrid_cone_at(occluder, grid, table, linear_clamp, _e1, normal);
    return (_e1.is_reached ? _e2 : 1.0);
}

// `aogrid_cone` for a receiver that belongs to the occluder itself.
float aogrid_cone_on_itself(AogridOccluder occluder, Texture3D<float4> grid, Texture2D<float4> table, SamplerState linear_clamp, float3 position, float3 normal)
{
    const AogridLookup _e1 = aogrid_lookup_on_itself(occluder, position, normal);
    const float _e2 = aogrid_cone_at(occluder, grid, table, linear_clamp, _e1, normal);
    return (_e1.is_reached ? _e2 : 1.0);
}

// AO, the fraction a' and the axis weight f of a clipped cone, from T_clip with all channels.
float3 aogrid_clip(Texture2D<float4> table, SamplerState linear_clamp, float a, float cos_beta)
{
    const float2 _e1 = aogrid_clip_coordinate(a, cos_beta);
    float4 _e2 = table.SampleLevel(linear_clamp, _e1, 0.0);
    return _e2.xyz;
}

// The unit axis of a clipped cone with unit axis d, f d + (1 - f) n; zero if that sum is zero
// (RR-5779, 5.2.2).
float3 aogrid_clipped_axis(float3 axis, float3 normal, float axis_weight)
{
    float3 sum = lerp(normal, axis, axis_weight);
    const float _e1 = aogrid_inverse_length(sum);
    return (sum * _e1);
}

// The contribution of one occluder where axes are accumulated: (AO/2) d' and 1 - AO, the strength
// included, from T_clip with all channels (RR-5779, 5.2.1). The product of all w is the
// transmittance; the normalized sum of all xyz is the axis of the occluded directions.
float4 aogrid_cone_with_axis_at(AogridOccluder occluder, Texture3D<float4> grid, Texture2D<float4> table, SamplerState linear_clamp, AogridLookup lookup, float3 normal)
{
    float4 texel = grid.SampleLevel(linear_clamp, lookup.position, 0.0);
    const AogridCone _e1 = aogrid_cone_of(occluder, texel, lookup);
    const float3 _e2 = aogrid_clip(table, linear_clamp, _e1.fraction, dot(_e1.axis, normal));
    float occlusion = ((_e2.x * _e1.density) * occluder.strength);
    const float3 _e3 = aogrid_clipped_axis(_e1.axis, normal, _e2.z);
    return float4(((0.5 * occlusion) * _e3), (1.0 - occlusion));
}

// The cosine of the angle between an axis of any length and a unit normal; 0 without an axis.
float aogrid_cos_beta(float3 axis, float3 normal)
{
    float along = mad(axis.x, normal.x, mad(axis.y, normal.y, (axis.z * normal.z)));
    const float _e1 = aogrid_inverse_length(axis);
    return (along * _e1);
}

// The texture coordinates in T_merge. Without an axis, gamma is a right angle.
float3 aogrid_merge_coordinate(float4 accumulated, float4 contribution)
{
    const float _e1 = aogrid_cos_beta(accumulated.xyz, contribution.xyz);
    const float _e2 = aogrid_inverse_length(contribution.xyz);
    float cos_gamma = (_e1 * _e2);
    float gamma = acos(clamp(cos_gamma, -1.0, 1.0));
    return float3(mad(accumulated.w, -0.48958334, 0.5), mad(contribution.w, -0.48958334, 0.5), mad(gamma, 0.3083627, 0.015625));
}

// Combines occluders as cones around their axes: AO = 2 T_merge(AO1/2, AO2/2, gamma), which is AO1
// + AO2 less twice the fraction that both cones cover, from `overlaps` (RR-5779, 5.2.2; JGT
// supplement).
float4 aogrid_merge(float4 accumulated, float4 contribution, Texture3D<float4> overlaps, SamplerState linear_clamp)
{
    const float3 _e1 = aogrid_merge_coordinate(accumulated, contribution);
    float4 _e2 = overlaps.SampleLevel(linear_clamp, _e1, 0.0);
    float overlap = _e2.x;
    float t = mad(2.0, overlap, (accumulated.w + (contribution.w - 1.0)));
    return float4((accumulated.xyz + contribution.xyz), max(t, 0.0));
}

// Merges a cone grid into `accumulated` (RR-5779, 5.2.2), for objects that overlap as seen from
// the receiver. Start with vec4f(0, 0, 0, 1); the last w is the transmittance. The result depends
// on the order of three or more occluders: keep it fixed. `clip` is T_clip with all channels,
// `overlaps` the overlap table of T_merge.
float4 aogrid_merge_cone(float4 accumulated, AogridOccluder occluder, Texture3D<float4> grid, Texture2D<float4> clip_, Texture3D<float4> overlaps, SamplerState linear_clamp, float3 position, float3 normal)
{
    const AogridLookup _e1 = aogrid_lookup(occluder, position);
    if (!(_e1.is_reached)) {
        return accumulated;
    }
    const float4 _e2 = aogrid_cone_with_axis_at(occluder, grid, clip_, linear_clamp, _e1, normal);
    const float4 _e3 = aogrid_merge(accumulated, _e2, overlaps, linear_clamp);
    return _e3;
}

float3 ZeroValuefloat3() {
    return (float3)0;
}

// `aogrid_cone` without the box test, for a grid whose outer cells are all open, as after either
// boundary treatment: the clamped sampler extends the open cells beyond the box. There is no far
// field then.
float aogrid_cone_faded(AogridOccluder occluder, Texture3D<float4> grid, Texture2D<float4> table, SamplerState linear_clamp, float3 position, float3 normal)
{
    const float3 _e1 = aogrid_grid_position(occluder, position);
    AogridLookup lookup = ConstructAogridLookup(_e1, true, ZeroValuefloat3(), 1.0, 1.0, 0.0);
    const float _e2 = aogrid_cone_at(occluder, grid, table, linear_clamp, lookup, normal);
    return _e2;
}

// 1 - AO from the occlusion fraction alone: AO = 2a on other surfaces, and 2a - 1 on the
// occluder's own, which blocks half of all directions itself (RR-5779, 4.2, which prints half of
// that).
float aogrid_occlusion_transmittance(float a, bool on_itself)
{
    return saturate(mad(-2.0, a, (on_itself ? 2.0 : 1.0)));
}

// Applies the occluder's strength to a transmittance: 1 - strength * AO.
float aogrid_strengthen(AogridOccluder occluder, float transmittance)
{
    return mad((transmittance - 1.0), occluder.strength, 1.0);
}

// The transmittance of an occlusion-only grid, independent of the receiver's normal (RR-5779, 4);
// 1 beyond the occluder's reach. `on_itself`: the receiver belongs to the occluder.
float aogrid_occlusion(AogridOccluder occluder, Texture3D<float4> grid, SamplerState linear_clamp, float3 position, bool on_itself)
{
    const AogridLookup _e1 = aogrid_lookup(occluder, position);
    float4 _e2 = grid.SampleLevel(linear_clamp, _e1.position, 0.0);
    float stored = _e2.x;
    const float _e3 = aogrid_fraction(occluder, stored, _e1);
    const float _e4 = aogrid_occlusion_transmittance(_e3, on_itself);
    const float _e5 = aogrid_strengthen(occluder, _e4);
    return (_e1.is_reached ? _e5 : 1.0);
}

// `aogrid_occlusion` for a grid that holds cones.
float aogrid_occlusion_of_cone(AogridOccluder occluder, Texture3D<float4> grid, SamplerState linear_clamp, float3 position, bool on_itself)
{
    const AogridLookup _e1 = aogrid_lookup(occluder, position);
    float4 _e2 = grid.SampleLevel(linear_clamp, _e1.position, 0.0);
    float stored = _e2.w;
    const float _e3 = aogrid_fraction(occluder, stored, _e1);
    const float _e4 = aogrid_occlusion_transmittance(_e3, on_itself);
    const float _e5 = aogrid_strengthen(occluder, _e4);
    return (_e1.is_reached ? _e5 : 1.0);
}

// 1 - AO of a clipped cone in closed form, an alternative to the table: no fetch, two arc
// tangents. The derivation is that of `aogrid_tables::clip`, with sin t0 cos t0 and sin phi0 cos
// phi0 written out, so that AO = (p cos beta + q)/pi needs no quotient.
float aogrid_clip_transmittance_closed_form(float a, float cos_beta)
{
    float cos_alpha = mad(-2.0, a, 1.0);
    float sin_alpha_squared = ((4.0 * a) * (1.0 - a));
    float root = sqrt(max(mad(-(cos_beta), cos_beta, sin_alpha_squared), 1e-12));
    float half_rim = atan2(root, (-(cos_alpha) * cos_beta));
    float half_horizon = atan2(root, cos_alpha);
    float occlusion = mad((sin_alpha_squared * cos_beta), half_rim, (half_horizon - (root * cos_alpha)));
    return (1.0 - saturate((occlusion / 3.1415927)));
}

// Combines occluders as statistically independent: transmittances are multiplied (RR-5779, 5.2.1).
float4 aogrid_multiply(float4 accumulated, float4 contribution)
{
    return float4((accumulated.xyz + contribution.xyz), (accumulated.w * contribution.w));
}

// Combines occluders as halfway between independent and united cones: the mean of both
// transmittances, of everything so far and one more occluder.
float4 aogrid_mean(float4 accumulated, float4 contribution, Texture3D<float4> overlaps, SamplerState linear_clamp)
{
    const float4 _e1 = aogrid_merge(accumulated, contribution, overlaps, linear_clamp);
    return float4(_e1.xyz, (0.5 * mad(accumulated.w, contribution.w, _e1.w)));
}

// A look-up with its position in the atlas. It stays between the centers of the grid's outer
// cells, so that linear filtering never reaches a neighboring grid.
AogridLookup aogrid_atlas_lookup(AogridAtlasOccluder occluder, AogridLookup lookup)
{
    AogridLookup of_atlas = (AogridLookup)0;

    float3 half_cell = occluder.half_cell.xyz;
    float3 own = clamp(lookup.position, half_cell, ((1.0).xxx - half_cell));
    float3 position = mad(own, occluder.atlas_scale.xyz, occluder.atlas_offset.xyz);
    of_atlas = lookup;
    of_atlas.position = position;
    AogridLookup _e1 = of_atlas;
    const AogridLookup aogridlookup = _e1;
    return aogridlookup;
}

uint2 naga_div(uint2 lhs, uint2 rhs) {
    return lhs / (rhs == 0u ? 1u : rhs);
}

uint naga_div(uint lhs, uint rhs) {
    return lhs / (rhs == 0u ? 1u : rhs);
}

// The index of the first word of a list of the tile that contains a pixel. `list`:
// AOGRID_LIST_OPAQUE or AOGRID_LIST_ALL_DEPTHS. A list has `tiles.words` words, one bit per
// occluder.
uint aogrid_first_word(AogridTiles tiles, uint2 pixel, uint list)
{
    uint2 tile = naga_div(pixel, (16u).xx);
    uint tiles_per_row = naga_div(((tiles.size.x + AOGRID_TILE) - 1u), AOGRID_TILE);
    return (((((tile.y * tiles_per_row) + tile.x) * 2u) + list) * tiles.words);
}

// The index of the first occluder in word `word` of a list; continue with bits & (bits - 1) until
// that is 0.
uint aogrid_listed_occluder(uint word, uint bits)
{
    return ((32u * word) + firstbitlow(bits));
}

// The world position of a pixel: `ndc` x and y in -1..1, y up, and the depth buffer's value.
float3 aogrid_world_position(float4x4 world_from_clip, float2 ndc, float depth)
{
    float4 p = mul(float4(ndc, depth, 1.0), world_from_clip);
    return (p.xyz / (p.w).xxx);
}

#endif
