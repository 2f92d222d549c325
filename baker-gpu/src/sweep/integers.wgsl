// On which side of a row of cells an edge passes, exactly: WGSL has no 64-bit integers.

/// The product of two numbers below 2³¹ in magnitude: low word, high word.
fn product(a: i32, b: i32) -> vec2<u32> {
    let x = u32(abs(a));
    let y = u32(abs(b));
    let low = (x & 0xffffu) * (y & 0xffffu);
    let middle = (x >> 16u) * (y & 0xffffu) + (x & 0xffffu) * (y >> 16u);
    var result = vec2(low + (middle << 16u), (x >> 16u) * (y >> 16u) + (middle >> 16u));
    result.y += u32(result.x < low);
    if (a < 0) != (b < 0) {
        result = ~result;
        result.x += 1u;
        result.y += u32(result.x == 0u);
    }
    return result;
}

/// Whether a·b ≥ c·d. Mostly floats know; they err by less than 2⁻²² of each product.
fn is_at_least(a: i32, b: i32, c: i32, d: i32) -> bool {
    let one = f32(a) * f32(b);
    let other = f32(c) * f32(d);
    if abs(one - other) > PRODUCT_ROUNDING * (abs(one) + abs(other)) {
        return one > other;
    }
    let p = product(a, b);
    let q = product(c, d);
    if p.y != q.y {
        return bitcast<i32>(p.y) > bitcast<i32>(q.y);
    }
    return p.x >= q.x;
}

/// Whether an edge crosses the level of a row above the row, at greater w. From the edge's
/// first end, in (v, w), `along` leads to its second and `to_row` to the row; `up` says that
/// V − b·W grows along the edge, by its ranks. Where the row is not between the ends nothing
/// needs to be asked, and rounded ranks cannot mislead. Piercings ask the same.
fn is_above(along: vec2<i32>, up: bool, to_row: vec2<i32>) -> bool {
    if to_row.y < min(along.y, 0) {
        return true;
    }
    if to_row.y > max(along.y, 0) {
        return false;
    }
    return is_at_least(along.x, to_row.y, along.y, to_row.x) != up;
}
