// The tiled pass, two dispatches: a workgroup a tile gathers the occluders that its receivers may lie
// in, then every pixel walks them in the caller's order and writes once. The walk reads the list from
// a buffer, at a place that is the same for a whole workgroup: compilers then keep the list and
// the occluder in scalar registers. Behind `frame.wgsl`; the target's declaration, which names its
// format, follows.

/// What is done with an occluder: OCCLUSION to MERGED below.
override shading: u32;
/// Whether the target takes the axis besides the transmittance.
override writes_axis: bool;
/// Whether the grids hold cones; else occlusion alone.
override grids_hold_cones: bool;

/// Without regard to normals, multiplied.
const OCCLUSION = 0u;
/// Cones, multiplied, without their axes.
const CONE = 1u;
/// Cones, multiplied, and their axes.
const CONE_AND_AXIS = 2u;
/// Cones, merged.
const MERGED = 3u;

/// Rounding of a position in a grid's box, and of what it is compared with, in parts of the terms
/// that both are sums of: sixteen roundings of single floats, where there are ten.
const POSITION_ROUNDING = 1e-6;

/// Lanes along either side of a workgroup, and all of them.
const SIDE = 8u;
const LANES = 64u;

@group(1) @binding(0) var<uniform> tiles: AogridTiles;
/// All occluders, in the caller's order.
@group(1) @binding(1) var<storage, read> occluders: array<AogridAtlasOccluder>;

/// What is gathered: see `aogrid_first_word`.
@group(2) @binding(0) var<storage, read_write> gathered: array<u32>;

/// What was gathered.
@group(2) @binding(0) var<storage, read> lists: array<u32>;
/// All grids.
@group(2) @binding(1) var atlas: texture_3d<f32>;
/// What T_merge takes off.
@group(2) @binding(2) var overlaps: texture_3d<f32>;

/// The smallest and the largest receiver, as keys: the complements of the smallest first, so that
/// the maximum is what is looked for, and 0 is none.
var<workgroup> bounds: array<atomic<u32>, 6>;
/// A bit an occluder that a receiver of this tile may lie in.
var<workgroup> near_receivers: array<atomic<u32>, AOGRID_TILE_WORDS>;
/// A bit an occluder whose box some pixel of this tile looks through.
var<workgroup> on_screen: array<atomic<u32>, AOGRID_TILE_WORDS>;

@compute @workgroup_size(SIDE, SIDE)
fn gather_tile(@builtin(workgroup_id) tile: vec3u, @builtin(local_invocation_id) id: vec3u,
               @builtin(local_invocation_index) lane: u32) {
    clear(lane);
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
        write_target(texel, walk(texel, SIDE * group.xy));
    }
}

fn clear(lane: u32) {
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
    let key = vec3u(ordered(p.x), ordered(p.y), ordered(p.z));
    for (var x = 0u; x < 3u; x++) {
        atomicMax(&bounds[x], ~key[x]);
        atomicMax(&bounds[x + 3u], key[x]);
    }
}

/// Each lane tests every so many-th occluder. Bits are set in any order, and come out the same.
fn gather(tile: vec2u, lane: u32) {
    let has_receivers = atomicLoad(&bounds[0]) != 0u;
    var low = vec3f();
    var high = vec3f();
    for (var x = 0u; x < 3u; x++) {
        low[x] = unordered(~atomicLoad(&bounds[x]));
        high[x] = unordered(atomicLoad(&bounds[x + 3u]));
    }
    let first = vec2f(tile * AOGRID_TILE);
    let last = first + f32(AOGRID_TILE);
    for (var idx = lane; idx < tiles.occluders; idx += LANES) {
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

/// Whether some receiver between `low` and `high` may lie in the occluder's box: along each of the
/// box's axes they are as far apart as the bounds reach.
fn may_hold(occluder: AogridOccluder, low: vec3f, high: vec3f) -> bool {
    let center = 0.5 * low + 0.5 * high;
    let reach = high - center;
    return axis_meets(occluder.grid_x, center, reach)
        && axis_meets(occluder.grid_y, center, reach)
        && axis_meets(occluder.grid_z, center, reach);
}

fn axis_meets(row: vec4f, center: vec3f, reach: vec3f) -> bool {
    let across = dot(abs(row.xyz), reach);
    let terms = dot(abs(row.xyz), abs(center)) + across + abs(row.w);
    return abs(aogrid_row(row, center) - 0.5) <= 0.5 + across + POSITION_ROUNDING * terms;
}

fn write_lists(tile: vec2u, lane: u32) {
    let first = aogrid_first_word(tiles, tile * AOGRID_TILE, AOGRID_LIST_OF_RECEIVERS);
    let other = aogrid_first_word(tiles, tile * AOGRID_TILE, AOGRID_LIST_OF_ANYTHING);
    for (var word = lane; word < tiles.words; word += LANES) {
        gathered[first + word] = atomicLoad(&near_receivers[word]);
        gathered[other + word] = atomicLoad(&on_screen[word]);
    }
}

/// What all occluders of a list leave: that of the tile which pixel `corner` lies in.
fn walk(texel: vec2u, corner: vec2u) -> vec4f {
    let p = receiver_position(texel);
    let object = receiver_object(texel);
    var n = vec3f();
    if shading != OCCLUSION {
        n = receiver_normal(texel);
    }
    var left = vec4f(0.0, 0.0, 0.0, 1.0);
    let first = aogrid_first_word(tiles, corner, AOGRID_LIST_OF_RECEIVERS);
    for (var word = 0u; word < tiles.words; word++) {
        var bits = lists[first + word];
        while bits != 0u {
            let idx = aogrid_listed_occluder(word, bits);
            bits &= bits - 1u;
            left = after(left, idx, p, n, object);
        }
    }
    return left;
}

/// What is left after one more occluder.
fn after(before: vec4f, idx: u32, p: vec3f, n: vec3f, object: vec2u) -> vec4f {
    let o = occluders[idx].occluder;
    let p_grid = aogrid_grid_position(o, p);
    if !(aogrid_is_inside(p_grid) && is_shaded(o, object)) {
        return before;
    }
    let at = aogrid_atlas_position(occluders[idx], p_grid);
    switch shading {
        case OCCLUSION: {
            let stored = textureSampleLevel(atlas, linear_clamp, at, 0.0);
            let a = select(stored.r, stored.a, grids_hold_cones);
            let t = aogrid_occlusion_transmittance(a, is_on_itself(o, object));
            return vec4f(before.xyz, before.w * aogrid_strengthen(o, t));
        }
        case CONE: {
            let t = aogrid_cone_at(o, atlas, t_clip, linear_clamp, at, n);
            return vec4f(before.xyz, before.w * t);
        }
        case CONE_AND_AXIS: {
            let one = aogrid_cone_with_axis_at(o, atlas, t_clip, linear_clamp, at, n);
            return aogrid_multiply(before, one);
        }
        default: {
            let one = aogrid_cone_with_axis_at(o, atlas, t_clip, linear_clamp, at, n);
            return aogrid_merge(before, one, overlaps, linear_clamp);
        }
    }
}

fn write_target(texel: vec2u, left: vec4f) {
    if writes_axis {
        textureStore(target_image, texel, left);
    } else {
        textureStore(target_image, texel, vec4f(left.w));
    }
}

/// Whether a depth is at either end of its range, where what nothing was drawn to is: it would
/// stretch the bounds to the horizon.
fn is_cleared(texel: vec2u) -> bool {
    if !positions_are_depths {
        return false;
    }
    let depth = textureLoad(positions, texel, 0).x;
    return depth == 0.0 || depth == 1.0;
}

/// Neither NaN nor infinite, by its bits: compilers may take it for granted that floats are.
fn is_finite(p: vec3f) -> bool {
    let exponent = vec3u(0x7f800000u);
    return all((bitcast<vec3u>(p) & exponent) != exponent);
}

/// A number that is ordered like the float, and above 0 for any that is finite.
fn ordered(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return bits ^ select(0x80000000u, 0xffffffffu, (bits & 0x80000000u) != 0u);
}

fn unordered(key: u32) -> f32 {
    return bitcast<f32>(key ^ select(0xffffffffu, 0x80000000u, (key & 0x80000000u) != 0u));
}
