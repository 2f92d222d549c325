//! The point of a triangle that is closest to a given point.

use super::overlap::{dot, subtract};

/// Returns the point of a triangle, which may be degenerate, that is closest to `p`.
pub(super) fn closest_point(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (subtract(b, a), subtract(c, a), subtract(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    let (bb, bc, cc) = (dot(ab, ab), dot(ab, ac), dot(ac, ac));
    // The projection of p on the plane in barycentric coordinates, times the determinant.
    let determinant = bb * cc - bc * bc;
    let (v, w) = (cc * d1 - bc * d2, bb * d2 - bc * d1);
    if determinant > 0.0 && v >= 0.0 && w >= 0.0 && v + w <= determinant {
        let (v, w) = (v / determinant, w / determinant);
        return [0, 1, 2].map(|x| a[x] + v * ab[x] + w * ac[x]);
    }
    let on_edges = [[a, b], [b, c], [c, a]].map(|edge| closest_on_segment(p, edge));
    let nearer = |q, r| match squared_distance(p, r) < squared_distance(p, q) {
        true => r,
        false => q,
    };
    on_edges.into_iter().fold(on_edges[0], nearer)
}

pub(super) fn squared_distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    let offset = subtract(p, q);
    dot(offset, offset)
}

fn closest_on_segment(p: [f64; 3], [a, b]: [[f64; 3]; 2]) -> [f64; 3] {
    let (ab, ap) = (subtract(b, a), subtract(p, a));
    let length = dot(ab, ab);
    let t = match length > 0.0 {
        true => (dot(ab, ap) / length).clamp(0.0, 1.0),
        false => 0.0,
    };
    [0, 1, 2].map(|x| a[x] + t * ab[x])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_point_is_on_the_face_an_edge_or_a_corner() {
        let triangle = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        for (p, expected) in [
            ([0.5, 0.5, 3.0], [0.5, 0.5, 0.0]),
            ([0.5, -2.0, 0.0], [0.5, 0.0, 0.0]),
            ([2.0, 2.0, 0.0], [1.0, 1.0, 0.0]),
            ([-3.0, -4.0, 0.0], [0.0, 0.0, 0.0]),
            ([4.0, 0.0, 1.0], [2.0, 0.0, 0.0]),
        ] {
            assert_eq!(closest_point(p, triangle), expected, "{p:?}");
        }
        let line = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
        assert_eq!(closest_point([1.5, 2.0, 0.0], line), [1.5, 0.0, 0.0]);
        assert_eq!(closest_point([0.0, 2.0, 0.0], [[0.0; 3]; 3]), [0.0; 3]);
    }
}
