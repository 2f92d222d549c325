// The lists of the tiled pass, for a forward or transparent shader. Behind `constants.wgsl` and
// `shading.wgsl`; GROUP is the bind group that `TiledPass::lists` makes.

@group(GROUP) @binding(0) var<uniform> aogrid_tiles: AogridTiles;
/// All occluders, in the caller's order.
@group(GROUP) @binding(1) var<storage, read> aogrid_occluders: array<AogridAtlasOccluder>;
/// All grids.
@group(GROUP) @binding(2) var aogrid_atlas: texture_3d<f32>;
/// The whole T_clip.
@group(GROUP) @binding(3) var aogrid_t_clip: texture_2d<f32>;
/// What T_merge takes off.
@group(GROUP) @binding(4) var aogrid_overlaps: texture_3d<f32>;
/// Linear, clamped.
@group(GROUP) @binding(5) var aogrid_linear_clamp: sampler;
/// See `aogrid_first_word`.
@group(GROUP) @binding(6) var<storage, read> aogrid_lists: array<u32>;

/// What all occluders leave at a receiver in world space, by cones: in w the transmittance
/// 1 - AO, in xyz the sum of all (AO/2) d'. `pixel`: where it is seen, from the top left. `list`:
/// AOGRID_LIST_OF_RECEIVERS if the G-buffer shows this very point, else AOGRID_LIST_OF_ANYTHING.
/// `object`: its id and layers, as for `aogrid_shades`.
fn aogrid_multiply_listed(list: u32, pixel: vec2u, position: vec3f, normal: vec3f,
                          object: vec2u) -> vec4f {
    var left = vec4f(0.0, 0.0, 0.0, 1.0);
    let first = aogrid_first_word(aogrid_tiles, pixel, list);
    for (var word = 0u; word < aogrid_tiles.words; word++) {
        var bits = aogrid_lists[first + word];
        while bits != 0u {
            let one = aogrid_listed_cone(aogrid_listed_occluder(word, bits), position, normal, object);
            left = aogrid_multiply(left, one);
            bits &= bits - 1u;
        }
    }
    return left;
}

/// The same, merged.
fn aogrid_merge_listed(list: u32, pixel: vec2u, position: vec3f, normal: vec3f,
                       object: vec2u) -> vec4f {
    var left = vec4f(0.0, 0.0, 0.0, 1.0);
    let first = aogrid_first_word(aogrid_tiles, pixel, list);
    for (var word = 0u; word < aogrid_tiles.words; word++) {
        var bits = aogrid_lists[first + word];
        while bits != 0u {
            let one = aogrid_listed_cone(aogrid_listed_occluder(word, bits), position, normal, object);
            left = aogrid_merge(left, one, aogrid_overlaps, aogrid_linear_clamp);
            bits &= bits - 1u;
        }
    }
    return left;
}

/// What one occluder adds; nothing outside its box, or where it does not shade.
fn aogrid_listed_cone(idx: u32, position: vec3f, normal: vec3f, object: vec2u) -> vec4f {
    let o = aogrid_occluders[idx].occluder;
    let p_grid = aogrid_grid_position(o, position);
    if !(aogrid_is_inside(p_grid) && aogrid_shades(o, object.x, object.y)) {
        return vec4f(0.0, 0.0, 0.0, 1.0);
    }
    let at = aogrid_atlas_position(aogrid_occluders[idx], p_grid);
    return aogrid_cone_with_axis_at(o, aogrid_atlas, aogrid_t_clip, aogrid_linear_clamp, at, normal);
}
