// The shaders that RR-5779 prints (sections 3.2 and 5.1), line by line, with the same guards as
// the library's: stored bytes are decoded, the axis is normalized, and a zero axis is harmless.

struct Naive {
    grid_from_world: mat4x4f,
    world_from_grid: mat4x4f,
}

fn naive_occlusion(occluder: Naive, p_world: vec3f) -> f32 {
    let p_grid = (occluder.grid_from_world * vec4f(p_world, 1.0)).xyz;
    let a = textureSampleLevel(grid, linear_clamp, p_grid, 0.0).r;
    return 1.0 - min(1.0, 2.0 * a);
}

fn naive_cone(occluder: Naive, p_world: vec3f, n: vec3f) -> f32 {
    let p_grid = (occluder.grid_from_world * vec4f(p_world, 1.0)).xyz;
    let stored = textureSampleLevel(grid, linear_clamp, p_grid, 0.0);
    let d_grid = stored.rgb * (255.0 / 127.0) - 128.0 / 127.0;
    let d_world = (occluder.world_from_grid * vec4f(d_grid, 0.0)).xyz;
    let d = d_world * inverseSqrt(max(dot(d_world, d_world), 1e-8));
    let cos_beta = dot(d, n);
    let at = vec2f(stored.a, 0.5 * cos_beta + 0.5) * (63.0 / 64.0) + 0.5 / 64.0;
    let occlusion = textureSampleLevel(table, linear_clamp, at, 0.0).r;
    return 1.0 - occlusion;
}
