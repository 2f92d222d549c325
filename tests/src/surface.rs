//! Points on a mesh's surface, their reference AO, and the winding number of a mesh.

use aogrid_bake_core::{TriangleMesh, UNOBSERVED};
use aogrid_baker_cpu::RayScene;
use aogrid_scene::reference::{Lighting, Receiver, ReferenceOptions, shade};

/// The increments of the quasirandom sequence R3: the first three inverse powers of the root of
/// x⁴ = x + 1. The fractional parts of their multiples fill the unit cube evenly (Roberts, *The
/// Unreasonable Effectiveness of Quasirandom Sequences*, 2018).
const R3_INCREMENTS: [f64; 3] = [
    0.819_172_513_396_164_4,
    0.671_043_606_703_789_2,
    0.549_700_477_901_970_2,
];

/// Returns `n` points on the surface, distributed evenly by area, with the normals of their
/// triangles.
pub fn surface_points(mesh: &TriangleMesh, n: usize) -> Vec<Receiver> {
    let triangles: Vec<_> = mesh
        .corners()
        .map(|t| t.map(|p| p.map(f64::from)))
        .collect();
    let normals: Vec<_> = triangles.iter().map(area_normal).collect();
    let mut total = 0.0;
    let cumulative_areas: Vec<f64> = normals
        .iter()
        .map(|normal| {
            total += length(*normal);
            total
        })
        .collect();
    let point = |idx: usize| {
        let [along, mut s, mut t] = R3_INCREMENTS.map(|step| (0.5 + step * idx as f64).fract());
        let triangle = cumulative_areas.partition_point(|area| *area <= along * total);
        // Fold the unit square onto the triangle s + t ≤ 1.
        if s + t > 1.0 {
            [s, t] = [1.0 - s, 1.0 - t];
        }
        let [a, b, c] = triangles[triangle];
        let double_area = length(normals[triangle]);
        Receiver {
            position: [0, 1, 2].map(|x| a[x] + s * (b[x] - a[x]) + t * (c[x] - a[x])),
            normal: normals[triangle].map(|v| v / double_area),
        }
    };
    (0..n).map(point).collect()
}

/// Returns the normal of a triangle by the right-hand rule; its length is twice the area.
fn area_normal([a, b, c]: &[[f64; 3]; 3]) -> [f64; 3] {
    let along = |to: &[f64; 3], x: usize| to[x] - a[x];
    [0, 1, 2].map(|x| {
        let (y, z) = ((x + 1) % 3, (x + 2) % 3);
        along(b, y) * along(c, z) - along(b, z) * along(c, y)
    })
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns the reference AO of each receiver by at least `samples` rays, which start `lift` along
/// its normal.
///
/// # Panics
///
/// Never: the observer does not cancel.
pub fn truth(occluder: &RayScene, receivers: &[Receiver], lift: f64, samples: u32) -> Vec<f64> {
    let lifted: Vec<_> = receivers
        .iter()
        .map(|r| Receiver {
            position: [0, 1, 2].map(|x| r.position[x] + lift * r.normal[x]),
            ..*r
        })
        .collect();
    let options = ReferenceOptions {
        samples,
        ..ReferenceOptions::recommended()
    };
    let lighting = Lighting::default();
    let shades = shade(Some(occluder), &lifted, &lighting, &options, UNOBSERVED);
    let shades = shades.expect("the observer does not cancel").into_iter();
    shades.map(|s| f64::from(s.occlusion.mean)).collect()
}

/// Returns the generalized winding number of `mesh` around a point: the sum of the signed solid
/// angles of all triangles, over 4π (Van Oosterom and Strackee, *The Solid Angle of a
/// Plane Triangle*, 1983). 1 inside a closed mesh that faces outward, 0 outside.
pub fn winding_number(mesh: &TriangleMesh, point: [f64; 3]) -> f64 {
    let solid_angle = |triangle: [[f32; 3]; 3]| {
        let [a, b, c] = triangle.map(|p| [0, 1, 2].map(|x| f64::from(p[x]) - point[x]));
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let [la, lb, lc] = [length(a), length(b), length(c)];
        let volume = a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        let denominator = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
        2.0 * volume.atan2(denominator)
    };
    mesh.corners().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}
