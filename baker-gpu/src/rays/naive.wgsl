// What all the others do, as plainly as it can be said: an invocation takes a cell, and asks
// every triangle about every texel of its six faces.

/// Through each texel's centre: a vector with a major component of ±1, and its length.
@group(0) @binding(5) var<storage, read> directions: array<vec4<f32>>;
/// Shares of moment 1 and of moment 0, in steps of 2⁻³⁰.
@group(0) @binding(6) var<storage, read> shares: array<vec4<i32>>;
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
        let ray = ray_from(sample_of(scene.first_cell + idx), direction.xyz, direction.w);
        var hidden = false;
        for (var triangle = 0u; triangle < scene.n_triangles; triangle++) {
            if meets(ray, triangle) {
                hidden = true;
                break;
            }
        }
        if hidden {
            count++;
            sum += shares[texel];
        }
    }
    sums[idx] = count;
    sums[scene.n_cells + idx] = sum.w;
    sums[2u * scene.n_cells + idx] = sum.x;
    sums[3u * scene.n_cells + idx] = sum.y;
    sums[4u * scene.n_cells + idx] = sum.z;
}
