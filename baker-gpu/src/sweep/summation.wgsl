// Summation: from differences along a row of cells to the texels of its cells. An invocation
// takes one row and batch, reads its counters, and leaves them zero.

/// See `counters`; here nobody else writes.
@group(0) @binding(2) var<storage, read_write> steps: array<u32>;
/// Occluded directions of each cell: those of d in bits 0–15, of −d in 16–31. In the order
/// batch, column, k, j.
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

struct Row {
    /// Counters of column 0.
    place: u32,
    /// Masks of column 0.
    mask: u32,
}

fn row_of(group: vec3<u32>, local: u32) -> Row {
    let row = (chunk.first + group.x) * WORKGROUP + local;
    let rows = frame.cells.y * frame.cells.z;
    let j = row % frame.cells.y;
    let k = row / frame.cells.y;
    let plane = frame.cells.x * frame.cells.y;
    let place = (group.y * frame.cells.z + k) * 2u * SIDE_PLANES * plane + j;
    return Row(select(place, NOWHERE, row >= rows), group.y * frame.cells.x * rows + row);
}

@compute @workgroup_size(WORKGROUP)
fn summation(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let row = row_of(group, local);
    if row.place == NOWHERE {
        return;
    }
    let plane = frame.cells.x * frame.cells.y;
    let rows = frame.cells.y * frame.cells.z;
    var above = Layers(vec4(HALF_BIAS), vec4(HALF_BIAS));
    var below = Layers(vec4(HALF_BIAS), vec4(HALF_BIAS));
    var mask = 0u;
    for (var column = 0u; column < frame.cells.x; column++) {
        let place = row.place + column * frame.cells.y;
        let steps_above = take(place, plane);
        let steps_below = take(place + 4u * plane, plane);
        if any((steps_above | steps_below) != vec4(0u)) {
            add(&above, steps_above);
            add(&below, steps_below);
            mask = occluded(above) | (occluded(below) << 16u);
        }
        masks[row.mask + column * rows] = mask;
    }
}

@compute @workgroup_size(WORKGROUP)
fn summation_of_wide(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let row = row_of(group, local);
    if row.place == NOWHERE {
        return;
    }
    let plane = frame.cells.x * frame.cells.y;
    let rows = frame.cells.y * frame.cells.z;
    var above_0 = vec4(0u);
    var above_1 = vec4(0u);
    var above_2 = vec4(0u);
    var above_3 = vec4(0u);
    var below_0 = vec4(0u);
    var below_1 = vec4(0u);
    var below_2 = vec4(0u);
    var below_3 = vec4(0u);
    for (var column = 0u; column < frame.cells.x; column++) {
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
