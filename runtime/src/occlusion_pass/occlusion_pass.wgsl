// The raster pass: the factor of a pixel that an occluder's box covers (RR-5779, 3.2). Behind
// `gbuffer.wgsl` and `boxes.wgsl`.

/// Whether the grids hold cones; otherwise they hold occlusion alone.
override grids_hold_cones: bool;

@fragment
fn cone(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let p = receiver_position(texel);
    let object = receiver_object(texel);
    let found = aogrid_lookup(draw.occluder, p);
    if !(found.is_reached && is_shaded(draw.occluder, object)) {
        discard;
    }
    let n = receiver_normal(texel);
    let lookup = shading_lookup(draw.occluder, found, p, n, object);
    return vec4f(aogrid_cone_at(draw.occluder, grid, t_clip, linear_clamp, lookup, n));
}

@fragment
fn cone_with_axis(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let p = receiver_position(texel);
    let object = receiver_object(texel);
    let found = aogrid_lookup(draw.occluder, p);
    if !(found.is_reached && is_shaded(draw.occluder, object)) {
        discard;
    }
    let n = receiver_normal(texel);
    let lookup = shading_lookup(draw.occluder, found, p, n, object);
    return aogrid_cone_with_axis_at(draw.occluder, grid, t_clip, linear_clamp, lookup, n);
}

@fragment
fn occlusion(@builtin(position) pixel: vec4f) -> @location(0) vec4f {
    let texel = vec2u(pixel.xy);
    let object = receiver_object(texel);
    let lookup = aogrid_lookup(draw.occluder, receiver_position(texel));
    if !(lookup.is_reached && is_shaded(draw.occluder, object)) {
        discard;
    }
    let stored = textureSampleLevel(grid, linear_clamp, lookup.position, 0.0);
    let alpha = select(stored.r, stored.a, grids_hold_cones);
    let a = aogrid_fraction(draw.occluder, alpha, lookup);
    let t = aogrid_occlusion_transmittance(a, aogrid_is_on_itself(draw.occluder, object.x));
    return vec4f(aogrid_strengthen(draw.occluder, t));
}
