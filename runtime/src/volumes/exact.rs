//! The form factor of a polygon in double precision.

use glam::DVec3;

/// The length of the cross product of two corners, relative to the longest corner squared, below which
/// the edge between them has no angle that matters: double precision's rounding.
const EPSILON: f64 = 1e-15;

/// Returns AO at a receiver by a polygon: the share of its cosine-weighted hemisphere that the polygon
/// covers, 0..=1 (Lambert; McGuire 2010, equation 1).
///
/// `corners` are those of a planar, convex polygon relative to the receiver, in any unit and either
/// order; what lies below the receiver's horizon is cut off. `normal` is the receiver's unit normal.
/// Polygons without area, and those whose plane contains the receiver, cover nothing.
pub fn polygon_occlusion(corners: &[[f64; 3]], normal: [f64; 3]) -> f64 {
    let normal = DVec3::from(normal);
    let above = above_horizon(corners, normal);
    let longest = above.iter().map(|p| p.length_squared()).fold(0.0, f64::max);
    let next = above.iter().cycle().skip(1);
    let sum: f64 = above
        .iter()
        .zip(next)
        .map(|(a, b)| edge_factor(*a, *b, normal, EPSILON * longest))
        .sum();
    sum.abs() / std::f64::consts::TAU
}

/// Returns the corners of the part above the horizon, in the same order.
fn above_horizon(corners: &[[f64; 3]], normal: DVec3) -> Vec<DVec3> {
    let corners = corners.iter().map(|p| DVec3::from(*p));
    let next = corners.clone().cycle().skip(1);
    let mut above = Vec::with_capacity(corners.len() + 1);
    for (a, b) in corners.zip(next) {
        let [from, to] = [a, b].map(|p| p.dot(normal));
        if from > 0.0 {
            above.push(a);
        }
        if (from > 0.0) != (to > 0.0) {
            above.push(a + (b - a) * (from / (from - to)));
        }
    }
    above
}

/// Returns the angle of an edge times the cosine between its plane's normal and the receiver's.
fn edge_factor(a: DVec3, b: DVec3, normal: DVec3, epsilon: f64) -> f64 {
    let across = a.cross(b);
    let length = across.length();
    if length <= epsilon {
        return 0.0;
    }
    length.atan2(a.dot(b)) * normal.dot(across) / length
}
