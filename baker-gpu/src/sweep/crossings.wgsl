// Crossings: where silhouettes pass through the planes of rows of cells, and the columns from
// which on that matters. A workgroup searches its edges for pairs of an edge and a row of
// texels that are silhouettes and cross a level, few of all, and then shares them out: so
// that no lane idles beside a long one more than it must.

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

/// An edge of the workgroup and a row of texels: local number, row from bit 8 on.
var<workgroup> queue: array<u32, QUEUE>;
var<workgroup> queued: atomic<u32>;

/// Four facings of a triangle as seen from an edge that it lies on.
fn along(side: u32, word: u32) -> u32 {
    let bytes = facings[(side & TRIANGLE) * facing_words() + word];
    return select(bytes, bytes ^ ALL_REVERSED, (side & REVERSED) != 0u);
}

fn enqueue(edge_idx: u32, local: u32) {
    let edge = edges[edge_idx];
    let words = facing_words();
    for (var word = 0u; word < words; word++) {
        var odd = 0xffffffffu;
        if edge_idx < frame.n_pairs {
            // Two half-edges add nothing where one is the other, reversed.
            odd = along(edge.z, word) ^ along(edge.w, word) ^ ALL_REVERSED;
        }
        for (var row = 4u * word; odd != 0u && row < frame.n_rows; row++) {
            let is_odd = (odd & 255u) != 0u;
            odd >>= 8u;
            let rank_a = ranks[edge.x * frame.n_rows + row];
            if is_odd && rank_a != ranks[edge.y * frame.n_rows + row] {
                queue[atomicAdd(&queued, 1u)] = local | (row << 8u);
            }
        }
    }
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

/// Counts a crossing for the directions of a block: `delta` layers more where `more` has a
/// bit, fewer elsewhere.
fn count(first: u32, block: u32, at: vec2<f32>, active_lanes: u32, more: u32, delta: i32) {
    var lanes = active_lanes;
    while lanes != 0u {
        let lane = firstTrailingBit(lanes);
        lanes &= lanes - 1u;
        let at_row = at.x - at.y * texel_slope(block * LANES + lane);
        let column = u32(clamp(ceil(at_row), 0.0, f32(frame.cells.x)));
        if column < frame.cells.x {
            add_step(first, lane, column, select(-delta, delta, ((more >> lane) & 1u) != 0u));
        }
    }
}

/// Counts an edge at every `parts`-th level that it crosses, for one block of directions.
fn cross_levels(line: Line, row: u32, block: u32, active_lanes: u32, more: u32, delta: i32, low: u32, high: u32) {
    let n = frame.cells.z;
    let cell = 1.0 / f32(1u << frame.bits);
    let batch = row * frame.n_blocks + block - frame.first_block;
    for (var number = low; number < high; number += frame.parts) {
        let level = levels[row * n + number % n];
        let j = i32(number / n) + frame.lowest_whole - level.whole - frame.first_cell.y;
        if u32(j) >= frame.cells.y {
            continue;
        }
        let place = vec2(j + frame.first_cell.y, i32(level.k) + frame.first_cell.z);
        let to_row = (place << vec2(frame.bits)) - line.start;
        let side = select(1u, 0u, is_above(line.along, line.up, to_row));
        let first = first_counter(batch, u32(j), level.k, side);
        count(first, block, crossing(line, to_row, cell), active_lanes, more, delta);
    }
}

fn count_edge(edge_idx: u32, row: u32, part: u32) {
    let edge = edges[edge_idx];
    let rank_a = ranks[edge.x * frame.n_rows + row];
    let rank_b = ranks[edge.y * frame.n_rows + row];
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
    line.up = rank_a < rank_b;

    let shift = 8u * (row % 4u);
    let one = along(edge.z, row / 4u) >> shift;
    let is_pair = edge_idx < frame.n_pairs;
    var other = one;
    if is_pair {
        other = along(edge.w, row / 4u) >> shift;
    }
    let low = min(rank_a, rank_b) + part;
    let high = max(rank_a, rank_b);
    for (var block = frame.first_block; block < frame.first_block + frame.n_blocks; block++) {
        let faced = facing_mask(one, block);
        let active_lanes = ~(faced ^ facing_mask(other, block)) & lanes_of(block);
        // Seen along d, a triangle that faces it has its edges that go up at its right, where
        // its layer ends.
        let more = select(faced, ~faced, line.up);
        if active_lanes != 0u {
            cross_levels(line, row, block, active_lanes, more, select(1, 2, is_pair), low, high);
        }
    }
}

@compute @workgroup_size(WORKGROUP)
fn crossings(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let first = (chunk.first + group.x) * WORKGROUP;
    if first + local < frame.n_edges {
        enqueue(first + local, local);
    }
    workgroupBarrier();
    let n = atomicLoad(&queued);
    for (var i = local; i < n; i += WORKGROUP) {
        count_edge(first + (queue[i] & 255u), queue[i] >> 8u, group.z);
    }
}
