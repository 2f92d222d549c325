// Uniformly random directions: a workgroup takes a cell and draws from the cell's own stream,
// ChaCha with 8 rounds (D. J. Bernstein, 2008), what the CPU baker draws from it: each
// invocation a block of the stream, of which those pairs of numbers count, in order, that
// Marsaglia's method (Annals of Mathematical Statistics 43, 1972) accepts.

/// Of each cell: the count of occluded rays, and 64-bit sums of (1 + their components) · 2³⁰,
/// low words and high words. All counts first, and so on.
@group(0) @binding(5) var<storage, read_write> sums: array<u32>;

/// Candidates of an invocation that are accepted, then of all before it.
var<workgroup> accepted: array<u32, WORKGROUP>;
/// Of an invocation: count, low words, high words.
var<workgroup> found: array<array<u32, SUMS>, WORKGROUP>;

struct Block {
    a: vec4<u32>,
    b: vec4<u32>,
    c: vec4<u32>,
    d: vec4<u32>,
}

fn rotated(v: vec4<u32>, bits: u32) -> vec4<u32> {
    return (v << vec4(bits)) | (v >> vec4(32u - bits));
}

/// Four quarter rounds, one a component.
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

fn block(counter: u32, stream: u32) -> Block {
    // "expand 32-byte k"; no cell needs 2³² blocks.
    let start = Block(
        vec4(0x61707865u, 0x3320646eu, 0x79622d32u, 0x6b206574u),
        scene.key[0],
        scene.key[1],
        vec4(counter, 0u, stream, 0u),
    );
    var s = start;
    for (var pair = 0u; pair < 4u; pair++) {
        s = quarter_rounds(s);
        // Then down the diagonals.
        s = Block(s.a, s.b.yzwx, s.c.zwxy, s.d.wxyz);
        s = quarter_rounds(s);
        s = Block(s.a, s.b.wxyz, s.c.zwxy, s.d.yzwx);
    }
    return Block(s.a + start.a, s.b + start.b, s.c + start.c, s.d + start.d);
}

/// A point of the square −1..1 and one minus its squared distance from the centre.
struct Candidate {
    at: vec2<f32>,
    rest: f32,
    is_inside: bool,
}

/// The square of x in units of 2⁻⁶², where x is a 64-bit word, low first, as the CPU reads it:
/// its upper 53 bits over 2⁵², less 1. Off by two units at the most.
fn square(low: u32, high: u32) -> vec2<u32> {
    // x = (signed upper word)·2⁻³¹ + (21 bits)·2⁻⁵².
    let upper = bitcast<i32>(high ^ 0x80000000u);
    let lower = low >> 11u;
    let main = product(upper, upper);
    // Twice the mixed product is 2⁻⁸²: shifted by 20 bits, keeping its sign.
    let mixed = product(upper, i32(lower));
    let small = vec2((mixed.x >> 20u) | (mixed.y << 12u), bitcast<u32>(bitcast<i32>(mixed.y) >> 20u));
    let sum = main.x + small.x;
    return vec2(sum, main.y + small.y + u32(sum < main.x));
}

/// In −1..1, with as many digits as a float has.
fn number(low: u32, high: u32) -> f32 {
    let upper = bitcast<i32>(high ^ 0x80000000u);
    if abs(upper) >= (1 << 23) {
        return f32(upper) / 2147483648.0;
    }
    return f32(upper) / 2147483648.0 + f32(low >> 11u) / 4503599627370496.0;
}

fn candidate(words: vec4<u32>) -> Candidate {
    let x = square(words.x, words.y);
    let y = square(words.z, words.w);
    let low = x.x + y.x;
    // Below 2⁶³: each is 2⁶² at the most.
    let high = x.y + y.y + u32(low < x.x);
    // 1 is 2⁶².
    let is_inside = high < 0x40000000u;
    let rest_high = 0x40000000u - high - u32(low != 0u);
    let rest = f32(rest_high) / 1073741824.0 + f32(~low + 1u) / 4611686018427387904.0;
    return Candidate(vec2(number(words.x, words.y), number(words.z, words.w)), rest, is_inside);
}

/// What one invocation knows of its cell.
struct Tally {
    count: u32,
    low: vec3<u32>,
    high: vec3<u32>,
}

fn trace(origin: vec3<i32>, drawn: Candidate, tally: ptr<function, Tally>) {
    let root = 2.0 * sqrt(drawn.rest);
    let direction = vec3(drawn.at * root, 2.0 * drawn.rest - 1.0);
    if is_hidden(ray_from(origin, direction, 1.0)) {
        (*tally).count++;
        if !DIRECTIONS {
            return;
        }
        let share = bitcast<vec3<u32>>(vec3<i32>(direction * 1073741824.0)) + vec3(0x40000000u);
        (*tally).low += share;
        (*tally).high += vec3<u32>((*tally).low < share);
    }
}

/// Replaces what each invocation accepted by the sum up to and with it.
fn sum_up(local: u32) {
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
    let origin = sample_of(cell);
    var tally = Tally(0u, vec3(0u), vec3(0u));
    var drawn = 0u;
    for (var round = 0u; drawn < scene.n_directions; round++) {
        let words = block(round * WORKGROUP + local, cell);
        let inside = vec4(
            candidate(words.a).is_inside,
            candidate(words.b).is_inside,
            candidate(words.c).is_inside,
            candidate(words.d).is_inside,
        );
        let ones = vec4<u32>(inside);
        accepted[local] = ones.x + ones.y + ones.z + ones.w;
        workgroupBarrier();
        sum_up(local);
        var number_of_ray = drawn;
        if local > 0u {
            number_of_ray += accepted[local - 1u];
        }
        var left = ones.x | (ones.y << 1u) | (ones.z << 2u) | (ones.w << 3u);
        while left != 0u && number_of_ray < scene.n_directions {
            let i = firstTrailingBit(left);
            left &= left - 1u;
            number_of_ray++;
            let ab = select(words.a, words.b, i == 1u);
            let cd = select(words.c, words.d, i == 3u);
            trace(origin, candidate(select(ab, cd, i >= 2u)), &tally);
        }
        drawn += workgroupUniformLoad(&accepted[WORKGROUP - 1u]);
    }
    found[local] = array<u32, SUMS>(
        tally.count, tally.low.x, tally.low.y, tally.low.z, tally.high.x, tally.high.y, tally.high.z,
    );
    workgroupBarrier();
    // One invocation a sum; of a 64-bit sum both words.
    if local > 3u {
        return;
    }
    var low = 0u;
    var high = 0u;
    for (var i = 0u; i < WORKGROUP; i++) {
        let share = found[i][local];
        low += share;
        high += u32(low < share);
        if local > 0u {
            high += found[i][local + 3u];
        }
    }
    sums[local * scene.n_cells + idx] = low;
    if local > 0u {
        sums[(local + 3u) * scene.n_cells + idx] = high;
    }
}
