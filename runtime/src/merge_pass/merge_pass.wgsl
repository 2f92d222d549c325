// The merging raster pass: the running cone of a pixel that an occluder's box covers is read from
// one buffer and written to the other (RR-5779, 5.2.2). Behind `gbuffer.wgsl` and `boxes.wgsl`.

/// Whether the mean of merging and multiplying is taken.
override takes_mean: bool;

/// The accumulated previous occluders: the sum of (AO/2) d', and 1 - AO.
@group(3) @binding(0) var previous: texture_2d<f32>;
/// The overlap table of T_merge.
@group(3) @binding(1) var overlaps: texture_3d<f32>;

@fragment
fn merge(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let p = receiver_position(texel);
    let object = receiver_object(texel);
    let found = aogrid_lookup(draw.occluder, p);
    if !(found.is_reached && is_shaded(draw.occluder, object)) {
        discard;
    }
    let n = receiver_normal(texel);
    let lookup = shading_lookup(draw.occluder, found, p, n, object);
    let contribution =
        aogrid_cone_with_axis_at(draw.occluder, grid, t_clip, linear_clamp, lookup, n);
    let before = textureLoad(previous, texel, 0);
    if takes_mean {
        return aogrid_mean(before, contribution, overlaps, linear_clamp);
    }
    return aogrid_merge(before, contribution, overlaps, linear_clamp);
}

/// Copies the output of the previous pass into the other buffer.
@fragment
fn copy(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    return textureLoad(previous, vec2u(pixel.xy), 0);
}
