//! Areas of triangles.

/// Returns the cross product of the edges from `a` to `b` and from `a` to `c`.
pub(super) fn cross(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|x| {
        let (y, z) = ((x + 1) % 3, (x + 2) % 3);
        (b[y] - a[y]) * (c[z] - a[z]) - (b[z] - a[z]) * (c[y] - a[y])
    })
}

/// Whether the cross product of two edges is not zero. The test is exact: differences of nearby
/// floats and their products are exact in f64.
pub(super) fn has_area(corners: [[f32; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    cross(a, b, c) != [0.0; 3]
}
