// The tiled pass, in two dispatches. First, one workgroup per tile gathers the occluders whose
// boxes may contain the tile's receivers. Then every pixel walks that list in the caller's order
// and writes its result once. The walk reads the list from a buffer, at an index that is uniform
// over a workgroup: compilers then keep the list and the occluder in scalar registers. Behind
// `gbuffer.wgsl`; the declaration of the target, which names its format, follows.

/// The shading of an occluder: OCCLUSION to MEAN below.
override shading: u32;
/// Whether the axis is written to the target besides the transmittance.
override writes_axis: bool;
/// Whether the grids hold cones; otherwise they hold occlusion alone.
override grids_hold_cones: bool;

/// Occlusion alone, independent of normals, multiplied.
const OCCLUSION = 0u;
/// Cones, multiplied, without their axes.
const CONE = 1u;
/// Cones, multiplied, and their axes.
const CONE_AND_AXIS = 2u;
/// Cones, merged.
const MERGED = 3u;
/// Cones, the mean of merged and multiplied.
const MEAN = 4u;

/// The rounding of a position in a grid's box and of the bound that it is compared with, relative
/// to the sum of their terms: sixteen single-precision roundings, where ten occur.
const POSITION_ROUNDING = 1e-6;

/// The invocations along a side of a workgroup, and all of them.
const SIDE = 8u;
const LANES = 64u;

@group(1) @binding(0) var<uniform> tiles: AogridTiles;
/// All occluders, in the caller's order.
@group(1) @binding(1) var<storage, read> occluders: array<AogridAtlasOccluder>;

/// The lists to be gathered: see `aogrid_first_word`.
@group(2) @binding(0) var<storage, read_write> gathered: array<u32>;

/// The gathered lists.
@group(2) @binding(0) var<storage, read> lists: array<u32>;
/// The atlas of all grids.
@group(2) @binding(1) var atlas: texture_3d<f32>;
/// The overlap table of T_merge.
@group(2) @binding(2) var overlaps: texture_3d<f32>;

/// The bounds of the tile's receivers as ordered keys, the minimum first, and as its complement, so
/// that both bounds are found by atomicMax. 0 stands for no receiver.
var<workgroup> bounds: array<atomic<u32>, 6>;
/// One bit per occluder whose box may contain a receiver of this tile.
var<workgroup> near_receivers: array<atomic<u32>, AOGRID_TILE_WORDS>;
/// One bit per occluder whose box may cover a pixel of this tile.
var<workgroup> on_screen: array<atomic<u32>, AOGRID_TILE_WORDS>;

@compute @workgroup_size(SIDE, SIDE)
fn gather_tile(@builtin(workgroup_id) tile: vec3u, @builtin(local_invocation_id) id: vec3u,
               @builtin(local_invocation_index) lane: u32) {
    clear_workgroup(lane);
    workgroupBarrier();
    for (var y = id.y; y < AOGRID_TILE; y += SIDE) {
        for (var x = id.x; x < AOGRID_TILE; x += SIDE) {
            extend_bounds(AOGRID_TILE * tile.xy + vec2u(x, y));
        }
    }
    workgroupBarrier();
    gather(tile.xy, lane);
    workgroupBarrier();
    write_lists(tile.xy, lane);
}

@compute @workgroup_size(SIDE, SIDE)
fn shade_pixels(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) id: vec3u) {
    let texel = SIDE * group.xy + id.xy;
    if all(texel < tiles.size) {
        write_target(texel, accumulate_list(texel, SIDE * group.xy));
    }
}

fn clear_workgroup(lane: u32) {
    if lane < 6u {
        atomicStore(&bounds[lane], 0u);
    }
    for (var word = lane; word < tiles.words; word += LANES) {
        atomicStore(&near_receivers[word], 0u);
        atomicStore(&on_screen[word], 0u);
    }
}

fn extend_bounds(texel: vec2u) {
    if any(texel >= tiles.size) || is_cleared(texel) {
        return;
    }
    let p = receiver_position(texel);
    if !is_finite(p) {
        return;
    }
    let key = vec3u(ordered_key(p.x), ordered_key(p.y), ordered_key(p.z));
    for (var x = 0u; x < 3u; x++) {
        atomicMax(&bounds[x], ~key[x]);
        atomicMax(&bounds[x + 3u], key[x]);
    }
}

/// Tests every LANES-th occluder per invocation. Bits are set in any order, with the same result.
fn gather(tile: vec2u, lane: u32) {
    let has_receivers = atomicLoad(&bounds[0]) != 0u;
    var low = vec3f();
    var high = vec3f();
    for (var x = 0u; x < 3u; x++) {
        low[x] = float_from_key(~atomicLoad(&bounds[x]));
        high[x] = float_from_key(atomicLoad(&bounds[x + 3u]));
    }
    let first = vec2f(tile * AOGRID_TILE);
    let last = first + f32(AOGRID_TILE);
    for (var idx = lane; idx < tiles.occluders; idx += LANES) {
        // The list of all depths needs the screen test alone.
        let pixels = occluders[idx].pixels;
        if all(pixels.xy <= last) && all(pixels.zw >= first) {
            let bit = 1u << (idx % 32u);
            atomicOr(&on_screen[idx / 32u], bit);
            if has_receivers && may_hold(occluders[idx].occluder, low, high) {
                atomicOr(&near_receivers[idx / 32u], bit);
            }
        }
    }
}

/// Whether a receiver between `low` and `high` may lie in the occluder's reach: the bounds, projected
/// onto each axis of the box, overlap it.
fn may_hold(occluder: AogridOccluder, low: vec3f, high: vec3f) -> bool {
    let center = 0.5 * low + 0.5 * high;
    let reach = high - center;
    let extent = 1.0 / occluder.per_reach;
    return axis_meets(occluder.grid_x, extent.x, center, reach)
        && axis_meets(occluder.grid_y, extent.y, center, reach)
        && axis_meets(occluder.grid_z, extent.z, center, reach);
}

/// `extent`: half the occluder's reach along the axis, in its box's coordinates.
fn axis_meets(row: vec4f, extent: f32, center: vec3f, reach: vec3f) -> bool {
    // Half the extent of the bounds along this axis of the box.
    let across = dot(abs(row.xyz), reach);
    let terms = dot(abs(row.xyz), abs(center)) + across + abs(row.w) + extent;
    return abs(aogrid_row(row, center) - 0.5) <= extent + across + POSITION_ROUNDING * terms;
}

fn write_lists(tile: vec2u, lane: u32) {
    let opaque = aogrid_first_word(tiles, tile * AOGRID_TILE, AOGRID_LIST_OPAQUE);
    let all_depths = aogrid_first_word(tiles, tile * AOGRID_TILE, AOGRID_LIST_ALL_DEPTHS);
    for (var word = lane; word < tiles.words; word += LANES) {
        gathered[opaque + word] = atomicLoad(&near_receivers[word]);
        gathered[all_depths + word] = atomicLoad(&on_screen[word]);
    }
}

/// Accumulates all occluders in the list of the tile that contains the pixel `corner`.
fn accumulate_list(texel: vec2u, corner: vec2u) -> vec4f {
    let p = receiver_position(texel);
    let object = receiver_object(texel);
    var n = vec3f();
    if shading != OCCLUSION {
        n = receiver_normal(texel);
    }
    var accumulated = vec4f(0.0, 0.0, 0.0, 1.0);
    let first = aogrid_first_word(tiles, corner, AOGRID_LIST_OPAQUE);
    for (var word = 0u; word < tiles.words; word++) {
        var bits = lists[first + word];
        while bits != 0u {
            let idx = aogrid_listed_occluder(word, bits);
            bits &= bits - 1u;
            accumulated = accumulate_occluder(accumulated, idx, p, n, object);
        }
    }
    return accumulated;
}

/// Accumulates one more occluder.
fn accumulate_occluder(accumulated: vec4f, idx: u32, p: vec3f, n: vec3f, object: vec2u) -> vec4f {
    let o = occluders[idx].occluder;
    let found = aogrid_lookup(o, p);
    if !(found.is_reached && is_shaded(o, object)) {
        return accumulated;
    }
    if shading == OCCLUSION {
        let at = aogrid_atlas_lookup(occluders[idx], found);
        let stored = textureSampleLevel(atlas, linear_clamp, at.position, 0.0);
        let alpha = select(stored.r, stored.a, grids_hold_cones);
        let on_itself = aogrid_is_on_itself(o, object.x);
        let t = aogrid_occlusion_transmittance(aogrid_fraction(o, alpha, at), on_itself);
        return vec4f(accumulated.xyz, accumulated.w * aogrid_strengthen(o, t));
    }
    let at = aogrid_atlas_lookup(occluders[idx], shading_lookup(o, found, p, n, object));
    switch shading {
        case CONE: {
            let t = aogrid_cone_at(o, atlas, t_clip, linear_clamp, at, n);
            return vec4f(accumulated.xyz, accumulated.w * t);
        }
        case CONE_AND_AXIS: {
            let contribution = aogrid_cone_with_axis_at(o, atlas, t_clip, linear_clamp, at, n);
            return aogrid_multiply(accumulated, contribution);
        }
        case MEAN: {
            let contribution = aogrid_cone_with_axis_at(o, atlas, t_clip, linear_clamp, at, n);
            return aogrid_mean(accumulated, contribution, overlaps, linear_clamp);
        }
        default: {
            let contribution = aogrid_cone_with_axis_at(o, atlas, t_clip, linear_clamp, at, n);
            return aogrid_merge(accumulated, contribution, overlaps, linear_clamp);
        }
    }
}

fn write_target(texel: vec2u, accumulated: vec4f) {
    if writes_axis {
        textureStore(target_image, texel, accumulated);
    } else {
        textureStore(target_image, texel, vec4f(accumulated.w));
    }
}

/// Whether a depth is at either end of its range, as in a cleared buffer: such a pixel would
/// stretch the bounds to the horizon.
fn is_cleared(texel: vec2u) -> bool {
    if !positions_are_depths {
        return false;
    }
    let depth = textureLoad(positions, texel, 0).x;
    return depth == 0.0 || depth == 1.0;
}

/// Whether a position is neither NaN nor infinite, tested by its bits: compilers may assume that
/// floats are finite.
fn is_finite(p: vec3f) -> bool {
    let exponent = vec3u(0x7f800000u);
    return all((bitcast<vec3u>(p) & exponent) != exponent);
}

/// A key that is ordered like the float, and above 0 for every finite float.
fn ordered_key(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return bits ^ select(0x80000000u, 0xffffffffu, (bits & 0x80000000u) != 0u);
}

/// The float with an ordered key.
fn float_from_key(key: u32) -> f32 {
    return bitcast<f32>(key ^ select(0xffffffffu, 0x80000000u, (key & 0x80000000u) != 0u));
}
