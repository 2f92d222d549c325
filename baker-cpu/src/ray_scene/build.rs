//! The inputs of the BVH's builder: distinct triangles, their scale and their padded boxes.

use aogrid_bake_core::TriangleMesh;
use glam::Vec3A;
use obvhs::Boundable;
use obvhs::aabb::Aabb;

/// The minimum distance between a BVH box and its triangle, for a mesh whose half-extent is scaled
/// to ½–1. It exceeds the traversal's minimum distance of 1e-4, and far exceeds the rounding error
/// of single precision (2⁻²⁴ · 8).
const PADDING: f32 = 1.0 / 4096.0;

/// The length by which the traversal ray exceeds the exact ray: the maximum padding of a box, twice
/// [`PADDING`].
pub(super) const MAX_PADDING: f64 = 2.0 * PADDING as f64;

/// The padded bounding box of a triangle.
pub(super) struct PaddedBox(pub Aabb);

impl Boundable for PaddedBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// Returns the power of two that scales the largest half-extent into (½, 1].
pub(super) fn power_of_two_scale(half_extents: [f64; 3]) -> f64 {
    let largest = half_extents.into_iter().fold(0.0, f64::max);
    if largest == 0.0 {
        // The mesh is a single point, which no ray hits at any scale.
        return 1.0;
    }
    (-largest.log2().ceil()).exp2()
}

/// Returns the indices of the triangles without duplicates and without those that have two equal
/// corners; at least one index.
///
/// Triangles with the same three corners, in any order, occlude the same directions, and a BVH over
/// many equal boxes is very slow to build.
pub(super) fn distinct_triangles(mesh: &TriangleMesh) -> Vec<u32> {
    // Adding zero makes −0 and +0 equal.
    let position_bits =
        |vertex: u32| mesh.positions()[vertex as usize].map(|v| (v + 0.0).to_bits());
    let mut keyed: Vec<_> = mesh
        .triangles()
        .iter()
        .zip(0_u32..)
        .map(|(t, idx)| {
            let mut key = t.map(position_bits);
            key.sort_unstable();
            (key, idx)
        })
        // A triangle with two equal corners is never hit.
        .filter(|(key, _)| key[0] != key[1] && key[1] != key[2])
        .collect();
    keyed.sort_unstable();
    keyed.dedup_by_key(|(key, _)| *key);
    let distinct: Vec<_> = keyed.into_iter().map(|(_, idx)| idx).collect();
    // The builder needs at least one triangle, degenerate or not.
    match distinct.is_empty() {
        true => vec![0],
        false => distinct,
    }
}

/// Returns the bounding box of a triangle, padded by one to two times [`PADDING`].
///
/// The padding varies because equal boxes at equal distances, such as those of a fence, give the
/// builder no best pair to merge, and it then merges only one pair per pass.
pub(super) fn padded_box(corners: [[f64; 3]; 3], idx: u32) -> PaddedBox {
    let corners = corners.map(|corner| Vec3A::from_array(corner.map(|v| v as f32)));
    // Knuth's multiplicative hash, as a fraction of 1.
    let hash = idx.wrapping_mul(2_654_435_769) as f32 / u32::MAX as f32;
    let padding = PADDING * (1.0 + hash);
    let mut bounds = Aabb::from_points(&corners);
    bounds.min -= padding;
    bounds.max += padding;
    PaddedBox(bounds)
}
