//! Triangles on a lattice and a tree over them, laid out for a walk without a stack.

use std::time::Duration;

use aogrid_bake_core::TriangleMesh;
use aogrid_grid_format::GridSpec;
use bytemuck::{Pod, Zeroable};
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::{Boundable, BvhBuildParams};
use rayon::prelude::*;

/// Coordinates reach 2^this: differences then fit 32 bits with their sign.
const REACH_BITS: i32 = 29;

/// Boxes are larger than their triangles by this many steps, and up to twice that: more than
/// single floats round coordinates of 2²⁹ (32 steps), boxes' and origins'. Different for each,
/// because boxes of equal sizes at equal distances leave the builder without a best pair.
const PADDING: f32 = 512.0;

/// Triangles of a leaf, at most.
const MOST_IN_LEAF: u32 = 4;

/// Bits of a node's first triangle; those above hold how many there are.
pub(super) const TRIANGLE_BITS: u32 = 28;

/// Marks a node that is no leaf.
pub(super) const INNER: u32 = u32::MAX;

/// `Node` of `any_hit.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Node {
    pub low: [f32; 3],
    pub skip: u32,
    pub high: [f32; 3],
    pub triangles: u32,
}

/// A mesh and a grid's samples on one lattice with its zero at the grid's centre: as fine as
/// 32 bits allow, which is finer than the mesh's own floats.
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    /// In the order of the leaves.
    pub corners: Vec<[[i32; 3]; 3]>,
    /// Where samples lie: of all x, then all y, then all z.
    pub samples: Vec<i32>,
    /// Lattice steps in a unit of object space.
    pub scale: f64,
}

impl Tree {
    pub(super) fn new(mesh: &TriangleMesh, spec: &GridSpec, sample_offset: [f32; 3]) -> Self {
        let center = spec.center().map(f64::from);
        let scale = scale(mesh, spec);
        let step = |v: f64| (v * scale).round() as i32;
        let place = |p: [f32; 3]| std::array::from_fn(|x| step(f64::from(p[x]) - center[x]));
        let triangles = distinct(mesh.corners().map(|t| t.map(place)).collect());
        let hierarchy = (!triangles.is_empty()).then(|| build(&triangles));
        let (nodes, order) = hierarchy.as_ref().map(flatten).unwrap_or_default();
        let corners = order.iter().map(|&t| triangles[t as usize]).collect();
        let offset = sample_offset.map(f64::from);
        let samples = (0..3).flat_map(|x| {
            (0..spec.resolution()[x]).map(move |i| step(spec.sample_from_center([i; 3], offset)[x]))
        });
        Self {
            nodes,
            corners,
            samples: samples.collect(),
            scale,
        }
    }
}

/// A power of two that takes everything to within 2²⁹.
fn scale(mesh: &TriangleMesh, spec: &GridSpec) -> f64 {
    let bounds = mesh.bounds();
    let reach = |x: usize| {
        let center = f64::from(spec.center()[x]);
        let of_mesh = [bounds.min[x], bounds.max[x]].map(|v| (f64::from(v) - center).abs());
        // Samples lie within the box.
        of_mesh[0]
            .max(of_mesh[1])
            .max(f64::from(spec.half_extents()[x]))
    };
    let reach = reach(0).max(reach(1)).max(reach(2));
    (f64::from(REACH_BITS) - reach.log2().ceil()).exp2()
}

/// Triangles without repetitions and without those that hide nothing: a builder takes forever
/// over many equal boxes.
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
        // Knuth's multiplicative hash, as a fraction of 1.
        let hash = idx.wrapping_mul(2_654_435_769) as f32 / u32::MAX as f32;
        let padding = PADDING * (1.0 + hash);
        let mut bounds = Aabb::from_points(&corners);
        bounds.min -= padding;
        bounds.max += padding;
        PaddedBox(bounds)
    };
    let boxes: Vec<_> = (0..).zip(triangles).map(padded).collect();
    let parameters = BvhBuildParams {
        max_prims_per_leaf: MOST_IN_LEAF,
        ..BvhBuildParams::medium_build()
    };
    build_bvh2(&boxes, parameters, &mut Duration::default())
}

/// The nodes in the order of a walk that visits everything, with where to go on after each; and
/// the triangles in the order of the leaves.
fn flatten(hierarchy: &Bvh2) -> (Vec<Node>, Vec<u32>) {
    let (mut nodes, mut order) = (Vec::new(), Vec::new());
    let mut stack = vec![0];
    while let Some(idx) = stack.pop() {
        let node: &obvhs::bvh2::node::Bvh2Node = &hierarchy.nodes[idx];
        let first = node.first_index as usize;
        let triangles = match node.prim_count {
            0 => {
                stack.extend([first + 1, first]);
                INNER
            }
            n => {
                let start = order.len() as u32;
                order.extend(&hierarchy.primitive_indices[first..first + n as usize]);
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
    // A leaf's next is the one after it; an inner node's is that of its second child, which is
    // the next of its first.
    for idx in (0..nodes.len()).rev() {
        let next = idx as u32 + 1;
        nodes[idx].skip = match nodes[idx].triangles {
            INNER => nodes[nodes[idx + 1].skip as usize].skip,
            _ => next,
        };
    }
    (nodes, order)
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::Placement;
    use aogrid_bake_core::samples::Sample;

    use super::*;

    #[test]
    fn a_walk_visits_every_triangle_once_and_boxes_hold_what_is_below() {
        for sample in [Sample::Box, Sample::SpaceShip, Sample::Robot] {
            let mesh = sample.mesh(None).unwrap();
            let spec = Placement::default().place(&mesh.bounds()).unwrap();
            let tree = Tree::new(&mesh, &spec, [0.0; 3]);
            assert_eq!(tree.corners.len(), mesh.triangles().len());
            let mut seen = vec![0; tree.corners.len()];
            for (idx, node) in tree.nodes.iter().enumerate() {
                assert!(node.skip as usize > idx && node.skip as usize <= tree.nodes.len());
                // Everything up to where the walk goes on is inside.
                for inner in &tree.nodes[idx..node.skip as usize] {
                    for x in 0..3 {
                        assert!(inner.low[x] >= node.low[x] && inner.high[x] <= node.high[x]);
                    }
                }
                if node.triangles == INNER {
                    continue;
                }
                assert_eq!(node.skip as usize, idx + 1);
                let start = (node.triangles & ((1 << TRIANGLE_BITS) - 1)) as usize;
                let n = (node.triangles >> TRIANGLE_BITS) as usize;
                seen[start..start + n].iter_mut().for_each(|n| *n += 1);
                for triangle in &tree.corners[start..start + n] {
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
