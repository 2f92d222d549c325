// The six cube faces of a cell by ray casting. A workgroup takes a cell and some of its texels;
// neighboring invocations take neighboring texels, whose rays mostly visit the same nodes.

/// The directions through the texel centers: a vector with a major component of ±1, and its
/// length.
@group(0) @binding(5) var<storage, read> directions: array<vec4<f32>>;
/// The moment 1 (xyz) and moment 0 (w) of each texel, in steps of 2⁻³⁰.
@group(0) @binding(6) var<storage, read> texel_moments: array<vec4<i32>>;
/// All counts, then all a, then all m.x, all m.y, all m.z.
@group(0) @binding(7) var<storage, read_write> sums: array<atomic<u32>>;
/// The texels of each cell as bits, if `BITS` is set.
@group(0) @binding(8) var<storage, read_write> bits: array<atomic<u32>>;

/// The count, a, m.x, m.y and m.z of this workgroup's texels.
var<workgroup> group_sums: array<atomic<u32>, 5>;

@compute @workgroup_size(WORKGROUP)
fn faces(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let idx = chunk.first + group.x;
    let origin = sample_position(scene.first_cell + idx);
    let words = (scene.n_directions + 31u) / 32u;
    var count = 0u;
    var sum = vec4(0);
    let end = min((group.y + 1u) * TEXELS_PER_WORKGROUP, scene.n_directions);
    for (var texel = group.y * TEXELS_PER_WORKGROUP + local; texel < end; texel += WORKGROUP) {
        let direction = directions[texel];
        if is_occluded(ray_from(origin, direction.xyz, direction.w)) {
            count++;
            if WITH_DIRECTIONS {
                sum += texel_moments[texel];
            } else {
                sum.w += texel_moments[texel].w;
            }
            if BITS {
                atomicOr(&bits[idx * words + texel / 32u], 1u << (texel % 32u));
            }
        }
    }
    if count > 0u {
        atomicAdd(&group_sums[0], count);
        // Two's complement: signed sums add up the same in unsigned atomics.
        let words_of_sum = bitcast<vec4<u32>>(sum);
        atomicAdd(&group_sums[1], words_of_sum.w);
        atomicAdd(&group_sums[2], words_of_sum.x);
        atomicAdd(&group_sums[3], words_of_sum.y);
        atomicAdd(&group_sums[4], words_of_sum.z);
    }
    workgroupBarrier();
    if local < 5u {
        atomicAdd(&sums[local * scene.n_cells + idx], atomicLoad(&group_sums[local]));
    }
}
