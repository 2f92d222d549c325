// Piercings: where the line of a row of cells itself passes through a triangle, whose layer is
// above the row on one side of that point and below on the other. Triangles and rows that come
// near each other are found beforehand, with the exact sides on which the edges pass; whether
// two edges cross the row's level, and on different sides, depends on ranks.

struct Piercing {
    /// The triangle's corners.
    corners: vec3<u32>,
    triangle: u32,
    /// The row of cells in the brick: j, and k from bit 16 on.
    row: u32,
    /// The first column to the right of the point.
    column: u32,
    /// Of the edge from corner i to the next: in bits 2i and 2i+1 where it passes (above,
    /// below, or above if it goes up, or above if it goes down), in bit 6+i whether it leads
    /// from the higher vertex to the lower.
    edges: u32,
    unused: u32,
}

/// Of each row of texels.
@group(0) @binding(4) var<uniform> levels: array<Level, TABLE>;
/// See `silhouettes`.
@group(0) @binding(5) var<storage, read> facings: array<u32>;
/// See `levels`.
@group(0) @binding(6) var<storage, read> ranks: array<u32>;
/// What may be one.
@group(0) @binding(7) var<storage, read> candidates: array<Piercing>;

/// Whether edge i, which runs up along the triangle or not, passes above the row.
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
    if idx >= frame.n_piercings {
        return;
    }
    let candidate = candidates[idx];
    let j = candidate.row & 0xffffu;
    let k = candidate.row >> 16u;
    let n = frame.cells.z;
    let order = levels[row * n + k].order;
    let whole = levels[row * n + order].whole + i32(j) + frame.first_cell.y;
    let number = u32(whole - frame.lowest_whole) * n + order;

    let corners = candidate.corners * frame.n_rows + row;
    let is_below = vec3(ranks[corners.x], ranks[corners.y], ranks[corners.z]) <= vec3(number);
    // An edge crosses the level from below if its first end is below and its second is not.
    let crosses = is_below != is_below.yzx;
    let above = vec3(
        crosses.x && passes_above(candidate.edges, 0u, is_below.x),
        crosses.y && passes_above(candidate.edges, 1u, is_below.y),
        crosses.z && passes_above(candidate.edges, 2u, is_below.z),
    );
    // Two edges cross or none: one above and one below, or there is no piercing.
    if u32(above.x) + u32(above.y) + u32(above.z) != 1u || candidate.column >= frame.cells.x {
        return;
    }
    let up = any(above & is_below);
    let facing = facings[candidate.triangle * facing_words() + row / 4u] >> (8u * (row % 4u));
    for (var block = 0u; block < frame.n_blocks; block++) {
        let faced = facing_mask(facing, frame.first_block + block);
        // From above goes what the edge above added, to below the same.
        let more = select(~faced, faced, up);
        let batch = row * frame.n_blocks + block;
        let first_above = first_counter(batch, j, k, 0u);
        let first_below = first_counter(batch, j, k, 1u);
        let n_lanes = countOneBits(lanes_of(frame.first_block + block));
        for (var lane = 0u; lane < n_lanes; lane++) {
            let delta = select(-1, 1, ((more >> lane) & 1u) != 0u);
            add_step(first_above, lane, candidate.column, delta);
            add_step(first_below, lane, candidate.column, -delta);
        }
    }
    tell_if_wrapped();
}
