// The brute-force reference for the other kernels: an invocation takes a cell, and tests every
// triangle for every texel of its six faces.

/// The directions through the texel centers: a vector with a major component of ±1, and its
/// length.
@group(0) @binding(5) var<storage, read> directions: array<vec4<f32>>;
/// The moment 1 (xyz) and moment 0 (w) of each texel, in steps of 2⁻³⁰.
@group(0) @binding(6) var<storage, read> texel_moments: array<vec4<i32>>;
/// All counts, then all a, then all m.x, all m.y, all m.z.
@group(0) @binding(7) var<storage, read_write> sums: array<i32>;

@compute @workgroup_size(WORKGROUP)
fn naive(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let idx = (chunk.first + group.x) * WORKGROUP + local;
    if idx >= scene.n_cells {
        return;
    }
    var count = 0;
    var sum = vec4(0);
    for (var texel = 0u; texel < scene.n_directions; texel++) {
        let direction = directions[texel];
        let ray = ray_from(sample_position(scene.first_cell + idx), direction.xyz, direction.w);
        var occluded = false;
        for (var triangle = 0u; triangle < scene.n_triangles; triangle++) {
            if intersects(ray, triangle) {
                occluded = true;
                break;
            }
        }
        if occluded {
            count++;
            sum += texel_moments[texel];
        }
    }
    sums[idx] = count;
    sums[scene.n_cells + idx] = sum.w;
    sums[2u * scene.n_cells + idx] = sum.x;
    sums[3u * scene.n_cells + idx] = sum.y;
    sums[4u * scene.n_cells + idx] = sum.z;
}
