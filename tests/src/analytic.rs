//! Exact occlusion from closed formulas.

use std::f64::consts::PI;

use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::mesh::Part;

/// Returns the occlusion fraction of a ball of radius `r` at a point at `distance` > r from its
/// center. The occluded cone has half-angle asin(r/distance).
pub fn sphere_fraction(r: f64, distance: f64) -> f64 {
    (1.0 - (r / distance).asin().cos()) / 2.0
}

/// Returns the occlusion fraction of a convex closed mesh at a point outside it. Every occluded
/// direction hits one front face and one back face, so it is half of the sum of all |solid angles|,
/// over 4π.
pub fn convex_fraction(mesh: &TriangleMesh, point: [f64; 3]) -> f64 {
    let angles = mesh.corners().map(|t| solid_angle(t, point).abs());
    angles.sum::<f64>() / 2.0 / (4.0 * PI)
}

/// Returns the share of a receiver's cosine-weighted hemisphere that a planar polygon covers
/// (Lambert's formula of 1760). The polygon has either winding and lies above the receiver's plane,
/// or touches it.
pub fn form_factor(corners: &[[f64; 3]], point: [f64; 3], normal: [f64; 3]) -> f64 {
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let towards: Vec<[f64; 3]> = corners
        .iter()
        .map(|c| std::array::from_fn(|x| c[x] - point[x]))
        .collect();
    // Each edge contributes its angle at the point times the cosine between the normal of the plane
    // through the edge and the point, and the receiver's normal.
    let sum: f64 = (0..towards.len())
        .map(|i| {
            let (p, q) = (towards[i], towards[(i + 1) % towards.len()]);
            let cross = [
                p[1] * q[2] - p[2] * q[1],
                p[2] * q[0] - p[0] * q[2],
                p[0] * q[1] - p[1] * q[0],
            ];
            let sine = dot(cross, cross).sqrt();
            match sine > 0.0 {
                true => sine.atan2(dot(p, q)) * dot(cross, normal) / sine,
                false => 0.0,
            }
        })
        .sum();
    sum.abs() / (2.0 * PI)
}

/// Returns the signed solid angle of a triangle (Van Oosterom and Strackee, IEEE Trans. Biomed.
/// Eng. 30 (1983), equation 8).
fn solid_angle(triangle: [[f32; 3]; 3], point: [f64; 3]) -> f64 {
    let [a, b, c] = triangle.map(|corner| {
        let v: [f64; 3] = std::array::from_fn(|x| f64::from(corner[x]) - point[x]);
        v
    });
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let [la, lb, lc] = [a, b, c].map(|v| dot(v, v).sqrt());
    let volume = a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0]);
    let denominator = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    2.0 * volume.atan2(denominator)
}

/// Returns a mesh with one part from separate triangles.
///
/// # Panics
///
/// If the triangles are not a valid mesh.
pub fn mesh_of(triangles: &[[[f32; 3]; 3]]) -> TriangleMesh {
    let n = triangles.len();
    let indices = (0..n as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    let whole = Part {
        name: "soup".into(),
        triangles: 0..n,
    };
    TriangleMesh::new(triangles.concat(), indices.collect(), vec![whole]).expect("a mesh")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_of_the_three_unit_vectors_covers_an_octant() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!((solid_angle(axes, [0.0; 3]) - PI / 2.0).abs() < 1e-12);
    }

    #[test]
    fn an_infinite_wall_covers_half_of_the_hemisphere() {
        let wall = [
            [1.0, 0.0, -1e9],
            [1.0, 0.0, 1e9],
            [1.0, 1e9, 1e9],
            [1.0, 1e9, -1e9],
        ];
        let share = form_factor(&wall, [0.0; 3], [0.0, 1.0, 0.0]);
        assert!((share - 0.5).abs() < 1e-8, "{share}");
        // A rectangle parallel to the receiver, one corner straight above it:
        // 1/2π (X/√(1+X²) atan(Y/√(1+X²)) + …), X = Y = 1.
        let quarter = [
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 0.0],
            [1.0, 1.0, 1.0],
            [0.0, 1.0, 1.0],
        ];
        let x = 1.0 / 2.0_f64.sqrt();
        let expected = 2.0 * x * x.atan() / (2.0 * PI);
        let share = form_factor(&quarter, [0.0; 3], [0.0, 1.0, 0.0]);
        assert!((share - expected).abs() < 1e-12, "{share}");
    }

    #[test]
    fn a_ball_occludes_half_of_the_sphere_at_its_surface() {
        assert!((sphere_fraction(1.0, 1.0) - 0.5).abs() < 1e-12);
        assert!((sphere_fraction(1.0, 2.0) - (1.0 - 0.75_f64.sqrt()) / 2.0).abs() < 1e-12);
    }
}
