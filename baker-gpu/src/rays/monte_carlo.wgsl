// Monte Carlo sampling with uniformly distributed directions. A workgroup takes a cell and draws
// the same numbers as the CPU baker from the cell's own stream of ChaCha with 8 rounds
// (D. J. Bernstein, 2008). Each invocation draws a block of the stream; the pairs of numbers that
// Marsaglia's method (Annals of Mathematical Statistics 43, 1972) accepts become directions, in
// the order of the stream.

/// The count of occluded rays of each cell, and the 64-bit sums of (1 + component) · 2³⁰ over
/// their directions: all counts, then all low words of x, of y and of z, then all high words.
@group(0) @binding(5) var<storage, read_write> sums: array<u32>;

/// The number of candidates that each invocation accepts; then the inclusive prefix sum.
var<workgroup> accepted: array<u32, WORKGROUP>;
/// The sums of each invocation: count, low words, high words.
var<workgroup> partial_sums: array<array<u32, SUMS>, WORKGROUP>;

/// A state of ChaCha: four rows of four words.
struct Block {
    a: vec4<u32>,
    b: vec4<u32>,
    c: vec4<u32>,
    d: vec4<u32>,
}

fn rotated(v: vec4<u32>, bits: u32) -> vec4<u32> {
    return (v << vec4(bits)) | (v >> vec4(32u - bits));
}

/// Four quarter rounds, one per component.
fn quarter_rounds(state: Block) -> Block {
    var s = state;
    s.a += s.b;
    s.d = rotated(s.d ^ s.a, 16u);
    s.c += s.d;
    s.b = rotated(s.b ^ s.c, 12u);
    s.a += s.b;
    s.d = rotated(s.d ^ s.a, 8u);
    s.c += s.d;
    s.b = rotated(s.b ^ s.c, 7u);
    return s;
}

/// A block of a stream: eight 64-bit numbers.
fn block(counter: u32, stream: u32) -> Block {
    // "expand 32-byte k". The counter's high word is 0: no cell needs 2³² blocks.
    let start = Block(
        vec4(0x61707865u, 0x3320646eu, 0x79622d32u, 0x6b206574u),
        scene.key[0],
        scene.key[1],
        vec4(counter, 0u, stream, 0u),
    );
    var s = start;
    for (var pair = 0u; pair < 4u; pair++) {
        s = quarter_rounds(s);
        // The second round works on the diagonals.
        s = Block(s.a, s.b.yzwx, s.c.zwxy, s.d.wxyz);
        s = quarter_rounds(s);
        s = Block(s.a, s.b.wxyz, s.c.zwxy, s.d.yzwx);
    }
    return Block(s.a + start.a, s.b + start.b, s.c + start.c, s.d + start.d);
}

/// A point of the square [−1, 1]², with one minus its squared distance from the center, and
/// whether it lies inside the unit circle.
struct Candidate {
    point: vec2<f32>,
    one_minus_r2: f32,
    is_inside: bool,
}

/// The square of x in units of 2⁻⁶², where x is a 64-bit word as the CPU reads it: its upper 53
/// bits divided by 2⁵², minus 1. Low word first; the error is at most two units.
fn square(low: u32, high: u32) -> vec2<u32> {
    // x = (signed upper word)·2⁻³¹ + (21 bits)·2⁻⁵².
    let upper = bitcast<i32>(high ^ 0x80000000u);
    let lower = low >> 11u;
    let main = product(upper, upper);
    // Twice the mixed product is in units of 2⁻⁸²: an arithmetic shift by 20 bits.
    let mixed = product(upper, i32(lower));
    let small = vec2((mixed.x >> 20u) | (mixed.y << 12u), bitcast<u32>(bitcast<i32>(mixed.y) >> 20u));
    let sum = main.x + small.x;
    return vec2(sum, main.y + small.y + u32(sum < main.x));
}

/// A 64-bit word of the stream as a number in −1..1, with the full precision of a float.
fn signed_unit(low: u32, high: u32) -> f32 {
    let upper = bitcast<i32>(high ^ 0x80000000u);
    if abs(upper) >= (1 << 23) {
        return f32(upper) / 2147483648.0;
    }
    return f32(upper) / 2147483648.0 + f32(low >> 11u) / 4503599627370496.0;
}

/// The candidate of two 64-bit words. Its squared distance is compared in 64-bit integers: single
/// floats would decide differently from the CPU near the circle.
fn candidate(words: vec4<u32>) -> Candidate {
    let x = square(words.x, words.y);
    let y = square(words.z, words.w);
    let low = x.x + y.x;
    // Below 2⁶³: each is 2⁶² at the most.
    let high = x.y + y.y + u32(low < x.x);
    // 1 is 2⁶².
    let is_inside = high < 0x40000000u;
    // 2⁶² − (high, low), by words.
    let rest_high = 0x40000000u - high - u32(low != 0u);
    let one_minus_r2 = f32(rest_high) / 1073741824.0 + f32(~low + 1u) / 4611686018427387904.0;
    return Candidate(
        vec2(signed_unit(words.x, words.y), signed_unit(words.z, words.w)),
        one_minus_r2,
        is_inside,
    );
}

/// The sums of one invocation.
struct RaySums {
    count: u32,
    low: vec3<u32>,
    high: vec3<u32>,
}

/// Casts the ray of an accepted candidate, and adds it to the sums if it is occluded.
fn trace(origin: vec3<i32>, drawn: Candidate, ray_sums: ptr<function, RaySums>) {
    // Marsaglia's mapping from the unit circle to the sphere.
    let root = 2.0 * sqrt(drawn.one_minus_r2);
    let direction = vec3(drawn.point * root, 2.0 * drawn.one_minus_r2 - 1.0);
    if is_occluded(ray_from(origin, direction, 1.0)) {
        (*ray_sums).count++;
        if !WITH_DIRECTIONS {
            return;
        }
        // 1 + component, which is never negative.
        let biased = bitcast<vec3<u32>>(vec3<i32>(direction * 1073741824.0)) + vec3(0x40000000u);
        (*ray_sums).low += biased;
        (*ray_sums).high += vec3<u32>((*ray_sums).low < biased);
    }
}

/// Replaces `accepted` by its inclusive prefix sums.
fn prefix_sum(local: u32) {
    for (var step = 1u; step < WORKGROUP; step *= 2u) {
        var before = 0u;
        if local >= step {
            before = accepted[local - step];
        }
        workgroupBarrier();
        accepted[local] += before;
        workgroupBarrier();
    }
}

@compute @workgroup_size(WORKGROUP)
fn monte_carlo(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let idx = chunk.first + group.x;
    let cell = scene.first_cell + idx;
    let origin = sample_position(cell);
    var ray_sums = RaySums(0u, vec3(0u), vec3(0u));
    var drawn = 0u;
    for (var round = 0u; drawn < scene.n_directions; round++) {
        let words = block(round * WORKGROUP + local, cell);
        let inside = vec4(
            candidate(words.a).is_inside,
            candidate(words.b).is_inside,
            candidate(words.c).is_inside,
            candidate(words.d).is_inside,
        );
        // The index of an invocation's first ray is the number of candidates accepted before it,
        // so that the directions are cut off after the same ray as on the CPU.
        let ones = vec4<u32>(inside);
        accepted[local] = ones.x + ones.y + ones.z + ones.w;
        workgroupBarrier();
        prefix_sum(local);
        var ray_idx = drawn;
        if local > 0u {
            ray_idx += accepted[local - 1u];
        }
        var left = ones.x | (ones.y << 1u) | (ones.z << 2u) | (ones.w << 3u);
        while left != 0u && ray_idx < scene.n_directions {
            let i = firstTrailingBit(left);
            left &= left - 1u;
            ray_idx++;
            let ab = select(words.a, words.b, i == 1u);
            let cd = select(words.c, words.d, i == 3u);
            trace(origin, candidate(select(ab, cd, i >= 2u)), &ray_sums);
        }
        drawn += workgroupUniformLoad(&accepted[WORKGROUP - 1u]);
    }
    partial_sums[local] = array<u32, SUMS>(
        ray_sums.count,
        ray_sums.low.x, ray_sums.low.y, ray_sums.low.z,
        ray_sums.high.x, ray_sums.high.y, ray_sums.high.z,
    );
    workgroupBarrier();
    // One invocation reduces the count, and one each both words of a 64-bit sum.
    if local > 3u {
        return;
    }
    var low = 0u;
    var high = 0u;
    for (var i = 0u; i < WORKGROUP; i++) {
        let summand = partial_sums[i][local];
        low += summand;
        high += u32(low < summand);
        if local > 0u {
            high += partial_sums[i][local + 3u];
        }
    }
    sums[local * scene.n_cells + idx] = low;
    if local > 0u {
        sums[(local + 3u) * scene.n_cells + idx] = high;
    }
}
