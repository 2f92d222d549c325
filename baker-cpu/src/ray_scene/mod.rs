//! A BVH over a mesh that answers occlusion and closest-hit rays.

mod build;

use std::time::Duration;

use aogrid_bake_core::TriangleMesh;
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh};

use crate::triangle::Ray;
use build::{MAX_PADDING, distinct_triangles, padded_box, power_of_two_scale};

/// The distance from the center, in the scaled mesh's units, beyond which the traversal ray is
/// started closer to the mesh. Only at a thousand times this distance would the rounding of the
/// origin approach the boxes' padding.
const MAX_START_DISTANCE: f64 = 64.0;

/// A BVH over the triangles of a mesh, for ray casting.
///
/// Internally, coordinates are relative to the center of the mesh's bounding box and scaled by a
/// power of two to the order of one, so that single precision suffices for every mesh.
pub struct RayScene {
    /// The union of all padded boxes.
    bounds: Aabb,
    bvh: CwBvh,
    /// The scaled corners of the triangles, in the order of the BVH's leaves.
    triangles: Vec<[[f64; 3]; 3]>,
    /// The index in the mesh of each of `triangles`; the first of several identical ones.
    indices: Vec<u32>,
    /// The origin of the mesh's coordinates, in object space.
    origin: [f64; 3],
    /// The center of the mesh's bounding box, relative to the origin.
    center: [f64; 3],
    scale: f64,
}

/// The closest intersection of a ray with the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The distance from the ray's origin, in object units.
    pub distance: f64,
    /// The index of the triangle in the mesh; the smallest of several at the same distance.
    pub triangle: u32,
}

impl RayScene {
    /// Builds the BVH: about a second for a million triangles.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let bounds = mesh.bounds();
        let center = bounds.center().map(f64::from);
        let scale = power_of_two_scale(bounds.half_extents());
        let local =
            |corner: [f32; 3]| std::array::from_fn(|x| (f64::from(corner[x]) - center[x]) * scale);
        let distinct = distinct_triangles(mesh);
        let corner = |vertex: u32| local(mesh.positions()[vertex as usize]);
        let boxes: Vec<_> = (0..)
            .zip(&distinct)
            .map(|(idx, &t)| padded_box(mesh.triangles()[t as usize].map(corner), idx))
            .collect();
        let bvh = build_cwbvh(
            &boxes,
            BvhBuildParams::medium_build(),
            &mut Duration::default(),
        );
        let bounds = boxes
            .iter()
            .fold(Aabb::empty(), |all, one| all.union(&one.0));
        drop(boxes);
        let indices: Vec<_> = bvh
            .primitive_indices
            .iter()
            .map(|&t| distinct[t as usize])
            .collect();
        // Corners in the order of the leaves keep the memory accesses of a traversal local.
        let triangles = indices
            .iter()
            .map(|&t| mesh.triangles()[t as usize].map(corner))
            .collect();
        Self {
            bounds,
            bvh,
            triangles,
            indices,
            origin: mesh.origin(),
            center,
            scale,
        }
    }

    /// Returns a position in object space relative to the center.
    fn relative_to_center(&self, position: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|x| position[x] - self.origin[x] - self.center[x])
    }

    /// Whether the ray from `origin` (object space) in `direction` (any length but zero) hits a
    /// triangle at a distance above zero and up to `max_distance` (object units).
    pub fn is_occluded(&self, origin: [f64; 3], direction: [f64; 3], max_distance: f64) -> bool {
        let from_center = self.relative_to_center(origin);
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        self.is_occluded_from_center(from_center, direction.map(|v| v / length), max_distance)
    }

    /// Returns the closest hit, at a distance above zero, of the ray from `origin` (object space)
    /// in `direction` (any length but zero).
    pub fn closest_hit(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<Hit> {
        let origin = self.relative_to_center(origin).map(|v| v * self.scale);
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        let unit = direction.map(|v| v / length);
        let (mut traversal, skip) = traversal_ray(origin, unit, f64::INFINITY);
        if self.bounds.intersect_ray(&traversal) == f32::INFINITY {
            return None;
        }
        let exact = Ray::new(origin, unit, f64::INFINITY);
        let mut closest: Option<Hit> = None;
        use glam::UVec2; // the macro names it
        let mut state = self.bvh.new_traversal(traversal.direction);
        let mut node;
        obvhs::traverse!(
            self.bvh,
            node,
            state,
            node.intersect_ray(&traversal, state.oct_inv4),
            {
                let leaf = state.primitive_id as usize;
                if let Some(distance) = exact.hit_distance(&self.triangles[leaf]) {
                    let triangle = self.indices[leaf];
                    // Ties go to the smaller index, so that the result does not depend on the
                    // order of the traversal.
                    if closest.is_none_or(|n| (distance, triangle) < (n.distance, n.triangle)) {
                        closest = Some(Hit { distance, triangle });
                        traversal.tmax = (distance - skip + MAX_PADDING) as f32;
                    }
                }
            }
        );
        closest.map(|hit| Hit {
            distance: hit.distance / self.scale,
            ..hit
        })
    }

    /// Whether a ray is occluded, as [`RayScene::is_occluded`], for an origin relative to
    /// [`RayScene::center`] and a direction of length 1. Relative to the center, mirror images
    /// have exactly opposite coordinates.
    pub(crate) fn is_occluded_from_center(
        &self,
        origin: [f64; 3],
        unit: [f64; 3],
        max_distance: f64,
    ) -> bool {
        let [x, y, z] = origin;
        let origin = [x * self.scale, y * self.scale, z * self.scale];
        let max_distance = max_distance * self.scale;
        let (traversal, _) = traversal_ray(origin, unit, max_distance);
        // Most rays miss even the bounding box of the mesh.
        if self.bounds.intersect_ray(&traversal) == f32::INFINITY {
            return false;
        }
        let exact = Ray::new(origin, unit, max_distance);
        use glam::UVec2; // the macro names it
        let mut occluded = false;
        let mut state = self.bvh.new_traversal(traversal.direction);
        let mut node;
        obvhs::traverse!(
            self.bvh,
            node,
            state,
            node.intersect_ray(&traversal, state.oct_inv4),
            {
                if exact.hits(&self.triangles[state.primitive_id as usize]) {
                    occluded = true;
                    break;
                }
            }
        );
        occluded
    }

    /// Returns the center of the mesh's bounding box, relative to the mesh's origin, as is that of a
    /// grid placed around it.
    pub(crate) fn center(&self) -> [f64; 3] {
        self.center
    }
}

/// Returns the ray for the BVH traversal, in single precision, and the distance by which its start
/// was moved along the direction. The mesh lies within √3 of the center, so that a distant ray can
/// start closer without missing a triangle.
fn traversal_ray(origin: [f64; 3], unit: [f64; 3], max_distance: f64) -> (obvhs::ray::Ray, f64) {
    let squared = origin[0] * origin[0] + origin[1] * origin[1] + origin[2] * origin[2];
    let skip = if squared > MAX_START_DISTANCE * MAX_START_DISTANCE {
        squared.sqrt() - MAX_START_DISTANCE / 2.0
    } else {
        0.0
    };
    let start = |x: usize| (origin[x] + skip * unit[x]) as f32;
    // Adding zero turns −0 into +0. The traversal treats −0 inconsistently: its inverse and its
    // sign test disagree, and it would miss triangles ahead.
    let component = |x: usize| unit[x] as f32 + 0.0;
    let ray = obvhs::ray::Ray::new(
        Vec3A::new(start(0), start(1), start(2)),
        Vec3A::new(component(0), component(1), component(2)),
        0.0,
        (max_distance - skip + MAX_PADDING) as f32,
    );
    (ray, skip)
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::mesh::Part;
    use aogrid_bake_core::models::Model;

    use super::*;

    /// Returns a generator of numbers in −1..1.
    fn random_numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut bits = crate::random::random_bits(seed);
        move || (bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Whether a ray is occluded, tested against every triangle.
    fn is_occluded_brute_force(
        occluder: &RayScene,
        origin: [f64; 3],
        direction: [f64; 3],
        max_distance: f64,
    ) -> bool {
        let local = std::array::from_fn(|x| (origin[x] - occluder.center[x]) * occluder.scale);
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        let unit = direction.map(|v| v / length);
        let ray = Ray::new(local, unit, max_distance * occluder.scale);
        occluder.triangles.iter().any(|t| ray.hits(t))
    }

    /// Returns the closest hit, tested against every triangle.
    fn closest_hit_brute_force(
        occluder: &RayScene,
        origin: [f64; 3],
        direction: [f64; 3],
    ) -> Option<Hit> {
        let local = std::array::from_fn(|x| (origin[x] - occluder.center[x]) * occluder.scale);
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        let ray = Ray::new(local, direction.map(|v| v / length), f64::INFINITY);
        let hits = occluder.triangles.iter().zip(&occluder.indices);
        let hits = hits.filter_map(|(t, &triangle)| Some((ray.hit_distance(t)?, triangle)));
        hits.min_by(|a, b| a.partial_cmp(b).unwrap())
            .map(|(distance, triangle)| Hit {
                distance: distance / occluder.scale,
                triangle,
            })
    }

    fn transformed(sample: Model, scale: f32, offset: f32) -> TriangleMesh {
        let mesh = sample.mesh(None).unwrap();
        let transform = |p: &[f32; 3]| p.map(|v| v * scale + offset);
        let positions = mesh.positions().iter().map(transform).collect();
        TriangleMesh::new(positions, mesh.triangles().to_vec(), mesh.parts().to_vec()).unwrap()
    }

    #[test]
    fn the_bvh_agrees_with_brute_force() {
        let mut next = random_numbers(1);
        let (mut occluded, mut rays) = (0, 0);
        // Meshes of ordinary size, far from the origin, tiny and huge.
        for (scale, offset) in [(1.0, 0.0), (1.0, 300.0), (1e-20, 0.0), (1e20, 0.0)] {
            for sample in [Model::Robot, Model::Torus, Model::Table] {
                let occluder = RayScene::new(&transformed(sample, scale, offset));
                let size = f64::from(scale);
                for distance in [0.5, 3.0, 1e4] {
                    for _ in 0..500 {
                        let origin: [f64; 3] =
                            std::array::from_fn(|x| occluder.center[x] + distance * size * next());
                        // Half of the rays aim at the mesh, which random ones from afar rarely hit.
                        let to: [f64; 3] = std::array::from_fn(|_| size * next());
                        let direction = match next() > 0.0 {
                            true => std::array::from_fn(|x| occluder.center[x] + to[x] - origin[x]),
                            false => to,
                        };
                        assert_eq!(
                            occluder.closest_hit(origin, direction),
                            closest_hit_brute_force(&occluder, origin, direction)
                        );
                        for max_distance in [f64::INFINITY, size] {
                            let expected =
                                is_occluded_brute_force(&occluder, origin, direction, max_distance);
                            assert_eq!(
                                occluder.is_occluded(origin, direction, max_distance),
                                expected
                            );
                            occluded += usize::from(expected);
                            rays += 1;
                        }
                    }
                }
            }
        }
        assert!(
            occluded > rays / 10 && occluded < rays / 2,
            "{occluded} of {rays}"
        );
    }

    /// Checks that equal boxes do not slow the BVH builder down. It merges the best pairs of a
    /// pass; if all pairs are equal it may merge one per pass, and 100,000 triangles take minutes.
    #[test]
    fn equal_triangles_build_as_fast_as_others() {
        let triangle_at = |x: f32| {
            let t = [[x, 0.0, 0.0], [x + 0.5, 0.0, 0.0], [x, 1.0, 0.0]];
            t.map(|p| p.map(|v| v / 1024.0))
        };
        let fence: Vec<_> = (0..100_000_u32).map(|i| triangle_at(i as f32)).collect();
        let copies = vec![triangle_at(0.0); 100_000];
        // One has an area, away from the ray, and encloses them all in its box.
        let mut degenerate = vec![[[1.0; 3]; 3]; 100_000];
        degenerate[0] = [[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [1.0, 2.0, 1.0]];
        for (triangles, occluded) in [(fence, true), (copies, true), (degenerate, false)] {
            let n = triangles.len();
            let indices = (0..n as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
            let whole = Part {
                name: "equal".into(),
                triangles: 0..n,
            };
            let mesh = TriangleMesh::new(triangles.concat(), indices.collect(), vec![whole]);
            let occluder = RayScene::new(&mesh.unwrap());
            let origin = [1e-4, 1e-4, 1.0];
            assert_eq!(
                occluder.is_occluded(origin, [0.0, 0.0, -1.0], f64::INFINITY),
                occluded
            );
        }
    }

    /// Checks directions with a zero component, which cube faces with an odd number of texels per
    /// side have.
    #[test]
    fn the_sign_of_a_zero_in_a_direction_does_not_matter() {
        let occluder = RayScene::new(&Model::Robot.mesh(None).unwrap());
        let mut next = random_numbers(3);
        let mut occluded = 0;
        for _ in 0..200 {
            let origin = [next(), next(), next()];
            for axis in 0..3 {
                let mut direction = std::array::from_fn(|x| occluder.center[x] - origin[x]);
                let hides = [0.0, -0.0].map(|zero| {
                    direction[axis] = zero;
                    occluder.is_occluded(origin, direction, f64::INFINITY)
                });
                assert_eq!(hides[0], hides[1], "{origin:?} {direction:?}");
                occluded += usize::from(hides[0]);
            }
        }
        assert!(occluded > 20, "{occluded}");
    }

    #[test]
    fn a_sheet_occludes_from_both_sides_at_any_distance() {
        let whole = Part {
            name: "sheet".into(),
            triangles: 0..1,
        };
        let corners = vec![[-1.0, 0.0, -1.0], [3.0, 0.0, -1.0], [-1.0, 0.0, 3.0]];
        let sheet = TriangleMesh::new(corners, vec![[0, 1, 2]], vec![whole]).unwrap();
        let occluder = RayScene::new(&sheet);
        for height in [1.0, 1e-3, 1e-6, 1e-12, 1e-100] {
            for sign in [1.0, -1.0] {
                let origin = [0.0, sign * height, 0.0];
                assert!(
                    occluder.is_occluded(origin, [0.0, -sign, 0.0], f64::INFINITY),
                    "{height}"
                );
                assert!(!occluder.is_occluded(origin, [0.0, sign, 0.0], f64::INFINITY));
            }
        }
        // A ray that starts on the sheet has no hit at a distance above zero.
        assert!(!occluder.is_occluded([0.0; 3], [0.1, 1.0, 0.2], f64::INFINITY));
    }
}
