// Six faces of texels around a cell by rays: a workgroup takes a cell and a piece of its texels,
// neighbouring invocations neighbouring texels, which mostly walk the same nodes.

/// Through each texel's centre: a vector with a major component of ±1, and its length.
@group(0) @binding(5) var<storage, read> directions: array<vec4<f32>>;
/// Shares of moment 1 and of moment 0, in steps of 2⁻³⁰.
@group(0) @binding(6) var<storage, read> shares: array<vec4<i32>>;
/// All counts, then all a, then all m.x, all m.y, all m.z.
@group(0) @binding(7) var<storage, read_write> sums: array<atomic<u32>>;
/// The texels of each cell as bits, where they are asked for.
@group(0) @binding(8) var<storage, read_write> bits: array<atomic<u32>>;

var<workgroup> of_cell: array<atomic<u32>, 5>;

@compute @workgroup_size(WORKGROUP)
fn faces(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let idx = chunk.first + group.x;
    let origin = sample_of(scene.first_cell + idx);
    let words = (scene.n_directions + 31u) / 32u;
    var count = 0u;
    var sum = vec4(0);
    let end = min((group.y + 1u) * TEXELS, scene.n_directions);
    for (var texel = group.y * TEXELS + local; texel < end; texel += WORKGROUP) {
        let direction = directions[texel];
        if is_hidden(ray_from(origin, direction.xyz, direction.w)) {
            count++;
            if DIRECTIONS {
                sum += shares[texel];
            } else {
                sum.w += shares[texel].w;
            }
            if BITS {
                atomicOr(&bits[idx * words + texel / 32u], 1u << (texel % 32u));
            }
        }
    }
    if count > 0u {
        atomicAdd(&of_cell[0], count);
        let sums_of_texels = bitcast<vec4<u32>>(sum);
        atomicAdd(&of_cell[1], sums_of_texels.w);
        atomicAdd(&of_cell[2], sums_of_texels.x);
        atomicAdd(&of_cell[3], sums_of_texels.y);
        atomicAdd(&of_cell[4], sums_of_texels.z);
    }
    workgroupBarrier();
    if local < 5u {
        atomicAdd(&sums[local * scene.n_cells + idx], atomicLoad(&of_cell[local]));
    }
}
