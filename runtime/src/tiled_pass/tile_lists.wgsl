// The lists of the tiled pass, for a forward or transparent shader. Behind `constants.wgsl` and
// `shading.wgsl`; GROUP is the index at which the bind group of `TiledPass::lists` is set.

@group(GROUP) @binding(0) var<uniform> aogrid_tiles: AogridTiles;
/// All occluders, in the caller's order.
@group(GROUP) @binding(1) var<storage, read> aogrid_occluders: array<AogridAtlasOccluder>;
/// The atlas of all grids.
@group(GROUP) @binding(2) var aogrid_atlas: texture_3d<f32>;
/// T_clip with all channels.
@group(GROUP) @binding(3) var aogrid_t_clip: texture_2d<f32>;
/// The overlap table of T_merge.
@group(GROUP) @binding(4) var aogrid_overlaps: texture_3d<f32>;
/// The linear, clamped sampler.
@group(GROUP) @binding(5) var aogrid_linear_clamp: sampler;
/// The lists of all tiles; see `aogrid_first_word`.
@group(GROUP) @binding(6) var<storage, read> aogrid_lists: array<u32>;

/// Multiplies the cones of a list at a receiver in world space: the transmittance 1 - AO in w, the
/// sum of all (AO/2) d' in xyz. `pixel`: the pixel that shows the receiver, from the top left.
/// `list`: AOGRID_LIST_OPAQUE if the G-buffer holds this very point, otherwise
/// AOGRID_LIST_ALL_DEPTHS. `object`: its id and layers, as for `aogrid_shades`.
fn aogrid_multiply_listed(list: u32, pixel: vec2u, position: vec3f, normal: vec3f,
                          object: vec2u) -> vec4f {
    var accumulated = vec4f(0.0, 0.0, 0.0, 1.0);
    let first = aogrid_first_word(aogrid_tiles, pixel, list);
    for (var word = 0u; word < aogrid_tiles.words; word++) {
        var bits = aogrid_lists[first + word];
        while bits != 0u {
            let idx = aogrid_listed_occluder(word, bits);
            let contribution = aogrid_listed_cone(idx, position, normal, object);
            accumulated = aogrid_multiply(accumulated, contribution);
            bits &= bits - 1u;
        }
    }
    return accumulated;
}

/// Merges the cones of a list; parameters and result as for `aogrid_multiply_listed`.
fn aogrid_merge_listed(list: u32, pixel: vec2u, position: vec3f, normal: vec3f,
                       object: vec2u) -> vec4f {
    var accumulated = vec4f(0.0, 0.0, 0.0, 1.0);
    let first = aogrid_first_word(aogrid_tiles, pixel, list);
    for (var word = 0u; word < aogrid_tiles.words; word++) {
        var bits = aogrid_lists[first + word];
        while bits != 0u {
            let idx = aogrid_listed_occluder(word, bits);
            let contribution = aogrid_listed_cone(idx, position, normal, object);
            accumulated =
                aogrid_merge(accumulated, contribution, aogrid_overlaps, aogrid_linear_clamp);
            bits &= bits - 1u;
        }
    }
    return accumulated;
}

/// Combines the cones of a list by the mean of both; parameters and result as for
/// `aogrid_multiply_listed`.
fn aogrid_mean_listed(list: u32, pixel: vec2u, position: vec3f, normal: vec3f,
                      object: vec2u) -> vec4f {
    var accumulated = vec4f(0.0, 0.0, 0.0, 1.0);
    let first = aogrid_first_word(aogrid_tiles, pixel, list);
    for (var word = 0u; word < aogrid_tiles.words; word++) {
        var bits = aogrid_lists[first + word];
        while bits != 0u {
            let idx = aogrid_listed_occluder(word, bits);
            let contribution = aogrid_listed_cone(idx, position, normal, object);
            accumulated =
                aogrid_mean(accumulated, contribution, aogrid_overlaps, aogrid_linear_clamp);
            bits &= bits - 1u;
        }
    }
    return accumulated;
}

/// The contribution of one occluder; none beyond its reach, or if it does not shade the object.
fn aogrid_listed_cone(idx: u32, position: vec3f, normal: vec3f, object: vec2u) -> vec4f {
    let o = aogrid_occluders[idx].occluder;
    var lookup = aogrid_lookup(o, position);
    if !(lookup.is_reached && aogrid_shades(o, object.x, object.y)) {
        return vec4f(0.0, 0.0, 0.0, 1.0);
    }
    if aogrid_is_on_itself(o, object.x) {
        lookup = aogrid_lookup_on_itself(o, position, normal);
    }
    let at = aogrid_atlas_lookup(aogrid_occluders[idx], lookup);
    return aogrid_cone_with_axis_at(o, aogrid_atlas, aogrid_t_clip, aogrid_linear_clamp, at,
                                    normal);
}
