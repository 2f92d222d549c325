// Crossings: where silhouettes pass through the planes of rows of cells, and the columns from
// which on that matters. A workgroup searches its edges, and some rows of texels, for pairs of an
// edge and a batch that are silhouettes and cross a level, few of all, cuts them into pieces of
// about as many steps, and shares those out: so that no lane idles beside a long one.

/// Of each row of texels.
@group(0) @binding(4) var<uniform> levels: array<Level, TABLE>;
/// In lattice steps: all x, then all y, then all z.
@group(0) @binding(5) var<storage, read> positions: array<i32>;
/// Lower vertex, higher vertex, and the triangles on its sides; of lone edges only the first.
@group(0) @binding(6) var<storage, read> edges: array<vec4<u32>>;
/// See `silhouettes`.
@group(0) @binding(7) var<storage, read> facings: array<u32>;
/// See `levels`.
@group(0) @binding(8) var<storage, read> ranks: array<u32>;

/// Pairs of an edge of the workgroup and a batch: the edge in bits 0–5, the batch in 6–9, and
/// in those above the pair's first piece. Sorted by that.
var<workgroup> queue: array<u32, QUEUE>;
/// How many pieces there are, and from bit 21 on how many pairs: one number, so that both are
/// in the same order.
var<workgroup> queued: atomic<u32>;

/// Four facings of a triangle as seen from an edge that it lies on.
fn along(side: u32, word: u32) -> u32 {
    let bytes = facings[(side & TRIANGLE) * facing_words() + word];
    return select(bytes, bytes ^ ALL_REVERSED, (side & REVERSED) != 0u);
}

/// Facings of the triangles on both sides: where they are equal, one half-edge is the other,
/// reversed, and together they add nothing. A lone half-edge always counts.
fn sides(edge_idx: u32, edge: vec4<u32>, word: u32) -> vec2<u32> {
    let one = along(edge.z, word);
    if edge_idx < frame.n_pairs {
        return vec2(one, along(edge.w, word) ^ ALL_REVERSED);
    }
    return vec2(one, one ^ ALL_REVERSED);
}

/// The directions of a block for which an edge is a silhouette.
fn silhouette(sides: vec2<u32>, block: u32) -> u32 {
    return (facing_mask(sides.x, block) ^ facing_mask(sides.y, block)) & lanes_of(block);
}

/// The levels of a piece of a pair with these directions, as a power of two: a piece has
/// `frame.piece` steps at most, and mostly more than half of them.
fn levels_of_piece(lanes: u32) -> u32 {
    return frame.piece_bits - (32u - countLeadingZeros(countOneBits(lanes) - 1u));
}

fn enqueue_row(local: u32, row: u32, sides: vec2<u32>, n_levels: u32) {
    for (var block = 0u; block < frame.n_blocks; block++) {
        let lanes = silhouette(sides, frame.first_block + block);
        if lanes == 0u {
            continue;
        }
        let bits = levels_of_piece(lanes);
        let pieces = (n_levels + (1u << bits) - 1u) >> bits;
        let place = atomicAdd(&queued, ONE_PAIR + pieces);
        let batch = row * frame.n_blocks + block;
        queue[place / ONE_PAIR] = local | (batch << 6u) | ((place % ONE_PAIR) << 10u);
    }
}

/// Of four bytes, those that are not zero, as four bits.
fn not_zero(bytes: u32) -> u32 {
    let high = (((bytes & LOW_BITS) + LOW_BITS) | bytes) & HIGH_BITS;
    return ((high >> 7u) * GATHER) >> 28u;
}

fn enqueue(edge_idx: u32, local: u32, first_row: u32) {
    let edge = edges[edge_idx];
    let end = min(first_row + frame.rows_each, frame.n_rows);
    for (var word = first_row / 4u; 4u * word < end; word++) {
        let both = sides(edge_idx, edge, word);
        let start = max(first_row, 4u * word) % 4u;
        var odd = not_zero(both.x ^ both.y) & (15u << start) & (15u >> (4u - min(4u, end - 4u * word)));
        while odd != 0u {
            let i = firstTrailingBit(odd);
            odd &= odd - 1u;
            let row = 4u * word + i;
            let rank_a = ranks[edge.x * frame.n_rows + row];
            let rank_b = ranks[edge.y * frame.n_rows + row];
            if rank_a != rank_b {
                let n_levels = max(rank_a, rank_b) - min(rank_a, rank_b);
                enqueue_row(local, row, both >> vec2(8u * i), n_levels);
            }
        }
    }
}

/// The last pair of which the first piece is not after this one.
fn pair_of(piece: u32, n_pairs: u32, n_pieces: u32) -> u32 {
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

/// An edge seen along a row of texels: relative to its first end in v and w, and in u to the
/// brick's first cell.
struct Line {
    /// v and w of the first end, and from there to the second, in lattice steps.
    start: vec2<i32>,
    along: vec2<i32>,
    /// u of the first end, and from there to the second, in cells.
    u: f32,
    along_u: f32,
    slope: f32,
    /// One over what V − b·W grows by from end to end.
    inverse: f32,
    up: bool,
}

/// u and the height above the row, in cells, at which the line crosses the level of a row.
fn crossing(line: Line, to_row: vec2<i32>, cell: f32) -> vec2<f32> {
    let row = vec2<f32>(to_row) * cell;
    let t = clamp((row.x - line.slope * row.y) * line.inverse, 0.0, 1.0);
    return vec2(line.u + t * line.along_u, t * f32(line.along.y) * cell - row.y);
}

fn line_of(edge: vec4<u32>, row: u32, up: bool) -> Line {
    let a = frame.axes * frame.n_vertices + edge.x;
    let b = frame.axes * frame.n_vertices + edge.y;
    let cell = 1.0 / f32(1u << frame.bits);
    let u = positions[a.x];
    var line: Line;
    line.start = vec2(positions[a.y], positions[a.z]);
    line.along = vec2(positions[b.y], positions[b.z]) - line.start;
    line.u = f32(u - (frame.first_cell.x << frame.bits)) * cell;
    line.along_u = f32(positions[b.x] - u) * cell;
    line.slope = row_slope(row);
    let grows = (f32(line.along.x) - line.slope * f32(line.along.y)) * cell;
    line.inverse = select(1.0 / grows, 0.0, grows == 0.0);
    line.up = up;
    return line;
}

/// Where an edge crosses a level: u and the height above the row, and the row's counters.
struct Crossing {
    at: vec2<f32>,
    first: u32,
    is_in_brick: bool,
}

/// `whole` and `order` name the level: those of one whole part are sorted by their fractions.
fn cross(line: Line, batch: u32, whole: i32, order: u32) -> Crossing {
    let level = levels[batch / frame.n_blocks * frame.cells.z + order];
    let j = whole + frame.lowest_whole - level.whole - frame.first_cell.y;
    let place = vec2(j + frame.first_cell.y, i32(level.k) + frame.first_cell.z);
    let to_row = (place << vec2(frame.bits)) - line.start;
    let side = select(1u, 0u, is_above(line.along, line.up, to_row));
    let cell = 1.0 / f32(1u << frame.bits);
    return Crossing(
        crossing(line, to_row, cell),
        first_counter(batch, u32(j), level.k, side),
        u32(j) < frame.cells.y,
    );
}

/// Counts an edge at a range of levels, for some directions of a block: `delta` layers more
/// where `more` has a bit, fewer elsewhere. One loop over all steps and not one in another:
/// invocations beside each other have different numbers of both.
fn count_levels(line: Line, batch: u32, active_lanes: u32, more: u32, delta: i32, low: u32, n_levels: u32) {
    let n = frame.cells.z;
    let first_texel = (frame.first_block + batch % frame.n_blocks) * LANES;
    var whole = i32(low / n);
    var order = low % n;
    var left = n_levels;
    var lanes = 0u;
    var crossed: Crossing;
    loop {
        if lanes == 0u {
            if left == 0u {
                break;
            }
            crossed = cross(line, batch, whole, order);
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
            let at_row = crossed.at.x - crossed.at.y * texel_slope(first_texel + lane);
            let column = u32(clamp(ceil(at_row), 0.0, f32(frame.cells.x)));
            if column < frame.cells.x {
                add_step(crossed.first, lane, column, select(-delta, delta, ((more >> lane) & 1u) != 0u));
            }
        }
    }
}

fn count_piece(edge_idx: u32, batch: u32, piece: u32) {
    let edge = edges[edge_idx];
    let row = batch / frame.n_blocks;
    let block = frame.first_block + batch % frame.n_blocks;
    let both = sides(edge_idx, edge, row / 4u) >> vec2(8u * (row % 4u));
    let active_lanes = silhouette(both, block);

    let rank_a = ranks[edge.x * frame.n_rows + row];
    let rank_b = ranks[edge.y * frame.n_rows + row];
    let bits = levels_of_piece(active_lanes);
    let low = min(rank_a, rank_b) + (piece << bits);
    let n_levels = min(1u << bits, max(rank_a, rank_b) - low);

    let up = rank_a < rank_b;
    // Seen along d, a triangle that faces it has its edges that go up at its right, where its
    // layer ends.
    let faced = facing_mask(both.x, block);
    let more = select(faced, ~faced, up);
    let delta = select(1, 2, edge_idx < frame.n_pairs);
    count_levels(line_of(edge, row, up), batch, active_lanes, more, delta, low, n_levels);
}

@compute @workgroup_size(WORKGROUP)
fn crossings(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let first = (chunk.first + group.x) * WORKGROUP;
    if first + local < frame.n_edges {
        enqueue(first + local, local, group.y * frame.rows_each);
    }
    workgroupBarrier();
    let found = atomicLoad(&queued);
    let n_pairs = found / ONE_PAIR;
    let n_pieces = found % ONE_PAIR;
    for (var piece = group.z * WORKGROUP + local; piece < n_pieces; piece += WORKGROUP * frame.parts) {
        let pair = queue[pair_of(piece, n_pairs, n_pieces)];
        count_piece(first + (pair & 63u), (pair >> 6u) & 15u, piece - (pair >> 10u));
    }
    tell_if_wrapped();
}
