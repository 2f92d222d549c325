// The WGSL of `docs/*.md` and `README.md`, each block in a function that takes what the block
// does not declare. Behind the library and the tile lists of bind group 1.

@group(0) @binding(0) var<storage, read> occluders: array<AogridOccluder>;
@group(0) @binding(1) var grid: texture_3d<f32>;
@group(0) @binding(2) var table: texture_2d<f32>;
@group(0) @binding(3) var linear_clamp: sampler;
@group(0) @binding(4) var sky: texture_2d<f32>;
@group(0) @binding(5) var sky_sampler: sampler;

fn in_your_own_shader(
    count: u32, world_position: vec3f, unit_normal: vec3f, ambient: vec3f, direct: vec3f,
) -> vec3f {
    var color: vec3f;
    // docs/runtime.md, "In your own shader: the WGSL library":
    var t = 1.0;
    for (var i = 0u; i < count; i++) {
        t *= aogrid_cone(occluders[i], grid, table, linear_clamp, world_position, unit_normal);
    }
    color = ambient * t + direct;
    // End.
    return color;
}

fn on_itself(
    object_id: u32, occluder: AogridOccluder, world_position: vec3f, unit_normal: vec3f, before: f32,
) -> f32 {
    var t = before;
    // docs/runtime.md, "An object on itself":
    if aogrid_is_on_itself(occluder, object_id) {
        t *= aogrid_cone_on_itself(occluder, grid, table, linear_clamp, world_position, unit_normal);
    } else {
        t *= aogrid_cone(occluder, grid, table, linear_clamp, world_position, unit_normal);
    }
    // End.
    return t;
}

fn forward_and_transparent_surfaces(
    pixel: vec4f, position: vec3f, normal: vec3f, object: vec2u, ambient: vec3f, direct: vec3f,
) -> vec3f {
    var color: vec3f;
    // docs/runtime.md, "In tiles":
    let left = aogrid_merge_listed(AOGRID_LIST_ALL_DEPTHS, vec2u(pixel.xy), position, normal, object);
    color = ambient * left.w + direct;
    // End.
    return color;
}

fn using_a_grid(
    occluder: AogridOccluder, world_position: vec3f, unit_normal: vec3f, light: vec3f,
) -> vec3f {
    var ambient = light;
    // README.md, "Using a grid":
    ambient *= aogrid_cone(occluder, grid, table, linear_clamp, world_position, unit_normal);
    // End.
    return ambient;
}

fn on_a_baked_surface(
    environment: AogridEnvironment, normal: vec3f, accessibility: f32, bent_normal: vec3f,
    neighbors: vec4f,
) -> vec3f {
    // docs/surface.md, "Shading with it":
    // Behind SHADING, ENVIRONMENT and SURFACE; the accumulated neighbors are (0, 0, 0, 1) without any.
    let open_cone = aogrid_open_cone(accessibility, bent_normal);
    let light = aogrid_surface_light(environment, sky, sky_sampler, neighbors, normal, accessibility, open_cone);
    // End.
    return light;
}
