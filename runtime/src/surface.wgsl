// aogrid: environment light on surfaces with baked accessibility and bent normals (Pharr and Green,
// GPU Gems, chapter 17, listings 17-3 to 17-5).
//
// Pure functions, all named aogrid_*: no bindings, no entry points, no directives. Paste this
// file behind the shading library and `environment.wgsl`, and call
//
//     aogrid_surface_light
//
// with the open cone of a pixel and, where other objects have grids, their accumulated occlusion
// without that of the pixel's own object. The CPU twin, `surface.rs`, has the same functions under
// the same names.

/// The light that a white diffuse surface reflects (listing 17-3): its accessibility times the mean
/// radiance of its open cone, less AO times that of what `accumulated` occludes; the latter is 0, 0, 0,
/// 1 without neighbors.
fn aogrid_surface_light(environment: AogridEnvironment, map: texture_2d<f32>, map_sampler: sampler,
                        accumulated: vec4f, normal: vec3f, accessibility: f32,
                        open: AogridCone) -> vec3f {
    let unoccluded = aogrid_cone_radiance(environment, map, map_sampler, open);
    let cone = aogrid_cosine_weighted_cone(aogrid_occluded_cone(accumulated, normal), normal);
    let blocked = aogrid_cone_radiance(environment, map, map_sampler, cone);
    return accessibility * max(unoccluded - (1.0 - accumulated.w) * blocked, vec3f());
}

/// The open cone of a surface: around its bent normal, with the share of the hemisphere that its
/// accessibility is. The level of the map is then that of the root of the accessibility (listing 17-5).
fn aogrid_open_cone(accessibility: f32, bent_normal: vec3f) -> AogridCone {
    return AogridCone(bent_normal, 0.5 * saturate(accessibility), 1.0);
}

/// The extents in u and v of the blur in a latitude-longitude texture of your own, with ordinary
/// mips (listing 17-5), for a share of the hemisphere: its root is about the diameter of the open
/// cone in v, which spans pi, and twice that in u, which spans 2 pi.
fn aogrid_latlong_blur(accessibility: f32) -> vec2f {
    let width = sqrt(saturate(accessibility));
    return vec2f(0.5 * width, width);
}

/// The latitude-longitude coordinates of a direction in the map's axes, read from a cube map of them
/// in place of arc tangents (listing 17-4). The sampler is nearest: coordinates jump at the map's
/// edge.
fn aogrid_cube_coordinate(coordinates: texture_cube<f32>, coordinates_sampler: sampler,
                          direction: vec3f) -> vec2f {
    return textureSampleLevel(coordinates, coordinates_sampler, direction, 0.0).xy;
}
