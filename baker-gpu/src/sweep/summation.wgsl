// Summation: running sums of the deltas along a row of cells, which are bytes, give the occluded
// directions of its cells.

/// The layer counts of the sixteen directions of a side, two to a word: the words `even` hold
/// bytes 0 and 2 of the counter words, the words `odd` bytes 1 and 3. A brick has so few columns
/// that 16 bits hold every sum of bytes; the halves are biased so that they do not borrow from
/// each other.
struct Layers {
    even: vec4<u32>,
    odd: vec4<u32>,
}

fn accumulate(layers: ptr<function, Layers>, taken: vec4<u32>) {
    let bytes = taken + vec4(BYTE_BIAS);
    (*layers).even += (bytes & vec4(EVEN_BYTES)) - vec4(EVEN_BYTE_BIAS);
    (*layers).odd += ((bytes >> vec4(8u)) & vec4(EVEN_BYTES)) - vec4(EVEN_BYTE_BIAS);
}

/// Sets bits 15 and 31 of each word where its halves differ from the bias: layer counts other
/// than zero.
fn nonzero_halves(halves: vec4<u32>) -> vec4<u32> {
    let unbiased = halves ^ vec4(HALF_BIAS);
    return (((unbiased & vec4(~HALF_BIAS)) + vec4(~HALF_BIAS)) | unbiased) & vec4(HALF_BIAS);
}

/// Sixteen bits that say which directions have layers.
fn occluded_directions(layers: Layers) -> u32 {
    let even = nonzero_halves(layers.even);
    let odd = nonzero_halves(layers.odd);
    // Interleave the even and odd bytes: each word of counters gives four bits.
    let nibbles = ((even >> vec4(15u)) & vec4(1u)) | ((odd >> vec4(14u)) & vec4(2u))
        | ((even >> vec4(29u)) & vec4(4u)) | ((odd >> vec4(28u)) & vec4(8u));
    return nibbles.x | (nibbles.y << 4u) | (nibbles.z << 8u) | (nibbles.w << 12u);
}

@compute @workgroup_size(WORKGROUP)
fn summation(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let row = counter_row(group, local);
    let rows = frame.cells.y * frame.cells.z;
    var above = Layers(vec4(HALF_BIAS), vec4(HALF_BIAS));
    var below = Layers(vec4(HALF_BIAS), vec4(HALF_BIAS));
    for (var column = row.first; column < row.end; column++) {
        let counter = row.counter + column * frame.cells.y;
        if row.above {
            accumulate(&above, take_deltas(counter, plane()));
        }
        if row.below {
            accumulate(&below, take_deltas(counter + 4u * plane(), plane()));
        }
        masks[row.mask + column * rows] =
            occluded_directions(above) | (occluded_directions(below) << 16u);
    }
}
