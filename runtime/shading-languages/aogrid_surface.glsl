// aogrid: environment light on baked surfaces; include it behind `aogrid_environment`.
//
// Generated from WGSL by naga: do not edit. For GLSL ES 3.00 and GLSL 3.30
// or later: write `#version` and, for ES, `precision highp float; precision highp int;` before it.

#ifndef AOGRID_SURFACE_GLSL
#define AOGRID_SURFACE_GLSL

// The light that a white diffuse surface reflects (listing 17-3): its accessibility times the mean
// radiance of its open cone, less AO times that of what `accumulated` occludes; the latter is 0, 0, 0,
// 1 without neighbors.
vec3 aogrid_surface_light(AogridEnvironment environment, highp sampler2D map, vec4 accumulated, vec3 normal, float accessibility, AogridCone open) {
    vec3 _e1 = aogrid_cone_radiance(environment, map, open);
    AogridCone _e2 = aogrid_occluded_cone(accumulated, normal);
    AogridCone _e3 = aogrid_cosine_weighted_cone(_e2, normal);
    vec3 _e4 = aogrid_cone_radiance(environment, map, _e3);
    return (accessibility * max((_e1 - ((1.0 - accumulated.w) * _e4)), vec3(0.0)));
}

// The open cone of a surface: around its bent normal, with the share of the hemisphere that its
// accessibility is. The level of the map is then that of the root of the accessibility (listing 17-5).
AogridCone aogrid_open_cone(float accessibility, vec3 bent_normal) {
    return AogridCone(bent_normal, (0.5 * clamp(accessibility, 0.0, 1.0)), 1.0);
}

// The extents in u and v of the blur in a latitude-longitude texture of your own, with ordinary
// mips (listing 17-5), for a share of the hemisphere: its root is about the diameter of the open
// cone in v, which spans pi, and twice that in u, which spans 2 pi.
vec2 aogrid_latlong_blur(float accessibility) {
    float width = sqrt(clamp(accessibility, 0.0, 1.0));
    return vec2((0.5 * width), width);
}

// The latitude-longitude coordinates of a direction in the map's axes, read from a cube map of them
// in place of arc tangents (listing 17-4). The sampler is nearest: coordinates jump at the map's
// edge.
vec2 aogrid_cube_coordinate(highp samplerCube coordinates, vec3 direction) {
    vec4 _e1 = textureLod(coordinates, vec3(direction), 0.0);
    return _e1.xy;
}

#endif
