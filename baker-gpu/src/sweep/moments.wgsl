// The moments of each cell: sums of whole numbers, which no order changes.

/// See `summation`.
@group(0) @binding(2) var<storage, read> masks: array<u32>;
/// For each four bits of each batch's mask, the sums over all sets of them of the shares of
/// moment 1 and of moment 0, in steps of 2⁻³⁰.
@group(0) @binding(3) var<uniform> shares: array<vec4<i32>, TABLE>;
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
        // Both halves at a time, as far as there are bits.
        var ahead = mask & 0xffffu;
        var behind = mask >> 16u;
        var first = batch * SHARES;
        while (ahead | behind) != 0u {
            sum += shares[first + (ahead & 15u)];
            sum += shares[first + SHARES / 2u + (behind & 15u)];
            ahead >>= 4u;
            behind >>= 4u;
            first += 16u;
        }
    }
    if count == 0u {
        return;
    }
    // Masks are in the order u, w, v.
    let u = idx / (n.y * n.z);
    let v = idx % n.y;
    let w = (idx / n.y) % n.z;
    // Strides of the brick's cells: of x 1, of y n_x, of z n_x·n_y.
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
    if DIRECTIONS {
        sums[2u * n_cells + cell] += sum.x;
        sums[3u * n_cells + cell] += sum.y;
        sums[4u * n_cells + cell] += sum.z;
    }
}
