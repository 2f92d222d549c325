// Rows of counters as both summations read them: an invocation takes one row and batch, reads
// its counters, and leaves them zero. It looks only where the mesh's bounds leave something to
// be found: mostly a quarter.

/// See `counters`; here nobody else writes.
@group(0) @binding(2) var<storage, read_write> steps: array<u32>;
/// Occluded directions of each cell: those of d in bits 0–15, of −d in 16–31. In the order
/// batch, column, k, j. Zero beforehand.
@group(0) @binding(3) var<storage, read_write> masks: array<u32>;

/// Four planes of counters from `place` on, which are zeroed.
fn take(place: u32, plane: u32) -> vec4<u32> {
    let found = vec4(
        steps[place],
        steps[place + plane],
        steps[place + 2u * plane],
        steps[place + 3u * plane],
    );
    if any(found != vec4(0u)) {
        steps[place] = 0u;
        steps[place + plane] = 0u;
        steps[place + 2u * plane] = 0u;
        steps[place + 3u * plane] = 0u;
    }
    return found;
}

/// A row of cells and a batch, and what the bounds of the mesh leave of it.
struct Row {
    /// Counters of column 0.
    place: u32,
    /// Masks of column 0.
    mask: u32,
    /// Columns with steps: none before `first` and from `end` on.
    first: u32,
    end: u32,
    /// Whether something is above the row, and below.
    above: bool,
    below: bool,
}

fn row_of(group: vec3<u32>, local: u32) -> Row {
    let row = (chunk.first + group.x) * WORKGROUP + local;
    let rows = frame.cells.y * frame.cells.z;
    let j = row % frame.cells.y;
    let k = row / frame.cells.y;
    let batch = group.y;
    let place = (batch * frame.cells.z + k) * 2u * SIDE_PLANES * plane() + j;
    let heights = vec2(frame.mesh_low.z, frame.mesh_high.z) - f32(k);

    // Of the plane of the row, between those heights.
    let v = f32(j) + row_slope(batch / frame.n_blocks) * heights;
    let is_beside = max(v.x, v.y) < frame.mesh_low.y || min(v.x, v.y) > frame.mesh_high.y;
    let columns = columns_of(heights, frame.first_block + batch % frame.n_blocks);
    let is_out = is_beside || row >= rows;
    return Row(
        place,
        batch * frame.cells.x * rows + row,
        columns.x,
        select(columns.y, 0u, is_out),
        heights.y > 0.0,
        heights.x < 0.0,
    );
}

/// From which column to which a mesh between these heights above a row has steps.
fn columns_of(heights: vec2<f32>, block: u32) -> vec2<u32> {
    let first_texel = block * LANES;
    let slopes = vec2(texel_slope(first_texel), texel_slope(min(first_texel + LANES, frame.size) - 1u));
    let ends = vec4(slopes.x * heights, slopes.y * heights);
    let least = min(min(ends.x, ends.y), min(ends.z, ends.w));
    let most = max(max(ends.x, ends.y), max(ends.z, ends.w));
    let low = floor(frame.mesh_low.x - most);
    let high = ceil(frame.mesh_high.x - least) + 1.0;
    return vec2<u32>(clamp(vec2(low, high), vec2(0.0), vec2(f32(frame.cells.x))));
}

fn plane() -> u32 {
    return frame.cells.x * frame.cells.y;
}
