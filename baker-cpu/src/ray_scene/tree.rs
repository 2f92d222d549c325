//! A tree of nodes with eight children, and leaves of up to eight triangles.

use obvhs::bvh2::{Bvh2, node::Bvh2Node};

/// The number of children of a node, and of triangles of a leaf: the lanes of a register of 32
/// bytes.
pub(super) const WIDTH: usize = 8;

/// One number for each child or triangle.
pub(super) type Lanes = [f32; WIDTH];

/// The bit of a child that is a leaf.
const LEAF: u32 = 1 << 31;

/// An inner node.
#[repr(align(32))]
pub(super) struct Node {
    /// The planes of the children's boxes: the minimum along x, y and z, then the maximum. The box of
    /// a missing child is empty: no ray hits it.
    pub planes: [Lanes; 6],
    children: [u32; WIDTH],
}

/// Up to eight triangles.
#[repr(align(32))]
pub(super) struct Leaf {
    /// The corners, coordinate by coordinate, in single precision. Lanes past the last triangle are
    /// zero.
    pub corners: [[Lanes; 3]; 3],
    /// The position of the first triangle in the order of the leaves.
    pub first: u32,
    /// A bit for each triangle.
    pub used: u32,
}

/// A child of a node.
pub(super) enum Child {
    Node(u32),
    Leaf(u32),
}

impl Node {
    const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
        ],
        children: [0; WIDTH],
    };

    /// Returns a child as a number for a stack.
    #[inline(always)]
    pub(super) fn child(&self, lane: usize) -> u32 {
        self.children[lane % WIDTH]
    }

    fn set(&mut self, lane: usize, node: &Bvh2Node, child: u32) {
        for axis in 0..3 {
            self.planes[axis][lane] = node.aabb.min[axis];
            self.planes[3 + axis][lane] = node.aabb.max[axis];
        }
        self.children[lane] = child;
    }
}

impl Child {
    #[inline(always)]
    pub(super) fn new(number: u32) -> Self {
        match number & LEAF {
            0 => Self::Node(number),
            _ => Self::Leaf(number & !LEAF),
        }
    }
}

/// A tree over triangles. Its root is the node 0.
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    pub leaves: Vec<Leaf>,
    /// The maximum number of children that wait during a traversal.
    pub max_waiting: usize,
}

impl Tree {
    /// The root as a child.
    pub(super) const ROOT: u32 = 0;

    /// Merges the nodes of a binary tree into wide ones. `corners` are those of the triangles in the
    /// order of the binary tree's leaves, which this tree keeps.
    pub(super) fn new(binary: &Bvh2, corners: &[[[f64; 3]; 3]]) -> Self {
        let mut tree = Self {
            nodes: vec![Node::EMPTY],
            leaves: Vec::new(),
            max_waiting: 0,
        };
        // The node to fill, the root of its binary subtree, and the children that wait above it.
        let mut open = vec![(0, 0, 0)];
        while let Some((idx, root, waiting)) = open.pop() {
            let children = merged_children(binary, root);
            let waiting = waiting + children.len();
            tree.max_waiting = tree.max_waiting.max(waiting);
            for (lane, &child) in children.iter().enumerate() {
                let node = &binary.nodes[child];
                let number = match node.is_leaf() {
                    true => tree.add_leaf(node, corners),
                    false => {
                        tree.nodes.push(Node::EMPTY);
                        open.push((tree.nodes.len() - 1, child, waiting));
                        tree.nodes.len() as u32 - 1
                    }
                };
                tree.nodes[idx].set(lane, node, number);
            }
        }
        tree
    }

    /// Appends a leaf and returns its number as a child.
    fn add_leaf(&mut self, node: &Bvh2Node, corners: &[[[f64; 3]; 3]]) -> u32 {
        let (first, n) = (node.first_index, node.prim_count as usize);
        let mut leaf = Leaf {
            corners: Default::default(),
            first,
            used: u32::MAX >> (32 - n.min(WIDTH)),
        };
        for (lane, triangle) in corners[first as usize..][..n].iter().enumerate() {
            for (to, corner) in leaf.corners.iter_mut().zip(triangle) {
                for (to, &v) in to.iter_mut().zip(corner) {
                    to[lane] = v as f32;
                }
            }
        }
        self.leaves.push(leaf);
        (self.leaves.len() as u32 - 1) | LEAF
    }
}

/// Returns up to eight descendants that together cover a node of the binary tree: its children, then
/// again and again the children of the largest of them.
fn merged_children(binary: &Bvh2, root: usize) -> Vec<usize> {
    let mut children = vec![root];
    while children.len() < WIDTH {
        let area = |&child: &usize| binary.nodes[child].aabb.half_area();
        let inner = (0..children.len()).filter(|&at| !binary.nodes[children[at]].is_leaf());
        let largest = inner.max_by(|&a, &b| area(&children[a]).total_cmp(&area(&children[b])));
        let Some(at) = largest else {
            break;
        };
        let first = binary.nodes[children[at]].first_index as usize;
        children[at] = first;
        children.push(first + 1);
    }
    children
}
