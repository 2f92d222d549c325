// Counters of layers: differences along the rows of cells. Narrow ones are bytes, four
// directions to a word, which borrow from each other and are exact while each is within ±127:
// whoever takes one out of that says so. Wide ones are words.
//
// They lie in the order batch, k, side, direction, column, j: neighbouring invocations of the
// summation are neighbouring j.

/// Sums so far; bytes are two's complement with borrow.
@group(0) @binding(2) var<storage, read_write> counters: array<atomic<u32>>;
/// Whether a byte was too small.
@group(0) @binding(3) var<storage, read_write> wrapped: atomic<u32>;

/// Counters of one direction, or of the directions of a word, of all rows of one k.
fn plane() -> u32 {
    return frame.cells.x * frame.cells.y;
}

/// The first counter of a row's side: 0 is above, 1 below.
fn first_counter(batch: u32, j: u32, k: u32, side: u32) -> u32 {
    return ((batch * frame.cells.z + k) * 2u + side) * SIDE_PLANES * plane() + j;
}

/// What this invocation has seen in a byte.
var<private> largest: i32 = 0;

/// From `column` on `delta` layers more, in the direction of a lane.
fn add_step(first: u32, lane: u32, column: u32, delta: i32) {
    if WIDE {
        let place = first + lane * plane() + column * frame.cells.y;
        atomicAdd(&counters[place], bitcast<u32>(delta));
        return;
    }
    let place = first + (lane / 4u) * plane() + column * frame.cells.y;
    let shift = 8u * (lane % 4u);
    let before = atomicAdd(&counters[place], bitcast<u32>(delta) << shift);
    let byte = i32(((before + BYTE_BIAS) >> shift) & 255u) - 128;
    largest = max(largest, abs(byte + delta));
}

/// To be called when everything is counted.
fn tell_if_wrapped() {
    if largest > 127 {
        atomicStore(&wrapped, 1u);
    }
}
