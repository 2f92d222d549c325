//! Points at the centers of faces.

use super::SurfacePoint;
use super::vector::{cross, dot, normalized, plus};
use crate::TriangleMesh;

/// Points at the centers of the triangles that have an area.
#[derive(Clone, Debug)]
pub struct FaceCenters {
    /// The points, in the order of the triangles.
    pub points: Vec<SurfacePoint>,
    /// The triangle of each point.
    pub triangles: Vec<u32>,
    /// The area of each point's triangle, in squared object units.
    pub areas: Vec<f64>,
    /// The number of triangles without an area.
    pub flat: usize,
}

/// Returns the points at the centers of all triangles, `offset` object units along their normals,
/// which follow from the winding by the right-hand rule.
pub fn face_centers(mesh: &TriangleMesh, offset: f64) -> FaceCenters {
    let mut faces = FaceCenters {
        points: vec![],
        triangles: vec![],
        areas: vec![],
        flat: 0,
    };
    for (idx, corners) in (0..).zip(mesh.corners()) {
        let [a, b, c] = corners.map(|p| p.map(f64::from));
        let double_area = cross(plus(b, -1.0, a), plus(c, -1.0, a));
        let Some(normal) = normalized(double_area) else {
            faces.flat += 1;
            continue;
        };
        let center = [0, 1, 2].map(|x| (a[x] + b[x] + c[x]) / 3.0);
        faces.points.push(SurfacePoint {
            position: plus(center, offset, normal),
            axis: normal,
            face: normal,
        });
        faces.triangles.push(idx);
        faces.areas.push(dot(double_area, normal) / 2.0);
    }
    faces
}
