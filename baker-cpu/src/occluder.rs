//! A mesh that answers whether it hides a direction from a point.

use std::time::Duration;

use aogrid_bake_core::TriangleMesh;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh};
use obvhs::{Boundable, BvhBuildParams};

use crate::triangle::Ray;

/// The hierarchy's boxes are larger than their triangles by this, where the mesh is between ½
/// and 1 in half-extent: more than the 1e-4 below which the hierarchy's traversal does not
/// look, and far more than single precision rounds (2⁻²⁴ · 8).
const PADDING: f32 = 1.0 / 4096.0;

/// A ray walks the hierarchy this much farther than it reaches: what [`PADDING`] grows boxes by.
const SLACK: f64 = 2.0 * PADDING as f64;

/// A ray that starts farther off than this, in the mesh's scale, walks the hierarchy from
/// nearer: a thousand times farther the rounding of its origin would approach [`PADDING`].
const NEAR: f64 = 64.0;

/// Triangles in a hierarchy.
///
/// Inside, coordinates are relative to the centre of the mesh's bounding box and scaled by a
/// power of two to the order of one, so that the hierarchy's single floats fit every mesh.
pub struct Occluder {
    /// Around all of the hierarchy's boxes.
    bounds: Aabb,
    hierarchy: CwBvh,
    /// In the order of the hierarchy's leaves.
    triangles: Vec<[[f64; 3]; 3]>,
    /// Which triangle of the mesh each is; of equal ones the first.
    indices: Vec<u32>,
    center: [f64; 3],
    scale: f64,
}

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// From the ray's origin, in object units.
    pub distance: f64,
    /// The triangle's index in the mesh; of several at that distance the smallest.
    pub triangle: u32,
}

/// A triangle's padded box.
struct PaddedBox(Aabb);

impl Boundable for PaddedBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Occluder {
    /// Builds the hierarchy: about a second for a million triangles.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let bounds = mesh.bounds();
        let center = bounds.center().map(f64::from);
        let scale = scale_to_one(bounds.half_extents());
        let local =
            |corner: [f32; 3]| std::array::from_fn(|x| (f64::from(corner[x]) - center[x]) * scale);
        let distinct = distinct_triangles(mesh);
        let corner = |vertex: u32| local(mesh.positions()[vertex as usize]);
        let boxes: Vec<_> = (0..)
            .zip(&distinct)
            .map(|(idx, &t)| padded_box(mesh.triangles()[t as usize].map(corner), idx))
            .collect();
        let hierarchy = build_cwbvh(
            &boxes,
            BvhBuildParams::medium_build(),
            &mut Duration::default(),
        );
        let bounds = boxes
            .iter()
            .fold(Aabb::empty(), |all, one| all.union(&one.0));
        drop(boxes);
        let indices: Vec<_> = hierarchy
            .primitive_indices
            .iter()
            .map(|&t| distinct[t as usize])
            .collect();
        let triangles = indices
            .iter()
            .map(|&t| mesh.triangles()[t as usize].map(corner))
            .collect();
        Self {
            bounds,
            hierarchy,
            triangles,
            indices,
            center,
            scale,
        }
    }

    /// Whether a triangle lies in `direction` (of any length but zero) from `origin` (object
    /// space), at a distance above zero and up to `reach` (object units).
    pub fn hides(&self, origin: [f64; 3], direction: [f64; 3], reach: f64) -> bool {
        let from_center = std::array::from_fn(|x| origin[x] - self.center[x]);
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        self.hides_from_center(from_center, direction.map(|v| v / length), reach)
    }

    /// The first triangle in `direction` (of any length but zero) from `origin` (object space),
    /// at a distance above zero.
    pub fn nearest(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<Hit> {
        let origin = std::array::from_fn(|x| (origin[x] - self.center[x]) * self.scale);
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        let unit = direction.map(|v| v / length);
        let (mut coarse, skip) = coarse_ray(origin, unit, f64::INFINITY);
        if self.bounds.intersect_ray(&coarse) == f32::INFINITY {
            return None;
        }
        let exact = Ray::new(origin, unit, f64::INFINITY);
        let mut nearest: Option<Hit> = None;
        use glam::UVec2; // the macro names it
        let mut state = self.hierarchy.new_traversal(coarse.direction);
        let mut node;
        obvhs::traverse!(
            self.hierarchy,
            node,
            state,
            node.intersect_ray(&coarse, state.oct_inv4),
            {
                let leaf = state.primitive_id as usize;
                if let Some(distance) = exact.distance(&self.triangles[leaf]) {
                    let triangle = self.indices[leaf];
                    // Where surfaces coincide the order of the hierarchy must not decide.
                    if nearest.is_none_or(|n| (distance, triangle) < (n.distance, n.triangle)) {
                        nearest = Some(Hit { distance, triangle });
                        coarse.tmax = (distance - skip + SLACK) as f32;
                    }
                }
            }
        );
        nearest.map(|hit| Hit {
            distance: hit.distance / self.scale,
            ..hit
        })
    }

    /// [`Occluder::hides`] for an origin relative to [`Occluder::center`], where mirror images
    /// have exactly opposite coordinates, and a direction of length 1.
    pub(crate) fn hides_from_center(&self, origin: [f64; 3], unit: [f64; 3], reach: f64) -> bool {
        let [x, y, z] = origin;
        let origin = [x * self.scale, y * self.scale, z * self.scale];
        let reach = reach * self.scale;
        let (coarse, _) = coarse_ray(origin, unit, reach);
        // Most of the sky is nowhere near the mesh.
        if self.bounds.intersect_ray(&coarse) == f32::INFINITY {
            return false;
        }
        let exact = Ray::new(origin, unit, reach);
        use glam::UVec2; // the macro names it
        let mut hidden = false;
        let mut state = self.hierarchy.new_traversal(coarse.direction);
        let mut node;
        obvhs::traverse!(
            self.hierarchy,
            node,
            state,
            node.intersect_ray(&coarse, state.oct_inv4),
            {
                if exact.meets(&self.triangles[state.primitive_id as usize]) {
                    hidden = true;
                    break;
                }
            }
        );
        hidden
    }

    /// The centre of the mesh's bounding box, in object space.
    pub(crate) fn center(&self) -> [f64; 3] {
        self.center
    }
}

/// The ray that walks the hierarchy, in single precision. The mesh lies within √3 of the
/// centre, so that a ray from afar can start nearer without missing anything; how much nearer
/// comes with it.
fn coarse_ray(origin: [f64; 3], unit: [f64; 3], reach: f64) -> (obvhs::ray::Ray, f64) {
    let squared = origin[0] * origin[0] + origin[1] * origin[1] + origin[2] * origin[2];
    let skip = if squared > NEAR * NEAR {
        squared.sqrt() - NEAR / 2.0
    } else {
        0.0
    };
    let start = |x: usize| (origin[x] + skip * unit[x]) as f32;
    // Adding zero turns −0 into +0: the traversal takes the inverse of the one for positive and
    // its sign for negative, and misses what lies ahead.
    let along = |x: usize| unit[x] as f32 + 0.0;
    let ray = obvhs::ray::Ray::new(
        Vec3A::new(start(0), start(1), start(2)),
        Vec3A::new(along(0), along(1), along(2)),
        0.0,
        (reach - skip + SLACK) as f32,
    );
    (ray, skip)
}

/// 2ⁿ such that the largest half-extent times it is in (½, 1].
fn scale_to_one(half_extents: [f64; 3]) -> f64 {
    let largest = half_extents.into_iter().fold(0.0, f64::max);
    if largest == 0.0 {
        // A mesh at one point; nothing hits it, whatever its scale.
        return 1.0;
    }
    (-largest.log2().ceil()).exp2()
}

/// The triangles without repetitions: the same three corners, in any order, hide the same
/// directions, and a hierarchy over many equal boxes takes forever to build.
fn distinct_triangles(mesh: &TriangleMesh) -> Vec<u32> {
    let place = |vertex: u32| mesh.positions()[vertex as usize].map(|v| (v + 0.0).to_bits());
    let mut keyed: Vec<_> = mesh
        .triangles()
        .iter()
        .zip(0_u32..)
        .map(|(t, idx)| {
            let mut key = t.map(place);
            key.sort_unstable();
            (key, idx)
        })
        // With two corners at one place it hides nothing.
        .filter(|(key, _)| key[0] != key[1] && key[1] != key[2])
        .collect();
    keyed.sort_unstable();
    keyed.dedup_by_key(|(key, _)| *key);
    let distinct: Vec<_> = keyed.into_iter().map(|(_, idx)| idx).collect();
    // A hierarchy of nothing is none.
    match distinct.is_empty() {
        true => vec![0],
        false => distinct,
    }
}

/// A box of at least [`PADDING`] more than the triangle, and up to twice that: boxes of equal
/// sizes at equal distances, as of a fence, leave the builder without a best pair to merge, and
/// then it merges one a pass.
fn padded_box(corners: [[f64; 3]; 3], idx: u32) -> PaddedBox {
    let corners = corners.map(|corner| Vec3A::from_array(corner.map(|v| v as f32)));
    // Knuth's multiplicative hash, as a fraction of 1.
    let hash = idx.wrapping_mul(2_654_435_769) as f32 / u32::MAX as f32;
    let padding = PADDING * (1.0 + hash);
    let mut bounds = Aabb::from_points(&corners);
    bounds.min -= padding;
    bounds.max += padding;
    PaddedBox(bounds)
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::mesh::Part;
    use aogrid_bake_core::samples::Sample;

    use super::*;

    /// A generator of numbers in −1..1 that anyone can follow (Knuth's MMIX constants).
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    /// What the hierarchy should answer.
    fn brute_force(occluder: &Occluder, origin: [f64; 3], direction: [f64; 3], reach: f64) -> bool {
        let local = std::array::from_fn(|x| (origin[x] - occluder.center[x]) * occluder.scale);
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        let unit = direction.map(|v| v / length);
        let ray = Ray::new(local, unit, reach * occluder.scale);
        occluder.triangles.iter().any(|t| ray.meets(t))
    }

    fn nearest_by_force(occluder: &Occluder, origin: [f64; 3], direction: [f64; 3]) -> Option<Hit> {
        let local = std::array::from_fn(|x| (origin[x] - occluder.center[x]) * occluder.scale);
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        let ray = Ray::new(local, direction.map(|v| v / length), f64::INFINITY);
        let hits = occluder.triangles.iter().zip(&occluder.indices);
        let hits = hits.filter_map(|(t, &triangle)| Some((ray.distance(t)?, triangle)));
        hits.min_by(|a, b| a.partial_cmp(b).unwrap())
            .map(|(distance, triangle)| Hit {
                distance: distance / occluder.scale,
                triangle,
            })
    }

    fn moved(sample: Sample, scale: f32, offset: f32) -> TriangleMesh {
        let mesh = sample.mesh(None).unwrap();
        let place = |p: &[f32; 3]| p.map(|v| v * scale + offset);
        let positions = mesh.positions().iter().map(place).collect();
        TriangleMesh::new(positions, mesh.triangles().to_vec(), mesh.parts().to_vec()).unwrap()
    }

    #[test]
    fn the_hierarchy_answers_as_brute_force_does() {
        let mut next = numbers(1);
        let (mut hidden, mut rays) = (0, 0);
        // Also far from the origin, tiny and huge.
        for (scale, offset) in [(1.0, 0.0), (1.0, 300.0), (1e-20, 0.0), (1e20, 0.0)] {
            for sample in [Sample::Robot, Sample::Torus, Sample::Table] {
                let occluder = Occluder::new(&moved(sample, scale, offset));
                let size = f64::from(scale);
                for distance in [0.5, 3.0, 1e4] {
                    for _ in 0..500 {
                        let origin: [f64; 3] =
                            std::array::from_fn(|x| occluder.center[x] + distance * size * next());
                        // Half of them towards the mesh, which they would hardly find from afar.
                        let to: [f64; 3] = std::array::from_fn(|_| size * next());
                        let direction = match next() > 0.0 {
                            true => std::array::from_fn(|x| occluder.center[x] + to[x] - origin[x]),
                            false => to,
                        };
                        assert_eq!(
                            occluder.nearest(origin, direction),
                            nearest_by_force(&occluder, origin, direction)
                        );
                        for reach in [f64::INFINITY, size] {
                            let expected = brute_force(&occluder, origin, direction, reach);
                            assert_eq!(occluder.hides(origin, direction, reach), expected);
                            hidden += usize::from(expected);
                            rays += 1;
                        }
                    }
                }
            }
        }
        assert!(
            hidden > rays / 10 && hidden < rays / 2,
            "{hidden} of {rays}"
        );
    }

    /// A hierarchy's builder merges the best pairs of a pass; where all are equal it may find one
    /// pair a pass, and a hundred thousand triangles take minutes.
    #[test]
    fn equal_triangles_build_as_fast_as_others() {
        let at = |x: f32| {
            let t = [[x, 0.0, 0.0], [x + 0.5, 0.0, 0.0], [x, 1.0, 0.0]];
            t.map(|p| p.map(|v| v / 1024.0))
        };
        let fence: Vec<_> = (0..100_000_u32).map(|i| at(i as f32)).collect();
        let copies = vec![at(0.0); 100_000];
        let degenerate = vec![[[1.0; 3]; 3]; 100_000];
        for (triangles, hidden) in [(fence, true), (copies, true), (degenerate, false)] {
            let n = triangles.len();
            let indices = (0..n as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
            let whole = Part {
                name: "equal".into(),
                triangles: 0..n,
            };
            let mesh = TriangleMesh::new(triangles.concat(), indices.collect(), vec![whole]);
            let occluder = Occluder::new(&mesh.unwrap());
            let origin = [1e-4, 1e-4, 1.0];
            assert_eq!(
                occluder.hides(origin, [0.0, 0.0, -1.0], f64::INFINITY),
                hidden
            );
        }
    }

    /// Faces with an odd number of texels a side have directions with a zero in them.
    #[test]
    fn the_sign_of_a_zero_in_a_direction_does_not_matter() {
        let occluder = Occluder::new(&Sample::Robot.mesh(None).unwrap());
        let mut next = numbers(3);
        let mut hidden = 0;
        for _ in 0..200 {
            let origin = [next(), next(), next()];
            for axis in 0..3 {
                let mut direction = std::array::from_fn(|x| occluder.center[x] - origin[x]);
                let hides = [0.0, -0.0].map(|zero| {
                    direction[axis] = zero;
                    occluder.hides(origin, direction, f64::INFINITY)
                });
                assert_eq!(hides[0], hides[1], "{origin:?} {direction:?}");
                hidden += usize::from(hides[0]);
            }
        }
        assert!(hidden > 20, "{hidden}");
    }

    #[test]
    fn a_sheet_hides_from_both_sides_also_from_next_to_it() {
        let whole = Part {
            name: "sheet".into(),
            triangles: 0..1,
        };
        let corners = vec![[-1.0, 0.0, -1.0], [3.0, 0.0, -1.0], [-1.0, 0.0, 3.0]];
        let sheet = TriangleMesh::new(corners, vec![[0, 1, 2]], vec![whole]).unwrap();
        let occluder = Occluder::new(&sheet);
        for height in [1.0, 1e-3, 1e-6, 1e-12, 1e-100] {
            for sign in [1.0, -1.0] {
                let origin = [0.0, sign * height, 0.0];
                assert!(
                    occluder.hides(origin, [0.0, -sign, 0.0], f64::INFINITY),
                    "{height}"
                );
                assert!(!occluder.hides(origin, [0.0, sign, 0.0], f64::INFINITY));
            }
        }
        // On the sheet itself nothing is at a distance above zero.
        assert!(!occluder.hides([0.0; 3], [0.1, 1.0, 0.2], f64::INFINITY));
    }
}
