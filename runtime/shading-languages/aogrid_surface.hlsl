// aogrid: environment light on baked surfaces; include it behind `aogrid_environment`.
//
// Generated from WGSL by naga: do not edit. For shader model 5.0 or later.

#ifndef AOGRID_SURFACE_HLSL
#define AOGRID_SURFACE_HLSL

// The light that a white diffuse surface reflects (listing 17-3): its accessibility times the mean
// radiance of its open cone, less AO times that of what `accumulated` occludes; the latter is 0, 0, 0,
// 1 without neighbors.
float3 aogrid_surface_light(AogridEnvironment environment, Texture2D<float4> map, SamplerState map_sampler, float4 accumulated, float3 normal, float accessibility, AogridCone open)
{
    const float3 _e1 = aogrid_cone_radiance(environment, map, map_sampler, open);
    const AogridCone _e2 = aogrid_occluded_cone(accumulated, normal);
    const AogridCone _e3 = aogrid_cosine_weighted_cone(_e2, normal);
    const float3 _e4 = aogrid_cone_radiance(environment, map, map_sampler, _e3);
    return (accessibility * max((_e1 - ((1.0 - accumulated.w) * _e4)), ZeroValuefloat3()));
}

// The open cone of a surface: around its bent normal, with the share of the hemisphere that its
// accessibility is. The level of the map is then that of the root of the accessibility (listing 17-5).
AogridCone aogrid_open_cone(float accessibility, float3 bent_normal)
{
    const AogridCone aogridcone = ConstructAogridCone(bent_normal, (0.5 * saturate(accessibility)), 1.0);
    return aogridcone;
}

// The extents in u and v of the blur in a latitude-longitude texture of your own, with ordinary
// mips (listing 17-5), for a share of the hemisphere: its root is about the diameter of the open
// cone in v, which spans pi, and twice that in u, which spans 2 pi.
float2 aogrid_latlong_blur(float accessibility)
{
    float width = sqrt(saturate(accessibility));
    return float2((0.5 * width), width);
}

// The latitude-longitude coordinates of a direction in the map's axes, read from a cube map of them
// in place of arc tangents (listing 17-4). The sampler is nearest: coordinates jump at the map's
// edge.
float2 aogrid_cube_coordinate(TextureCube<float4> coordinates, SamplerState coordinates_sampler, float3 direction)
{
    float4 _e1 = coordinates.SampleLevel(coordinates_sampler, direction, 0.0);
    return _e1.xy;
}

#endif
