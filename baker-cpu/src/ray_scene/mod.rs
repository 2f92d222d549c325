//! A BVH over a mesh that answers occlusion and closest-hit rays.

mod build;
mod exhaustive;

mod kernels;
mod packed_ray;
mod traversal;
mod tree;

use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::surface::{cross, dot};

use build::{binary_tree, distinct_triangles, extent, padded_box, power_of_two_scale};
use exhaustive::unit;
use kernels::Level;
use packed_ray::Extent;
use traversal::{AnyHit, Cast, ClosestHit};
use tree::Tree;

/// A BVH over the triangles of a mesh, for ray casting.
///
/// Internally, coordinates are relative to the center of the mesh's bounding box and scaled by a
/// power of two to the order of one, so that single precision suffices for every mesh.
pub struct RayScene {
    level: Level,
    tree: Tree,
    extent: Extent,
    /// The scaled corners of the triangles, in the order of the BVH's leaves.
    triangles: Vec<[[f64; 3]; 3]>,
    /// The index in the mesh of each of `triangles`; the first of several identical ones.
    indices: Vec<u32>,
    /// The indices in the mesh of those that have another one of the same corners behind them, which
    /// faces the other way; in order.
    two_sided: Vec<u32>,
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
        Self::with(mesh, Level::available()[0])
    }

    /// Returns the SIMD levels that this machine has and ray casting supports, the best first:
    /// `avx2`, and always `portable`. All give the same answers.
    pub fn simd_levels() -> Vec<&'static str> {
        Level::available().into_iter().map(Level::name).collect()
    }

    /// Builds the BVH for one of [`RayScene::simd_levels`], to compare them; `None` if this machine
    /// has no SIMD level of that name.
    pub fn with_simd_level(mesh: &TriangleMesh, name: &str) -> Option<Self> {
        let mut levels = Level::available().into_iter();
        let level = levels.find(|level| level.name() == name)?;
        Some(Self::with(mesh, level))
    }

    fn with(mesh: &TriangleMesh, level: Level) -> Self {
        let bounds = mesh.bounds();
        let center = bounds.center().map(f64::from);
        let scale = power_of_two_scale(bounds.half_extents());
        let local =
            |corner: [f32; 3]| std::array::from_fn(|x| (f64::from(corner[x]) - center[x]) * scale);
        let corners =
            |t: u32| mesh.triangles()[t as usize].map(|v| local(mesh.positions()[v as usize]));
        let (distinct, two_sided) = distinct_triangles(mesh);
        let extent = extent(distinct.iter().map(|&t| corners(t)));
        let boxes: Vec<_> = (0..)
            .zip(&distinct)
            .map(|(idx, &t)| padded_box(&corners(t), idx, extent))
            .collect();
        let binary = binary_tree(&boxes);
        drop(boxes);
        let order = binary.primitive_indices.iter();
        let indices: Vec<_> = order.map(|&t| distinct[t as usize]).collect();
        drop(distinct);
        // Corners in the order of the leaves keep the memory accesses of a traversal local.
        let triangles: Vec<_> = indices.iter().map(|&t| corners(t)).collect();
        Self {
            level,
            tree: Tree::new(&binary, &triangles),
            extent,
            triangles,
            indices,
            two_sided,
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
        self.is_occluded_from_center(from_center, unit(direction), max_distance)
    }

    /// Returns the closest hit, at a distance above zero, of the ray from `origin` (object space)
    /// in `direction` (any length but zero).
    pub fn closest_hit(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<Hit> {
        let origin = self.relative_to_center(origin).map(|v| v * self.scale);
        let query = ClosestHit(Cast {
            scene: self,
            origin,
            unit: unit(direction),
            max_distance: f64::INFINITY,
        });
        self.level.run(query).map(|hit| Hit {
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
        let cast = self.cast_from_center(origin, unit, max_distance);
        self.level.run(AnyHit::<false>(cast))
    }

    /// Whether a ray hits the front of a triangle, as [`RayScene::is_occluded_from_center`].
    pub(crate) fn is_occluded_by_fronts(
        &self,
        origin: [f64; 3],
        unit: [f64; 3],
        max_distance: f64,
    ) -> bool {
        let cast = self.cast_from_center(origin, unit, max_distance);
        self.level.run(AnyHit::<true>(cast))
    }

    #[inline(always)]
    fn cast_from_center(&self, [x, y, z]: [f64; 3], unit: [f64; 3], max_distance: f64) -> Cast<'_> {
        Cast {
            scene: self,
            origin: [x * self.scale, y * self.scale, z * self.scale],
            unit,
            max_distance: max_distance * self.scale,
        }
    }

    /// Whether a triangle, by its position among the leaves', faces against a direction.
    fn faces_against(&self, at: usize, direction: [f64; 3]) -> bool {
        let [a, b, c] = self.triangles[at];
        let minus = |p: [f64; 3]| [0, 1, 2].map(|x| p[x] - a[x]);
        let normal = cross(minus(b), minus(c));
        dot(normal, direction) < 0.0 || self.two_sided.binary_search(&self.indices[at]).is_ok()
    }

    /// Returns the center of the mesh's bounding box, relative to the mesh's origin, as is that of a
    /// grid placed around it.
    pub(crate) fn center(&self) -> [f64; 3] {
        self.center
    }
}

#[cfg(test)]
mod tests;
