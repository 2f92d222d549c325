// Crossings: the points where silhouette edges cross the planes of rows of cells, and the columns
// from which on each crossing counts. A workgroup searches its edges and some rows of texels for
// the few (edge, batch) pairs where the edge is a silhouette and crosses a level. It splits these
// pairs into pieces of about equally many deltas and distributes the pieces over its invocations,
// so that no lane idles beside a long edge.

/// The levels of each row of texels, see `Level`.
@group(0) @binding(4) var<uniform> levels: array<Level, TABLE_LEN>;
/// Vertex positions in lattice steps: all x, then all y, then all z.
@group(0) @binding(5) var<storage, read> positions: array<i32>;
/// The lower and the higher vertex of each edge, and the half-edges of its two triangles. A
/// boundary edge has only the first triangle.
@group(0) @binding(6) var<storage, read> edges: array<vec4<u32>>;
/// The facing intervals of the triangles, see `silhouettes`.
@group(0) @binding(7) var<storage, read> facing_intervals: array<u32>;
/// The ranks of the vertices, see `levels`.
@group(0) @binding(8) var<storage, read> ranks: array<u32>;

/// Pairs of an edge of the workgroup and a batch: the edge in bits 0–5, the batch in bits 6–9,
/// and the index of the pair's first piece from bit 10 on. Sorted by the first piece.
var<workgroup> queue: array<u32, QUEUE_LEN>;
/// The number of pieces in bits 0–20 and the number of pairs from bit 21 on. One atomic holds
/// both, so that pairs are queued in the order of their pieces.
var<workgroup> queued: atomic<u32>;

/// Four facing intervals of a half-edge: those of its triangle, inverted if the half-edge is
/// reversed.
fn oriented_intervals(half_edge: u32, word: u32) -> u32 {
    let bytes = facing_intervals[(half_edge & TRIANGLE_MASK) * interval_words() + word];
    return select(bytes, bytes ^ ALL_REVERSED, (half_edge & REVERSED) != 0u);
}

/// Four facing intervals of each of an edge's two triangles. Where the two are equal, the
/// half-edges are opposite and cancel. The half-edge of a boundary edge always counts.
fn edge_facing(edge_idx: u32, edge: vec4<u32>, word: u32) -> vec2<u32> {
    let first = oriented_intervals(edge.z, word);
    if edge_idx < frame.n_interior_edges {
        return vec2(first, oriented_intervals(edge.w, word) ^ ALL_REVERSED);
    }
    return vec2(first, first ^ ALL_REVERSED);
}

/// The lanes of a block for whose directions an edge is a silhouette.
fn silhouette_lanes(facing: vec2<u32>, block: u32) -> u32 {
    return (facing_mask(facing.x, block) ^ facing_mask(facing.y, block)) & lanes_of(block);
}

/// The base-2 logarithm of the number of levels in a piece of a pair with these lanes. A piece
/// has at most 2^`frame.piece_bits` deltas, and mostly more than half as many.
fn piece_levels_log2(lanes: u32) -> u32 {
    return frame.piece_bits - (32u - countLeadingZeros(countOneBits(lanes) - 1u));
}

/// Queues the pieces of an edge for one row of texels, with a pair for each block.
fn enqueue_row(local: u32, row: u32, facing: vec2<u32>, n_levels: u32) {
    for (var block = 0u; block < frame.n_blocks; block++) {
        let lanes = silhouette_lanes(facing, frame.first_block + block);
        if lanes == 0u {
            continue;
        }
        let bits = piece_levels_log2(lanes);
        let pieces = (n_levels + (1u << bits) - 1u) >> bits;
        let before = atomicAdd(&queued, ONE_PAIR + pieces);
        let batch = row * frame.n_blocks + block;
        queue[before / ONE_PAIR] = local | (batch << 6u) | ((before % ONE_PAIR) << 10u);
    }
}

/// Four bits that say which of four bytes are not zero.
fn nonzero_bytes(bytes: u32) -> u32 {
    let high = (((bytes & LOW_BITS) + LOW_BITS) | bytes) & HIGH_BITS;
    return ((high >> 7u) * GATHER) >> 28u;
}

/// Queues the pieces of an edge for the rows of texels from `first_row` on.
fn enqueue(edge_idx: u32, local: u32, first_row: u32) {
    let edge = edges[edge_idx];
    let end = min(first_row + frame.rows_per_workgroup, frame.n_rows);
    // Four rows at a time: their facing intervals share a word.
    for (var word = first_row / 4u; 4u * word < end; word++) {
        let facing = edge_facing(edge_idx, edge, word);
        let start = max(first_row, 4u * word) % 4u;
        // Rows whose two intervals differ have directions for which the edge is a silhouette.
        var rows = nonzero_bytes(facing.x ^ facing.y)
            & (15u << start) & (15u >> (4u - min(4u, end - 4u * word)));
        while rows != 0u {
            let i = firstTrailingBit(rows);
            rows &= rows - 1u;
            let row = 4u * word + i;
            let rank_a = ranks[edge.x * frame.n_rows + row];
            let rank_b = ranks[edge.y * frame.n_rows + row];
            if rank_a != rank_b {
                let n_levels = max(rank_a, rank_b) - min(rank_a, rank_b);
                enqueue_row(local, row, facing >> vec2(8u * i), n_levels);
            }
        }
    }
}

/// The pair that a piece belongs to: the last one whose first piece is not after it.
fn pair_of(piece: u32, n_pairs: u32, n_pieces: u32) -> u32 {
    // Mostly every pair has a single piece.
    if n_pairs == n_pieces {
        return piece;
    }
    var low = 0u;
    var high = n_pairs;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if (queue[middle] >> 10u) <= piece {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/// An edge as seen from a row of texels: relative to its lower vertex in v and w, and to the
/// brick's first cell in u.
struct EdgeLine {
    /// v and w of the lower vertex, and the vector from there to the higher, in lattice steps.
    start: vec2<i32>,
    delta: vec2<i32>,
    /// u of the lower vertex, and the difference from there to the higher, in cells.
    u: f32,
    delta_u: f32,
    slope: f32,
    /// The reciprocal of the increase of V − b·W along the edge.
    inverse: f32,
    /// Whether V − b·W increases along the edge.
    up: bool,
}

/// u and the height above the row, in cells, at which the line crosses the level of a row.
fn crossing(line: EdgeLine, to_row: vec2<i32>, cell: f32) -> vec2<f32> {
    let row = vec2<f32>(to_row) * cell;
    let t = clamp((row.x - line.slope * row.y) * line.inverse, 0.0, 1.0);
    return vec2(line.u + t * line.delta_u, t * f32(line.delta.y) * cell - row.y);
}

fn edge_line(edge: vec4<u32>, row: u32, up: bool) -> EdgeLine {
    let a = frame.axes * frame.n_vertices + edge.x;
    let b = frame.axes * frame.n_vertices + edge.y;
    let cell = 1.0 / f32(1u << frame.bits);
    let u = positions[a.x];
    var line: EdgeLine;
    line.start = vec2(positions[a.y], positions[a.z]);
    line.delta = vec2(positions[b.y], positions[b.z]) - line.start;
    // Differences are taken in integers, so that each is rounded only once.
    line.u = f32(u - (frame.first_cell.x << frame.bits)) * cell;
    line.delta_u = f32(positions[b.x] - u) * cell;
    line.slope = row_slope(row);
    let increase = (f32(line.delta.x) - line.slope * f32(line.delta.y)) * cell;
    line.inverse = select(1.0 / increase, 0.0, increase == 0.0);
    line.up = up;
    return line;
}

/// The crossing of an edge and a level.
struct Crossing {
    /// u and the height above the row, in cells.
    point: vec2<f32>,
    /// The first counter of the row's side on which the edge passes.
    first: u32,
    is_in_brick: bool,
}

/// The crossing of an edge and a level. The level is given by its whole part and by its index
/// `order` among the levels of that whole part, which are sorted by their fractions.
fn cross_level(line: EdgeLine, batch: u32, whole: i32, order: u32) -> Crossing {
    let level = levels[batch / frame.n_blocks * frame.cells.z + order];
    let j = whole + frame.lowest_whole - level.whole - frame.first_cell.y;
    let row = vec2(j + frame.first_cell.y, i32(level.k) + frame.first_cell.z);
    let to_row = (row << vec2(frame.bits)) - line.start;
    let side = select(1u, 0u, is_above(line.delta, line.up, to_row));
    let cell = 1.0 / f32(1u << frame.bits);
    return Crossing(
        crossing(line, to_row, cell),
        first_counter(batch, u32(j), level.k, side),
        u32(j) < frame.cells.y,
    );
}

/// Counts an edge at a range of levels, for some lanes of a block: adds `delta` layers in the
/// lanes of `added_lanes` and removes as many in the other active lanes. A single loop over all
/// deltas instead of two nested ones: neighboring invocations differ in the numbers of levels and
/// lanes, and nested loops would wait for the larger of each.
fn count_levels(
    line: EdgeLine,
    batch: u32,
    active_lanes: u32,
    added_lanes: u32,
    delta: i32,
    low: u32,
    n_levels: u32,
) {
    let n = frame.cells.z;
    let first_texel = (frame.first_block + batch % frame.n_blocks) * LANES;
    var whole = i32(low / n);
    var order = low % n;
    var left = n_levels;
    var lanes = 0u;
    var crossed: Crossing;
    loop {
        // The lanes of the last level are done: go on to the next level.
        if lanes == 0u {
            if left == 0u {
                break;
            }
            crossed = cross_level(line, batch, whole, order);
            lanes = select(0u, active_lanes, crossed.is_in_brick);
            left--;
            order++;
            if order == n {
                order = 0u;
                whole++;
            }
        }
        if lanes != 0u {
            let lane = firstTrailingBit(lanes);
            lanes &= lanes - 1u;
            // Project the crossing along the direction onto the row.
            let row_u = crossed.point.x - crossed.point.y * texel_slope(first_texel + lane);
            let column = u32(clamp(ceil(row_u), 0.0, f32(frame.cells.x)));
            if column < frame.cells.x {
                add_delta(
                    crossed.first,
                    lane,
                    column,
                    select(-delta, delta, ((added_lanes >> lane) & 1u) != 0u),
                );
            }
        }
    }
}

fn count_piece(edge_idx: u32, batch: u32, piece: u32) {
    let edge = edges[edge_idx];
    let row = batch / frame.n_blocks;
    let block = frame.first_block + batch % frame.n_blocks;
    let facing = edge_facing(edge_idx, edge, row / 4u) >> vec2(8u * (row % 4u));
    let active_lanes = silhouette_lanes(facing, block);

    let rank_a = ranks[edge.x * frame.n_rows + row];
    let rank_b = ranks[edge.y * frame.n_rows + row];
    let bits = piece_levels_log2(active_lanes);
    let low = min(rank_a, rank_b) + (piece << bits);
    let n_levels = min(1u << bits, max(rank_a, rank_b) - low);

    let up = rank_a < rank_b;
    // Seen along d, the upward edges of a triangle that faces d are on its right, where its layer
    // ends.
    let facing_lanes = facing_mask(facing.x, block);
    let added_lanes = select(facing_lanes, ~facing_lanes, up);
    // The two half-edges of an interior silhouette edge add the same delta.
    let delta = select(1, 2, edge_idx < frame.n_interior_edges);
    count_levels(edge_line(edge, row, up), batch, active_lanes, added_lanes, delta, low, n_levels);
}

@compute @workgroup_size(WORKGROUP)
fn crossings(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let first = (chunk.first + group.x) * WORKGROUP;
    if first + local < frame.n_edges {
        enqueue(first + local, local, group.y * frame.rows_per_workgroup);
    }
    workgroupBarrier();
    let total = atomicLoad(&queued);
    let n_pairs = total / ONE_PAIR;
    let n_pieces = total % ONE_PAIR;
    // Distribute the pieces over this workgroup and the others along z, which have searched the
    // same edges and rows.
    for (var piece = group.z * WORKGROUP + local; piece < n_pieces; piece += WORKGROUP * frame.n_parts) {
        let pair = queue[pair_of(piece, n_pairs, n_pieces)];
        count_piece(first + (pair & 63u), (pair >> 6u) & 15u, piece - (pair >> 10u));
    }
    report_overflow();
}
