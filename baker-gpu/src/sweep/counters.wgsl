// Counters of layer deltas along the rows of cells. Narrow counters are bytes, four directions to
// a word; they borrow from each other and are exact while each is within ±127. An invocation that
// moves a byte out of this range reports it. Wide counters are words.
//
// Their memory order is batch, k, side, direction, column, j: neighboring invocations of the
// summation access neighboring j.

/// The summed deltas; bytes are two's complement with borrow.
@group(0) @binding(2) var<storage, read_write> counters: array<atomic<u32>>;
/// 1 if a byte overflowed, else 0.
@group(0) @binding(3) var<storage, read_write> overflowed: atomic<u32>;

/// The number of counter words of one direction, or of the four directions of a word, for all
/// rows of one k.
fn plane() -> u32 {
    return frame.cells.x * frame.cells.y;
}

/// The index of the first counter of a side of a row: side 0 is above, 1 below.
fn first_counter(batch: u32, j: u32, k: u32, side: u32) -> u32 {
    return ((batch * frame.cells.z + k) * 2u + side) * SIDE_PLANES * plane() + j;
}

/// The largest magnitude that this invocation has written to a byte.
var<private> max_magnitude: i32 = 0;

/// Adds `delta` layers from `column` on, in the direction of a lane.
fn add_delta(first: u32, lane: u32, column: u32, delta: i32) {
    if WIDE {
        let counter = first + lane * plane() + column * frame.cells.y;
        atomicAdd(&counters[counter], bitcast<u32>(delta));
        return;
    }
    let counter = first + (lane / 4u) * plane() + column * frame.cells.y;
    let shift = 8u * (lane % 4u);
    let before = atomicAdd(&counters[counter], bitcast<u32>(delta) << shift);
    // The bias undoes the borrows between the bytes.
    let byte = i32(((before + BYTE_BIAS) >> shift) & 255u) - 128;
    max_magnitude = max(max_magnitude, abs(byte + delta));
}

/// Reports an overflow of this invocation's bytes; to be called after its last delta.
fn report_overflow() {
    if max_magnitude > 127 {
        atomicStore(&overflowed, 1u);
    }
}
