//! The inputs of the BVH's builder: distinct triangles, their scale and their padded boxes.

use aogrid_bake_core::TriangleMesh;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;
use obvhs::{Boundable, BvhBuildParams};

use super::packed_ray::Extent;

/// The minimum distance between a box and its triangle, in largest coordinates of the mesh. The
/// start of a ray is up to 2√3 away from the center, so its rounding, that of its direction and those
/// of the box test move the ray by less than 2⁻²⁴ · 2√3 · 10, a seventh of this.
const PADDING: f64 = 1.0 / 65536.0;

/// The largest coordinate up to which single precision decides about triangles. Only triangles
/// without an area can be further away; their areas could overflow.
const MAX_REACH: f64 = 1e6;

/// Returns the extent of scaled triangles.
pub(super) fn extent(triangles: impl Iterator<Item = [[f64; 3]; 3]>) -> Extent {
    let sizes = triangles.map(|t| {
        t.as_flattened()
            .iter()
            .fold(0.0, |max: f64, v| max.max(v.abs()))
    });
    let reach = sizes.fold(0.0, f64::max);
    Extent {
        // An infinite error leaves everything to double precision.
        reach: if reach > MAX_REACH {
            f64::INFINITY
        } else {
            reach
        },
        padding: 2.0 * PADDING * reach,
    }
}

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
/// Also returns, in order, those of them that another one of the same corners faces the other way from.
pub(super) fn distinct_triangles(mesh: &TriangleMesh) -> (Vec<u32>, Vec<u32>) {
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
    let facing = |idx: u32| {
        let corners = mesh.triangles()[idx as usize].map(position_bits);
        let ascending = [[0, 1], [1, 2], [2, 0]].map(|[a, b]| corners[a] < corners[b]);
        // One or two of the pairs of three different corners in a circle ascend.
        ascending.into_iter().filter(|ascends| *ascends).count() == 2
    };
    let (mut distinct, mut two_sided) = (Vec::with_capacity(keyed.len()), Vec::new());
    for same in keyed.chunk_by(|(a, _), (b, _)| a == b) {
        let (_, first) = same[0];
        distinct.push(first);
        if same.iter().any(|(_, idx)| facing(*idx) != facing(first)) {
            two_sided.push(first);
        }
    }
    // The builder needs at least one triangle, degenerate or not.
    if distinct.is_empty() {
        distinct.push(0);
    }
    two_sided.sort_unstable();
    (distinct, two_sided)
}

/// Returns the bounding box of a triangle, padded by one to two times [`PADDING`].
///
/// The padding varies because equal boxes at equal distances, such as those of a fence, give the
/// builder no best pair to merge, and it then merges only one pair per pass.
pub(super) fn padded_box(corners: &[[f64; 3]; 3], idx: u32, extent: Extent) -> PaddedBox {
    let corners = corners.map(|corner| Vec3A::from_array(corner.map(|v| v as f32)));
    // Knuth's multiplicative hash, as a fraction of 1.
    let hash = idx.wrapping_mul(2_654_435_769) as f32 / u32::MAX as f32;
    let padding = 0.5 * extent.padding as f32 * (1.0 + hash);
    let mut bounds = Aabb::from_points(&corners);
    bounds.min -= padding;
    bounds.max += padding;
    PaddedBox(bounds)
}

/// Returns the tree of the boxes. The library's own function for this reads a clock, which browsers do
/// not have.
pub(super) fn binary_tree(boxes: &[PaddedBox]) -> Bvh2 {
    let params = BvhBuildParams::medium_build();
    let indices = (0..boxes.len() as u32).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        params.ploc_search_distance,
        boxes,
        indices,
        params.sort_precision,
        params.search_depth_threshold,
    );
    let mut optimizer = ReinsertionOptimizer::default();
    let ratio = params.reinsertion_batch_ratio;
    optimizer.run(&mut tree, ratio, None);
    let max_leaf = params.max_prims_per_leaf;
    collapse(&mut tree, max_leaf, params.collapse_traversal_cost);
    let ratio = ratio * params.post_collapse_reinsertion_batch_ratio_multiplier;
    optimizer.run(&mut tree, ratio, None);
    tree
}
