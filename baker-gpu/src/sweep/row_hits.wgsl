// Row hits: the points where the line of a row of cells passes through a triangle. The triangle's
// layer is above the row on one side of the hit and below it on the other. The CPU has found the
// triangles and rows that come close to each other, and the exact side of the row on which each
// edge passes; whether two edges cross the row's level, and on different sides, depends on ranks.

/// A triangle and a row of cells that come close to each other.
struct RowHitCandidate {
    /// The triangle's vertices.
    corners: vec3<u32>,
    triangle: u32,
    /// The row of cells in the brick: j in bits 0–15, k from bit 16 on.
    row: u32,
    /// The first column not to the left of the hit.
    column: u32,
    /// The edge from corner i to the next has in bits 2i and 2i+1 the side on which it passes the
    /// row (above, below, above if it goes up, above if it goes down), and in bit 6+i whether it
    /// runs from the higher vertex index to the lower.
    edges: u32,
    unused: u32,
}

/// The levels of each row of texels, see `Level`.
@group(0) @binding(4) var<uniform> levels: array<Level, TABLE_LEN>;
/// The facing intervals of the triangles, see `silhouettes`.
@group(0) @binding(5) var<storage, read> facing_intervals: array<u32>;
/// The ranks of the vertices, see `levels`.
@group(0) @binding(6) var<storage, read> ranks: array<u32>;
/// The candidates for row hits.
@group(0) @binding(7) var<storage, read> candidates: array<RowHitCandidate>;

/// Whether edge i passes above the row; `up` says whether it goes up in the triangle's own order.
fn passes_above(edges: u32, i: u32, up: bool) -> bool {
    let side = (edges >> (2u * i)) & 3u;
    let is_reversed = ((edges >> (6u + i)) & 1u) != 0u;
    return side == ABOVE || (side == ABOVE_IF_UP && up != is_reversed)
        || (side == ABOVE_IF_DOWN && up == is_reversed);
}

@compute @workgroup_size(WORKGROUP)
fn piercings(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let idx = (chunk.first + group.x) * WORKGROUP + local;
    let row = group.y;
    if idx >= frame.n_candidates {
        return;
    }
    let candidate = candidates[idx];
    let j = candidate.row & 0xffffu;
    let k = candidate.row >> 16u;
    let n = frame.cells.z;
    let order = levels[row * n + k].order;
    let whole = levels[row * n + order].whole + i32(j) + frame.first_cell.y;
    let level = u32(whole - frame.lowest_whole) * n + order;

    let corners = candidate.corners * frame.n_rows + row;
    let is_below = vec3(ranks[corners.x], ranks[corners.y], ranks[corners.z]) <= vec3(level);
    // An edge goes up through the level if its first end is below and its second is not.
    let crosses = is_below != is_below.yzx;
    let above = vec3(
        crosses.x && passes_above(candidate.edges, 0u, is_below.x),
        crosses.y && passes_above(candidate.edges, 1u, is_below.y),
        crosses.z && passes_above(candidate.edges, 2u, is_below.z),
    );
    // Either two edges cross the level or none. The row hits the triangle if one crosses above
    // the row and the other below.
    if u32(above.x) + u32(above.y) + u32(above.z) != 1u || candidate.column >= frame.cells.x {
        return;
    }
    let up = any(above & is_below);
    let interval = facing_intervals[candidate.triangle * interval_words() + row / 4u]
        >> (8u * (row % 4u));
    for (var block = 0u; block < frame.n_blocks; block++) {
        let facing_lanes = facing_mask(interval, frame.first_block + block);
        // The layer that the edge above the row opened or closed moves from the counters above
        // to those below.
        let added_lanes = select(~facing_lanes, facing_lanes, up);
        let batch = row * frame.n_blocks + block;
        let first_above = first_counter(batch, j, k, 0u);
        let first_below = first_counter(batch, j, k, 1u);
        let n_lanes = countOneBits(lanes_of(frame.first_block + block));
        for (var lane = 0u; lane < n_lanes; lane++) {
            let delta = select(-1, 1, ((added_lanes >> lane) & 1u) != 0u);
            add_delta(first_above, lane, candidate.column, delta);
            add_delta(first_below, lane, candidate.column, -delta);
        }
    }
    report_overflow();
}
