// The raster pass: the factor of a pixel that an occluder's box covers (RR-5779, 3.2). Behind
// `gbuffer.wgsl` and `boxes.wgsl`.

/// Whether the grids hold cones; otherwise they hold occlusion alone.
override grids_hold_cones: bool;

@fragment
fn cone(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let p_grid = aogrid_grid_position(draw.occluder, receiver_position(texel));
    if !(aogrid_is_inside(p_grid) && is_shaded(draw.occluder, receiver_object(texel))) {
        discard;
    }
    let n = receiver_normal(texel);
    return vec4f(aogrid_cone_at(draw.occluder, grid, t_clip, linear_clamp, p_grid, n));
}

@fragment
fn cone_with_axis(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let p_grid = aogrid_grid_position(draw.occluder, receiver_position(texel));
    if !(aogrid_is_inside(p_grid) && is_shaded(draw.occluder, receiver_object(texel))) {
        discard;
    }
    let n = receiver_normal(texel);
    return aogrid_cone_with_axis_at(draw.occluder, grid, t_clip, linear_clamp, p_grid, n);
}

@fragment
fn occlusion(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let p_grid = aogrid_grid_position(draw.occluder, receiver_position(texel));
    let object = receiver_object(texel);
    if !(aogrid_is_inside(p_grid) && is_shaded(draw.occluder, object)) {
        discard;
    }
    let stored = textureSampleLevel(grid, linear_clamp, p_grid, 0.0);
    let a = select(stored.r, aogrid_fraction(draw.occluder, stored.a), grids_hold_cones);
    let t = aogrid_occlusion_transmittance(a, is_on_itself(draw.occluder, object));
    return vec4f(aogrid_strengthen(draw.occluder, t));
}
