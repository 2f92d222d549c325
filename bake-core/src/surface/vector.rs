//! Vectors of three numbers.

/// Returns the dot product.
#[inline]
pub fn dot(p: [f64; 3], q: [f64; 3]) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

/// Returns the cross product.
#[inline]
pub fn cross(p: [f64; 3], q: [f64; 3]) -> [f64; 3] {
    [
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    ]
}

/// Returns the vector of length 1 along `v`; `None` if `v` is zero or not finite.
pub fn normalized(v: [f64; 3]) -> Option<[f64; 3]> {
    // Squares of coordinates of very small or large meshes leave the range of numbers.
    let largest = v.into_iter().fold(0.0, |max: f64, x| max.max(x.abs()));
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let scaled = v.map(|x| x / largest);
    let length = dot(scaled, scaled).sqrt();
    Some(scaled.map(|x| x / length))
}

/// Returns `p + s q`.
#[inline]
pub(super) fn plus(p: [f64; 3], s: f64, q: [f64; 3]) -> [f64; 3] {
    [p[0] + s * q[0], p[1] + s * q[1], p[2] + s * q[2]]
}
