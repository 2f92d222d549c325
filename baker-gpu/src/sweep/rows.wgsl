// Rows of counters as both summations read them. An invocation takes one row and batch, reads its
// counters, and resets them to zero. It visits only the columns to which the mesh's bounds
// confine the deltas: mostly a quarter.

/// The counters of `counters`, without atomics because each is accessed by one invocation only.
@group(0) @binding(2) var<storage, read_write> deltas: array<u32>;
/// The occluded directions of each cell: those of d in bits 0–15, of −d in bits 16–31. In the
/// order batch, column, k, j. Zero before this pass.
@group(0) @binding(3) var<storage, read_write> masks: array<u32>;

/// Reads the counter `counter` of four consecutive planes, and resets it to zero.
fn take_deltas(counter: u32, plane: u32) -> vec4<u32> {
    let taken = vec4(
        deltas[counter],
        deltas[counter + plane],
        deltas[counter + 2u * plane],
        deltas[counter + 3u * plane],
    );
    // Most counters are zero: skip their write.
    if any(taken != vec4(0u)) {
        deltas[counter] = 0u;
        deltas[counter + plane] = 0u;
        deltas[counter + 2u * plane] = 0u;
        deltas[counter + 3u * plane] = 0u;
    }
    return taken;
}

/// A row of cells and a batch, with the columns to which the bounds of the mesh confine deltas.
struct CounterRow {
    /// The index of the first counter of column 0.
    counter: u32,
    /// The index of the mask of column 0.
    mask: u32,
    /// The range of columns with deltas: from `first`, up to but excluding `end`.
    first: u32,
    end: u32,
    /// Whether the mesh reaches above the row, and below it.
    above: bool,
    below: bool,
}

fn counter_row(group: vec3<u32>, local: u32) -> CounterRow {
    let row = (chunk.first + group.x) * WORKGROUP + local;
    let rows = frame.cells.y * frame.cells.z;
    let j = row % frame.cells.y;
    let k = row / frame.cells.y;
    let batch = group.y;
    let counter = (batch * frame.cells.z + k) * 2u * SIDE_PLANES * plane() + j;
    let heights = vec2(frame.mesh_low.z, frame.mesh_high.z) - f32(k);

    // The range of v of the row's plane between those heights.
    let v = f32(j) + row_slope(batch / frame.n_blocks) * heights;
    let is_beside = max(v.x, v.y) < frame.mesh_low.y || min(v.x, v.y) > frame.mesh_high.y;
    let columns = active_columns(heights, frame.first_block + batch % frame.n_blocks);
    let is_empty = is_beside || row >= rows;
    return CounterRow(
        counter,
        batch * frame.cells.x * rows + row,
        columns.x,
        select(columns.y, 0u, is_empty),
        heights.y > 0.0,
        heights.x < 0.0,
    );
}

/// The range of columns that may have deltas of a mesh between these heights above a row: first
/// and end.
fn active_columns(heights: vec2<f32>, block: u32) -> vec2<u32> {
    let first_texel = block * LANES;
    let slopes = vec2(texel_slope(first_texel), texel_slope(min(first_texel + LANES, frame.size) - 1u));
    // The shift along u from a point of the mesh to the row is linear in slope and height, so
    // that its extremes are at their ends.
    let shifts = vec4(slopes.x * heights, slopes.y * heights);
    let min_shift = min(min(shifts.x, shifts.y), min(shifts.z, shifts.w));
    let max_shift = max(max(shifts.x, shifts.y), max(shifts.z, shifts.w));
    let low = floor(frame.mesh_low.x - max_shift);
    let high = ceil(frame.mesh_high.x - min_shift) + 1.0;
    return vec2<u32>(clamp(vec2(low, high), vec2(0.0), vec2(f32(frame.cells.x))));
}

fn plane() -> u32 {
    return frame.cells.x * frame.cells.y;
}
