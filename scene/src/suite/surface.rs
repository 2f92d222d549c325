//! The surface of a mesh: points on it, the distance to it, and whether a point is inside.

use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::mesh::MeshReport;
use aogrid_baker_cpu::RayScene;
use glam::DVec3;
use rayon::prelude::*;

use super::quasi::Quasi;
use super::tree::Tree;
use super::triangle::Triangle;
use crate::reference::Receiver;

/// The share of boundary edges up to which a mesh counts as a solid with a few holes. Scans and
/// models have up to 4 %; sheets and bowls, whose hollow is no inside, have more.
const MAX_BOUNDARY_SHARE: f64 = 0.04;

/// The number of rays that tell an enclosed point: one that sees a hundredth of the sky is taken for
/// enclosed in 6 of 1,000 cases.
const ENCLOSURE_RAYS: usize = 512;

/// The triangles of a mesh in double precision.
pub(crate) struct Surface {
    triangles: Vec<Triangle>,
    tree: Tree,
    /// The areas of the triangles up to and including each.
    cumulative_areas: Vec<f64>,
    is_solid: bool,
    rays: RayScene,
}

impl Surface {
    pub(crate) fn new(mesh: &TriangleMesh) -> Self {
        let triangles: Vec<_> = mesh.corners().map(Triangle::new).collect();
        let mut total = 0.0;
        let areas = triangles.iter().map(|triangle| {
            total += triangle.area_normal().length();
            total
        });
        let report = MeshReport::new(mesh);
        let n_edges = 1.5 * triangles.len() as f64;
        Self {
            cumulative_areas: areas.collect(),
            is_solid: report.boundary_edges as f64 <= MAX_BOUNDARY_SHARE * n_edges,
            tree: Tree::new(&triangles),
            triangles,
            rays: RayScene::new(mesh),
        }
    }

    /// Returns the point of the surface, evenly by area, for a point of the unit cube, with the
    /// normal by the right-hand rule.
    pub(super) fn point(&self, [along, s, t]: [f64; 3]) -> Receiver {
        let total = self.cumulative_areas.last().copied().unwrap_or(0.0);
        let found = |area: &f64| *area <= along * total;
        let idx = self.cumulative_areas.partition_point(found);
        let triangle = &self.triangles[idx.min(self.triangles.len() - 1)];
        // Fold the unit square onto the triangle s + t ≤ 1.
        let [s, t] = if s + t > 1.0 {
            [1.0 - s, 1.0 - t]
        } else {
            [s, t]
        };
        let [a, b, c] = triangle.corners;
        Receiver {
            position: (a + s * (b - a) + t * (c - a)).to_array(),
            normal: triangle.area_normal().normalize().to_array(),
        }
    }

    /// Returns the closest point of the surface that is nearer than `limit`, if there is one.
    pub(crate) fn closest(&self, point: DVec3, limit: f64) -> Option<DVec3> {
        self.tree.closest(&self.triangles, point, limit)
    }

    /// Whether a point is inside: enclosed on all sides, or inside a solid that may have holes, by
    /// the generalized winding number (Van Oosterom and Strackee, *The Solid Angle of a Plane
    /// Triangle*, 1983).
    pub(super) fn is_inside(&self, point: DVec3) -> bool {
        if self.is_solid {
            let solid_angles = self.triangles.par_iter().map(|t| t.solid_angle(point));
            // Summed in order, so that the result does not depend on the number of threads.
            let winding: f64 = solid_angles.collect::<Vec<_>>().iter().sum();
            if winding > 2.0 * std::f64::consts::PI {
                return true;
            }
        }
        self.is_enclosed(point, DVec3::ZERO)
    }

    /// Whether a receiver with a unit normal sees nothing of the sky, or a point without a normal
    /// (zero) nothing of the sphere.
    pub(super) fn is_enclosed(&self, point: DVec3, normal: DVec3) -> bool {
        let quasi = Quasi::<2>::new(0);
        (0..ENCLOSURE_RAYS).all(|idx| {
            // The sum of a unit normal and a uniform direction is distributed by the cosine.
            let direction = normal + sphere(quasi.point(idx));
            let unlimited = f64::INFINITY;
            self.rays
                .is_occluded(point.to_array(), direction.to_array(), unlimited)
        })
    }
}

/// Returns the unit vector, evenly by solid angle, for a point of the unit square.
pub(super) fn sphere([s, t]: [f64; 2]) -> DVec3 {
    let z = 2.0 * s - 1.0;
    let (sin, cos) = (std::f64::consts::TAU * t).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use aogrid_bake_core::models::Model;

    #[test]
    fn closest_points_of_a_box_are_those_of_its_faces_edges_and_corners() {
        let surface = Surface::new(&Model::Box.mesh(None).unwrap());
        for (point, closest) in [
            ([0.1, 1.4, -0.2], [0.1, 1.0, -0.2]),
            ([0.8, 1.4, -0.2], [0.5, 1.0, -0.2]),
            ([0.8, 1.4, -0.9], [0.5, 1.0, -0.5]),
            ([0.1, 0.5, -0.45], [0.1, 0.5, -0.5]),
        ] {
            let found = surface.closest(DVec3::from(point), 1.0).unwrap();
            assert!((found - DVec3::from(closest)).length() < 1e-12, "{found}");
        }
        assert_eq!(surface.closest(DVec3::new(0.0, 2.5, 0.0), 1.4), None);
    }

    #[test]
    fn the_tree_finds_what_all_triangles_have() {
        let surface = Surface::new(&Model::Robot.mesh(None).unwrap());
        let quasi = Quasi::<3>::new(1);
        for idx in 0..200 {
            let point = 2.0 * DVec3::from(quasi.point(idx)) - 0.5;
            let distances = surface
                .triangles
                .iter()
                .map(|t| point.distance(t.closest(point)));
            let closest = distances.fold(f64::INFINITY, f64::min);
            let found = surface.closest(point, f64::INFINITY).unwrap();
            assert_eq!(point.distance(found), closest);
        }
    }

    #[test]
    fn solids_with_holes_have_an_inside_and_bowls_have_none() {
        let is_inside = |model: Model, point: [f64; 3]| {
            let surface = Surface::new(&model.mesh(None).unwrap());
            surface.is_inside(DVec3::from(point))
        };
        assert!(is_inside(Model::Box, [0.4, 0.9, 0.4]));
        assert!(!is_inside(Model::Box, [0.6, 0.9, 0.4]));
        assert!(!is_inside(Model::Bowl, [0.0, 0.1, 0.0]));
        assert!(!is_inside(Model::OpenBox, [0.0, 0.5, 0.0]));
    }
}
