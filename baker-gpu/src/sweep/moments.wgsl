// The moments of each cell: sums of integers, which do not depend on the order of summation.

/// The occluded directions of each cell and batch, see `summation`.
@group(0) @binding(2) var<storage, read> masks: array<u32>;
/// A lookup table of subset sums: for each group of four bits of each batch's mask, the moment 1
/// (xyz) and moment 0 (w) of each of the 16 subsets of these texels, in steps of 2⁻³⁰.
@group(0) @binding(3) var<uniform> subset_sums: array<vec4<i32>, TABLE_LEN>;
/// All counts, then all a, then all m.x, all m.y, all m.z, of the cells of the brick, x fastest.
@group(0) @binding(4) var<storage, read_write> sums: array<i32>;

@compute @workgroup_size(WORKGROUP)
fn moments(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let idx = (chunk.first + group.x) * WORKGROUP + local;
    let n = frame.cells;
    let n_cells = n.x * n.y * n.z;
    if idx >= n_cells {
        return;
    }
    var count = 0u;
    var sum = vec4(0);
    let batches = frame.n_rows * frame.n_blocks;
    for (var batch = 0u; batch < batches; batch++) {
        let mask = masks[batch * n_cells + idx];
        count += countOneBits(mask);
        // Four directions of d and four of −d at a time, until no bits are left.
        var forward = mask & 0xffffu;
        var backward = mask >> 16u;
        var first = batch * SUBSET_SUMS;
        while (forward | backward) != 0u {
            sum += subset_sums[first + (forward & 15u)];
            sum += subset_sums[first + SUBSET_SUMS / 2u + (backward & 15u)];
            forward >>= 4u;
            backward >>= 4u;
            first += 16u;
        }
    }
    if count == 0u {
        return;
    }
    // Masks are in the order u, w, v (v fastest); sums are in the order z, y, x (x fastest).
    let u = idx / (n.y * n.z);
    let v = idx % n.y;
    let w = (idx / n.y) % n.z;
    // The strides of the brick's cells: 1 for x, n_x for y, n_x·n_y for z.
    let is_x = frame.axes == vec3(0u);
    let is_y = frame.axes == vec3(1u);
    let sizes_x = select(vec3(0u), n, is_x);
    let n_x = sizes_x.x + sizes_x.y + sizes_x.z;
    let sizes_y = select(vec3(0u), n, is_y);
    let n_y = sizes_y.x + sizes_y.y + sizes_y.z;
    let strides = select(select(vec3(n_x * n_y), vec3(n_x), is_y), vec3(1u), is_x);
    let cell = u * strides.x + v * strides.y + w * strides.z;
    sums[cell] += i32(count);
    sums[n_cells + cell] += sum.w;
    if WITH_DIRECTIONS {
        sums[2u * n_cells + cell] += sum.x;
        sums[3u * n_cells + cell] += sum.y;
        sums[4u * n_cells + cell] += sum.z;
    }
}
