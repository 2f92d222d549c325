// The merging raster pass: the running cone of a pixel under an occluder's box, read from one
// buffer, written to the other (RR-5779, 5.2.2). Behind `frame.wgsl` and `boxes.wgsl`.

/// What the occluders before this one left: (AO/2) d' summed, and 1 - AO.
@group(3) @binding(0) var merged_before: texture_2d<f32>;
/// What T_merge takes off.
@group(3) @binding(1) var overlaps: texture_3d<f32>;

@fragment
fn merge(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let p_grid = aogrid_grid_position(draw.occluder, receiver_position(texel));
    if !(aogrid_is_inside(p_grid) && is_shaded(draw.occluder, receiver_object(texel))) {
        discard;
    }
    let n = receiver_normal(texel);
    let one = aogrid_cone_with_axis_at(draw.occluder, grid, t_clip, linear_clamp, p_grid, n);
    return aogrid_merge(textureLoad(merged_before, texel, 0), one, overlaps, linear_clamp);
}

/// Brings what the last pass wrote into the buffer that it did not write.
@fragment
fn copy(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    return textureLoad(merged_before, vec2u(pixel.xy), 0);
}
