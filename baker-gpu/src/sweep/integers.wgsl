// An exact test for the side of a row of cells on which an edge passes. Products are computed in
// two words because WGSL has no 64-bit integers.

/// The product of two numbers below 2³¹ in magnitude: low word, high word.
fn product(a: i32, b: i32) -> vec2<u32> {
    let x = u32(abs(a));
    let y = u32(abs(b));
    // Schoolbook multiplication with 16-bit digits.
    let low = (x & 0xffffu) * (y & 0xffffu);
    let middle = (x >> 16u) * (y & 0xffffu) + (x & 0xffffu) * (y >> 16u);
    var result = vec2(low + (middle << 16u), (x >> 16u) * (y >> 16u) + (middle >> 16u));
    result.y += u32(result.x < low);
    if (a < 0) != (b < 0) {
        // Negate in two's complement.
        result = ~result;
        result.x += 1u;
        result.y += u32(result.x == 0u);
    }
    return result;
}

/// Whether a·b ≥ c·d. Floats, whose error is below 2⁻²² of each product, mostly suffice.
fn is_at_least(a: i32, b: i32, c: i32, d: i32) -> bool {
    let ab = f32(a) * f32(b);
    let cd = f32(c) * f32(d);
    if abs(ab - cd) > PRODUCT_ROUNDING * (abs(ab) + abs(cd)) {
        return ab > cd;
    }
    let p = product(a, b);
    let q = product(c, d);
    if p.y != q.y {
        return bitcast<i32>(p.y) > bitcast<i32>(q.y);
    }
    return p.x >= q.x;
}

/// Whether an edge crosses the level of a row above the row, at greater w. The edge runs from its
/// lower to its higher vertex; `delta` is the vector between them in (v, w), and `to_row` the
/// vector from the lower vertex to the row. `up` says whether V − b·W increases along the edge,
/// by the ranks of its ends. If the row lies outside the edge's range of w, that alone decides,
/// so that rounded ranks cannot mislead. Row hits use the same expression.
fn is_above(delta: vec2<i32>, up: bool, to_row: vec2<i32>) -> bool {
    if to_row.y < min(delta.y, 0) {
        return true;
    }
    if to_row.y > max(delta.y, 0) {
        return false;
    }
    return is_at_least(delta.x, to_row.y, delta.y, to_row.x) != up;
}
