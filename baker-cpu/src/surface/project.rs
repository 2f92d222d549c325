//! Points of a coarse model, moved onto a fine one.

use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::surface::{SurfacePoint, VertexGroups, cross, dot, normalized};
use rayon::prelude::*;

use crate::RayScene;

/// The fine surface that points are moved to.
#[derive(Clone, Copy)]
pub struct Projection<'a> {
    /// The triangles.
    pub mesh: &'a TriangleMesh,
    /// The normals of their vertices.
    pub groups: &'a VertexGroups,
    /// The distance along a point's axis, to either side, within which it is moved, in object units.
    pub cage: f64,
    /// The distance of moved points from their new faces.
    pub offset: f64,
}

impl Projection<'_> {
    /// Moves points, whose positions are relative to `origin`, along their axes onto the surface: each to
    /// the outermost within the cage, with the hemisphere of the surface there. Returns which of them were
    /// moved; the others stay.
    pub fn apply(&self, points: &mut [SurfacePoint], origin: [f64; 3]) -> Vec<bool> {
        let scene = RayScene::new(self.mesh);
        let moved = points.par_iter_mut().map(|point| {
            let found = self.nearest(&scene, point, origin);
            if let Some(found) = found {
                *point = found;
            }
            found.is_some()
        });
        moved.collect()
    }

    fn nearest(
        &self,
        scene: &RayScene,
        point: &SurfacePoint,
        origin: [f64; 3],
    ) -> Option<SurfacePoint> {
        let SurfacePoint { position, axis, .. } = *point;
        let along = |distance: f64| [0, 1, 2].map(|x| origin[x] + position[x] + distance * axis[x]);
        let hit = scene.closest_hit(along(self.cage), axis.map(|v| -v))?;
        if hit.distance > 2.0 * self.cage {
            return None;
        }
        let at = along(self.cage - hit.distance);
        let (face, normal) = self.normals(hit.triangle, at)?;
        // A face that is seen from behind counts as the other side of a sheet.
        let side = if dot(face, axis) < 0.0 { -1.0 } else { 1.0 };
        let face = face.map(|v| side * v);
        Some(SurfacePoint {
            position: [0, 1, 2].map(|x| at[x] + self.offset * face[x] - origin[x]),
            axis: normal.map(|v| side * v),
            face,
        })
    }

    /// Returns the normal of a triangle by its winding, and that between its vertices' at a position.
    fn normals(&self, triangle: u32, at: [f64; 3]) -> Option<([f64; 3], [f64; 3])> {
        let vertices = self.mesh.triangles()[triangle as usize];
        let origin = self.mesh.origin();
        let [a, b, c] = vertices.map(|v| {
            let p = self.mesh.positions()[v as usize];
            [0, 1, 2].map(|x| f64::from(p[x]) + origin[x] - at[x])
        });
        let minus = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|x| p[x] - q[x]);
        let face = normalized(cross(minus(b, a), minus(c, a)))?;
        // The weight of a corner is the area opposite to it.
        let mut sum = [0.0; 3];
        for (vertex, [p, q]) in vertices.into_iter().zip([[b, c], [c, a], [a, b]]) {
            let weight = dot(cross(p, q), face).max(0.0);
            let normal = self.groups.normal(vertex as usize).unwrap_or(face);
            sum = [0, 1, 2].map(|x| sum[x] + weight * normal[x]);
        }
        // A normal that leans over its own face's horizon is of no use.
        let normal = normalized(sum).filter(|normal| dot(*normal, face) > 0.0);
        Some((face, normal.unwrap_or(face)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aogrid_bake_core::models::Model;

    #[test]
    fn points_go_to_the_outermost_surface_within_the_cage() {
        let mesh = Model::Sphere.mesh(None).unwrap();
        let groups = VertexGroups::new(&mesh, None);
        let center = mesh.bounds().center().map(f64::from);
        let radius = mesh.bounds().half_extents()[1];
        let projection = Projection {
            mesh: &mesh,
            groups: &groups,
            cage: 0.2 * radius,
            offset: 0.0,
        };
        let at = |factor: f64| {
            let axis = normalized([0.3, 0.8, -0.2]).unwrap();
            SurfacePoint {
                position: [0, 1, 2].map(|x| center[x] + factor * radius * axis[x]),
                axis,
                face: axis,
            }
        };
        let mut points = [at(0.9), at(1.1), at(0.7), at(1.3)];
        let given = points;
        assert_eq!(
            projection.apply(&mut points, [0.0; 3]),
            [true, true, false, false]
        );
        for point in &points[..2] {
            let from_center = [0, 1, 2].map(|x| point.position[x] - center[x]);
            let distance = dot(from_center, from_center).sqrt() / radius;
            // The sphere is a polyhedron.
            assert!((0.98..=1.0).contains(&distance), "{distance}");
            assert!(dot(point.face, given[0].axis) > 0.98);
        }
        assert_eq!(points[2..], given[2..]);
    }
}
