// Summation: from differences along a row of cells to the texels of its cells. An invocation
// takes one row and batch, reads its counters, and leaves them zero. It looks only where the
// mesh's bounds leave something to be found: mostly a quarter.

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

/// Layers so far of the sixteen directions of a side, two a word: words `even` hold bytes 0
/// and 2 of a word of counters, words `odd` 1 and 3. A brick has so few columns that 16 bits
/// hold every sum of bytes; they are biased so as not to borrow from each other.
struct Layers {
    even: vec4<u32>,
    odd: vec4<u32>,
}

fn add(layers: ptr<function, Layers>, steps: vec4<u32>) {
    let bytes = steps + vec4(BYTE_BIAS);
    (*layers).even += (bytes & vec4(EVEN_BYTES)) - vec4(EVEN_BYTE_BIAS);
    (*layers).odd += ((bytes >> vec4(8u)) & vec4(EVEN_BYTES)) - vec4(EVEN_BYTE_BIAS);
}

/// Bits 15 and 31 of each word: whether its halves are not the bias.
fn not_zero(halves: vec4<u32>) -> vec4<u32> {
    let unbiased = halves ^ vec4(HALF_BIAS);
    return (((unbiased & vec4(~HALF_BIAS)) + vec4(~HALF_BIAS)) | unbiased) & vec4(HALF_BIAS);
}

/// Sixteen bits: the directions with layers.
fn occluded(layers: Layers) -> u32 {
    let even = not_zero(layers.even);
    let odd = not_zero(layers.odd);
    let nibbles = (even >> vec4(15u)) & vec4(1u) | (odd >> vec4(14u)) & vec4(2u)
        | (even >> vec4(29u)) & vec4(4u) | (odd >> vec4(28u)) & vec4(8u);
    return nibbles.x | (nibbles.y << 4u) | (nibbles.z << 8u) | (nibbles.w << 12u);
}

/// Four bits: which of four layers there are.
fn occluded_of_four(layers: vec4<u32>) -> u32 {
    let bits = select(vec4(0u), vec4(1u, 2u, 4u, 8u), layers != vec4(0u));
    return bits.x | bits.y | bits.z | bits.w;
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

@compute @workgroup_size(WORKGROUP)
fn summation(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let row = row_of(group, local);
    let rows = frame.cells.y * frame.cells.z;
    var above = Layers(vec4(HALF_BIAS), vec4(HALF_BIAS));
    var below = Layers(vec4(HALF_BIAS), vec4(HALF_BIAS));
    for (var column = row.first; column < row.end; column++) {
        let place = row.place + column * frame.cells.y;
        if row.above {
            add(&above, take(place, plane()));
        }
        if row.below {
            add(&below, take(place + 4u * plane(), plane()));
        }
        masks[row.mask + column * rows] = occluded(above) | (occluded(below) << 16u);
    }
}

@compute @workgroup_size(WORKGROUP)
fn summation_of_wide(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let row = row_of(group, local);
    let rows = frame.cells.y * frame.cells.z;
    let plane = plane();
    var above_0 = vec4(0u);
    var above_1 = vec4(0u);
    var above_2 = vec4(0u);
    var above_3 = vec4(0u);
    var below_0 = vec4(0u);
    var below_1 = vec4(0u);
    var below_2 = vec4(0u);
    var below_3 = vec4(0u);
    for (var column = row.first; column < row.end; column++) {
        let place = row.place + column * frame.cells.y;
        above_0 += take(place, plane);
        above_1 += take(place + 4u * plane, plane);
        above_2 += take(place + 8u * plane, plane);
        above_3 += take(place + 12u * plane, plane);
        below_0 += take(place + 16u * plane, plane);
        below_1 += take(place + 20u * plane, plane);
        below_2 += take(place + 24u * plane, plane);
        below_3 += take(place + 28u * plane, plane);
        masks[row.mask + column * rows] = occluded_of_four(above_0)
            | (occluded_of_four(above_1) << 4u)
            | (occluded_of_four(above_2) << 8u)
            | (occluded_of_four(above_3) << 12u)
            | (occluded_of_four(below_0) << 16u)
            | (occluded_of_four(below_1) << 20u)
            | (occluded_of_four(below_2) << 24u)
            | (occluded_of_four(below_3) << 28u);
    }
}
