// Summation: from differences along a row of cells, in bytes, to the texels of its cells.

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
    let nibbles = ((even >> vec4(15u)) & vec4(1u)) | ((odd >> vec4(14u)) & vec4(2u))
        | ((even >> vec4(29u)) & vec4(4u)) | ((odd >> vec4(28u)) & vec4(8u));
    return nibbles.x | (nibbles.y << 4u) | (nibbles.z << 8u) | (nibbles.w << 12u);
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
