//! A BVH over triangles on an integer lattice, laid out for a traversal without a stack.

use std::time::Duration;

use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::surface::SurfacePoint;
use aogrid_grid_format::GridSpec;
use bytemuck::{Pod, Zeroable};
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::{Boundable, BvhBuildParams};
use rayon::prelude::*;

/// Coordinates are within ±2^this, so that their differences fit a signed 32-bit integer.
const COORDINATE_BITS: i32 = 29;

/// The padding of boxes in lattice steps: one to two times this. It exceeds the rounding of
/// coordinates of 2²⁹ to single floats (32 steps) of both boxes and origins. It differs from
/// triangle to triangle, because boxes of equal sizes at equal distances leave the builder without
/// a best pair.
const PADDING: f32 = 512.0;

/// The largest number of triangles in a leaf.
const MAX_LEAF_TRIANGLES: u32 = 4;

/// The number of bits of a leaf's first triangle; the bits above hold the number of triangles.
pub(super) const TRIANGLE_BITS: u32 = 28;

/// The value of `Node::triangles` of an inner node.
pub(super) const INNER_NODE: u32 = u32::MAX;

/// `Node` of `any_hit.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Node {
    pub low: [f32; 3],
    pub skip: u32,
    pub high: [f32; 3],
    pub triangles: u32,
}

/// The BVH of a mesh, and the sample positions of a grid, on a common lattice with its origin at
/// the grid's center. The lattice is as fine as 32 bits allow, which is finer than the mesh's own
/// floats.
pub(super) struct Bvh {
    pub nodes: Vec<Node>,
    /// The corners of the triangles in the order of the leaves.
    pub corners: Vec<[[i32; 3]; 3]>,
    /// The sample positions of the cells: all x, then all y, then all z.
    pub samples: Vec<i32>,
    /// Lattice steps per unit of object space.
    pub scale: f64,
}

impl Bvh {
    pub(super) fn new(mesh: &TriangleMesh, spec: &GridSpec, sample_offset: [f32; 3]) -> Self {
        let center = spec.center().map(f64::from);
        let half_extents = spec.half_extents().map(f64::from);
        let scale = scale(mesh, center, half_extents.into_iter().fold(0.0, f64::max));
        let quantize = |v: f64| (v * scale).round() as i32;
        let offset = sample_offset.map(f64::from);
        let samples = (0..3).flat_map(|x| {
            (0..spec.resolution()[x])
                .map(move |i| quantize(spec.sample_from_center([i; 3], offset)[x]))
        });
        Self {
            samples: samples.collect(),
            ..Self::of_mesh(mesh, center, scale)
        }
    }

    /// Returns the BVH for rays from points, without samples, and the center and the scale of the
    /// lattice.
    pub(super) fn of_points(
        mesh: &TriangleMesh,
        points: &[SurfacePoint],
    ) -> (Self, ([f64; 3], f64)) {
        let center = mesh.bounds().center().map(f64::from);
        let from_center = |p: &SurfacePoint| {
            let distances = [0, 1, 2].map(|x| (p.position[x] - center[x]).abs());
            distances.into_iter().fold(0.0, f64::max)
        };
        let farthest = points.iter().map(from_center).fold(0.0, f64::max);
        let scale = scale(mesh, center, farthest);
        (Self::of_mesh(mesh, center, scale), (center, scale))
    }

    fn of_mesh(mesh: &TriangleMesh, center: [f64; 3], scale: f64) -> Self {
        let to_lattice = |p: [f32; 3]| quantized(p.map(f64::from), center, scale);
        let triangles = distinct(mesh.corners().map(|t| t.map(to_lattice)).collect());
        let bvh = (!triangles.is_empty()).then(|| build(&triangles));
        let (nodes, order) = bvh.as_ref().map(flatten).unwrap_or_default();
        let corners = order.iter().map(|&t| triangles[t as usize]).collect();
        Self {
            nodes,
            corners,
            samples: vec![],
            scale,
        }
    }
}

/// Returns a position on the lattice.
pub(super) fn quantized(position: [f64; 3], center: [f64; 3], scale: f64) -> [i32; 3] {
    [0, 1, 2].map(|x| ((position[x] - center[x]) * scale).round() as i32)
}

/// Returns the scale of the lattice: the power of two that brings the mesh and what is within a distance
/// of the center along each axis within ±2²⁹.
fn scale(mesh: &TriangleMesh, center: [f64; 3], distance: f64) -> f64 {
    let bounds = mesh.bounds();
    let corners = [bounds.min, bounds.max].into_iter();
    let extents = corners.flat_map(|p| [0, 1, 2].map(|x| (f64::from(p[x]) - center[x]).abs()));
    let extent = extents.fold(distance, f64::max);
    (f64::from(COORDINATE_BITS) - extent.log2().ceil()).exp2()
}

/// Removes duplicate triangles, and those with two equal corners, which occlude nothing. A BVH
/// builder is very slow with many equal boxes.
fn distinct(triangles: Vec<[[i32; 3]; 3]>) -> Vec<[[i32; 3]; 3]> {
    let mut keyed: Vec<_> = triangles
        .into_par_iter()
        .map(|t| {
            let mut key = t;
            key.sort_unstable();
            (key, t)
        })
        .filter(|(key, _)| key[0] != key[1] && key[1] != key[2])
        .collect();
    keyed.par_sort_unstable();
    keyed.dedup_by_key(|(key, _)| *key);
    keyed.into_iter().map(|(_, t)| t).collect()
}

struct PaddedBox(Aabb);

impl Boundable for PaddedBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

fn build(triangles: &[[[i32; 3]; 3]]) -> Bvh2 {
    let padded = |(idx, t): (u32, &[[i32; 3]; 3])| {
        let corners = t.map(|p| Vec3A::from_array(p.map(|v| v as f32)));
        // Knuth's multiplicative hash, mapped to 0..1.
        let hash = idx.wrapping_mul(2_654_435_769) as f32 / u32::MAX as f32;
        let padding = PADDING * (1.0 + hash);
        let mut bounds = Aabb::from_points(&corners);
        bounds.min -= padding;
        bounds.max += padding;
        PaddedBox(bounds)
    };
    let boxes: Vec<_> = (0..).zip(triangles).map(padded).collect();
    let parameters = BvhBuildParams {
        max_prims_per_leaf: MAX_LEAF_TRIANGLES,
        ..BvhBuildParams::medium_build()
    };
    build_bvh2(&boxes, parameters, &mut Duration::default())
}

/// Returns the nodes in depth-first order, each with a link to the node to skip to; and the
/// indices of the triangles in the order of the leaves.
fn flatten(bvh: &Bvh2) -> (Vec<Node>, Vec<u32>) {
    let (mut nodes, mut order) = (Vec::new(), Vec::new());
    let mut stack = vec![0];
    while let Some(idx) = stack.pop() {
        let node: &obvhs::bvh2::node::Bvh2Node = &bvh.nodes[idx];
        let first = node.first_index as usize;
        let triangles = match node.prim_count {
            0 => {
                stack.extend([first + 1, first]);
                INNER_NODE
            }
            n => {
                let start = order.len() as u32;
                order.extend(&bvh.primitive_indices[first..first + n as usize]);
                start | n << TRIANGLE_BITS
            }
        };
        nodes.push(Node {
            low: node.aabb.min.to_array(),
            high: node.aabb.max.to_array(),
            skip: 0,
            triangles,
        });
    }
    // A leaf skips to the following node. An inner node skips to where its second child skips to;
    // that child is where its first child skips to.
    for idx in (0..nodes.len()).rev() {
        let next = idx as u32 + 1;
        nodes[idx].skip = match nodes[idx].triangles {
            INNER_NODE => nodes[nodes[idx + 1].skip as usize].skip,
            _ => next,
        };
    }
    (nodes, order)
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::Placement;
    use aogrid_bake_core::models::Model;

    use super::*;

    #[test]
    fn leaves_cover_every_triangle_once_and_boxes_contain_their_subtrees() {
        for sample in [Model::Box, Model::SpaceShip, Model::Robot] {
            let mesh = sample.mesh(None).unwrap();
            let spec = Placement::paper().place(&mesh.bounds()).unwrap();
            let bvh = Bvh::new(&mesh, &spec, [0.0; 3]);
            assert_eq!(bvh.corners.len(), mesh.triangles().len());
            let mut seen = vec![0; bvh.corners.len()];
            for (idx, node) in bvh.nodes.iter().enumerate() {
                assert!(node.skip as usize > idx && node.skip as usize <= bvh.nodes.len());
                // All nodes before the one to skip to form the subtree.
                for inner in &bvh.nodes[idx..node.skip as usize] {
                    for x in 0..3 {
                        assert!(inner.low[x] >= node.low[x] && inner.high[x] <= node.high[x]);
                    }
                }
                if node.triangles == INNER_NODE {
                    continue;
                }
                assert_eq!(node.skip as usize, idx + 1);
                let start = (node.triangles & ((1 << TRIANGLE_BITS) - 1)) as usize;
                let n = (node.triangles >> TRIANGLE_BITS) as usize;
                seen[start..start + n].iter_mut().for_each(|n| *n += 1);
                for triangle in &bvh.corners[start..start + n] {
                    for corner in triangle {
                        assert!((0..3).all(|x| corner[x] as f32 >= node.low[x]));
                        assert!((0..3).all(|x| corner[x] as f32 <= node.high[x]));
                    }
                }
            }
            assert!(seen.iter().all(|n| *n == 1));
        }
    }
}
