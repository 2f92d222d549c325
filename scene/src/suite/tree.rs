//! A tree of boxes over triangles, which finds the closest point.

use glam::DVec3;

use super::triangle::Triangle;

/// The triangles of a leaf, at the most.
const MAX_LEAF: usize = 6;

/// A binary tree; a node's first child follows it.
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// The indices of the triangles, leaf by leaf.
    order: Vec<u32>,
}

struct Node {
    low: DVec3,
    high: DVec3,
    /// The range of `order`.
    start: usize,
    end: usize,
    /// The second child's index; 0 for a leaf.
    second: usize,
}

impl Tree {
    pub(super) fn new(triangles: &[Triangle]) -> Self {
        let mut tree = Self {
            nodes: vec![],
            order: (0..triangles.len() as u32).collect(),
        };
        tree.split(triangles, 0, triangles.len());
        tree
    }

    /// Adds the node of a range of `order`, and those below it.
    fn split(&mut self, triangles: &[Triangle], start: usize, end: usize) {
        let corners = |idx: &u32| triangles[*idx as usize].corners;
        let all = self.order[start..end].iter().flat_map(corners);
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let [low, high] = all.fold(none, |[low, high], p| [low.min(p), high.max(p)]);
        let node = self.nodes.len();
        self.nodes.push(Node {
            low,
            high,
            start,
            end,
            second: 0,
        });
        if end - start <= MAX_LEAF {
            return;
        }
        // Halve the triangles along the longest side.
        let size = high - low;
        let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b]));
        let axis = axis.expect("there are three axes");
        let along = |idx: &u32| corners(idx).iter().map(|p| p[axis]).sum::<f64>();
        let middle = (end - start) / 2;
        self.order[start..end].select_nth_unstable_by(middle, |a, b| along(a).total_cmp(&along(b)));
        self.split(triangles, start, start + middle);
        self.nodes[node].second = self.nodes.len();
        self.split(triangles, start + middle, end);
    }

    /// Returns the closest point of the triangles that is nearer than `limit`, if there is one.
    pub(super) fn closest(
        &self,
        triangles: &[Triangle],
        point: DVec3,
        limit: f64,
    ) -> Option<DVec3> {
        let (mut best, mut found) = (limit, None);
        let mut stack = vec![0];
        while let Some(idx) = stack.pop() {
            let node = &self.nodes[idx];
            if point.distance(point.clamp(node.low, node.high)) >= best {
                continue;
            }
            if node.second > 0 {
                stack.extend([node.second, idx + 1]);
                continue;
            }
            for &triangle in &self.order[node.start..node.end] {
                let candidate = triangles[triangle as usize].closest(point);
                let distance = point.distance(candidate);
                if distance < best {
                    (best, found) = (distance, Some(candidate));
                }
            }
        }
        found
    }
}
