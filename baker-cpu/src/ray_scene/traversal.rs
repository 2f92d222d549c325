//! Traversals of the tree, compiled for each SIMD level.

use super::kernels::{Kernel, Query};
use super::packed_ray::PackedRay;
use super::tree::{Child, Leaf, Node, Tree, WIDTH};
use super::{Hit, RayScene};
use crate::triangle::Ray;

/// The number of waiting children that fit a traversal's own stack. Few trees are deeper; under test
/// many are.
pub(super) const STACK: usize = if cfg!(test) { 16 } else { 128 };

/// A ray to cast into a scene, in scaled units relative to its center.
pub(super) struct Cast<'a> {
    pub scene: &'a RayScene,
    pub origin: [f64; 3],
    /// The direction, of length 1.
    pub unit: [f64; 3],
    pub max_distance: f64,
}

impl Cast<'_> {
    /// Returns the ray of the exact test, and that of the tree.
    #[inline(always)]
    fn rays(&self) -> (Ray, PackedRay) {
        let exact = Ray::new(self.origin, self.unit, self.max_distance);
        let packed = PackedRay::new(&exact, self.unit, self.scene.extent);
        (exact, packed)
    }
}

/// Whether a ray hits any triangle, or, with `FRONTS`, one that faces it.
pub(super) struct AnyHit<'a, const FRONTS: bool>(pub Cast<'a>);

impl<const FRONTS: bool> Query for AnyHit<'_, FRONTS> {
    type Answer = bool;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> bool {
        let max_waiting = self.0.scene.tree.max_waiting;
        let mut own = [0; STACK];
        let mut larger;
        // One call with a slice: a call for each kind of stack would compile the traversal twice.
        let stack = match max_waiting <= STACK {
            true => &mut own[..],
            false => {
                larger = vec![0; max_waiting];
                &mut larger[..]
            }
        };
        self.traverse(kernel, stack)
    }
}

impl<const FRONTS: bool> AnyHit<'_, FRONTS> {
    #[inline(always)]
    fn traverse<K: Kernel>(&self, kernel: K, stack: &mut [u32]) -> bool {
        let (exact, packed) = self.0.rays();
        let tree = &self.0.scene.tree;
        let mut waiting = 0;
        let mut child = Tree::ROOT;
        loop {
            match Child::new(child) {
                Child::Node(node) => {
                    let node = &tree.nodes[node as usize];
                    let met = kernel.boxes(node, &packed, &mut [0.0; WIDTH]);
                    if met != 0 {
                        child = push_all_but_first(kernel, tree, (node, met), stack, &mut waiting);
                        continue;
                    }
                }
                Child::Leaf(leaf) => {
                    let leaf = &tree.leaves[leaf as usize];
                    let mut hits = kernel.triangles(leaf, &packed);
                    if FRONTS {
                        hits.certain = self.fronts(leaf, hits.certain);
                        hits.doubt = self.fronts(leaf, hits.doubt);
                    }
                    if hits.certain != 0 || self.any_hit_in_doubt(&exact, leaf, hits.doubt) {
                        return true;
                    }
                }
            }
            if waiting == 0 {
                return false;
            }
            waiting -= 1;
            child = stack[waiting];
        }
    }

    /// Returns those of some triangles of a leaf that face the ray.
    #[inline(always)]
    fn fronts(&self, leaf: &Leaf, mut lanes: u32) -> u32 {
        let mut fronts = 0;
        while lanes != 0 {
            let lane = lanes.trailing_zeros();
            lanes &= lanes - 1;
            let at = (leaf.first + lane) as usize;
            fronts |= u32::from(self.0.scene.faces_against(at, self.0.unit)) << lane;
        }
        fronts
    }

    /// Whether the exact test says that a ray hits one of some triangles of a leaf.
    #[inline(always)]
    fn any_hit_in_doubt(&self, exact: &Ray, leaf: &Leaf, mut doubt: u32) -> bool {
        while doubt != 0 {
            let triangle = leaf.first + doubt.trailing_zeros();
            if exact.hits(&self.0.scene.triangles[triangle as usize]) {
                return true;
            }
            doubt &= doubt - 1;
        }
        false
    }
}

/// Lets all children that a ray meets wait but for one, and returns that. At least one is met.
#[inline(always)]
fn push_all_but_first<K: Kernel>(
    kernel: K,
    tree: &Tree,
    (node, mut met): (&Node, u32),
    stack: &mut [u32],
    waiting: &mut usize,
) -> u32 {
    let first = node.child(met.trailing_zeros() as usize);
    kernel.prefetch(tree, first);
    met &= met - 1;
    while met != 0 {
        let other = node.child(met.trailing_zeros() as usize);
        kernel.prefetch(tree, other);
        stack[*waiting] = other;
        *waiting += 1;
        met &= met - 1;
    }
    first
}

/// The closest hit of a ray, in scaled units.
pub(super) struct ClosestHit<'a>(pub Cast<'a>);

impl Query for ClosestHit<'_> {
    type Answer = Option<Hit>;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> Option<Hit> {
        let max_waiting = self.0.scene.tree.max_waiting;
        let mut own = [(0.0, 0); STACK];
        let mut larger;
        let stack = match max_waiting <= STACK {
            true => &mut own[..],
            false => {
                larger = vec![(0.0, 0); max_waiting];
                &mut larger[..]
            }
        };
        self.traverse(kernel, stack)
    }
}

impl ClosestHit<'_> {
    #[inline(always)]
    fn traverse<K: Kernel>(&self, kernel: K, stack: &mut [(f32, u32)]) -> Option<Hit> {
        let (exact, mut packed) = self.0.rays();
        let tree = &self.0.scene.tree;
        let mut closest: Option<Hit> = None;
        let mut distances = [0.0; WIDTH];
        stack[0] = (0.0, Tree::ROOT);
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let (distance, child) = stack[waiting];
            if distance > packed.t_max {
                continue;
            }
            match Child::new(child) {
                Child::Node(node) => {
                    let node = &tree.nodes[node as usize];
                    let mut met = kernel.boxes(node, &packed, &mut distances);
                    let first = waiting;
                    while met != 0 {
                        let lane = met.trailing_zeros() as usize % WIDTH;
                        let child = node.child(lane);
                        kernel.prefetch(tree, child);
                        insert(stack, first, waiting, (distances[lane], child));
                        waiting += 1;
                        met &= met - 1;
                    }
                }
                Child::Leaf(leaf) => {
                    let leaf = &tree.leaves[leaf as usize];
                    let hits = kernel.triangles(leaf, &packed);
                    self.update(&exact, leaf, hits.certain | hits.doubt, &mut closest);
                    if let Some(closest) = &closest {
                        packed.shorten(closest.distance, self.0.scene.extent);
                    }
                }
            }
        }
        closest
    }

    /// Compares the closest hit with those of some triangles of a leaf.
    #[inline(always)]
    fn update(&self, exact: &Ray, leaf: &Leaf, mut lanes: u32, closest: &mut Option<Hit>) {
        let scene = self.0.scene;
        while lanes != 0 {
            let at = (leaf.first + lanes.trailing_zeros()) as usize;
            lanes &= lanes - 1;
            let Some(distance) = exact.hit_distance(&scene.triangles[at]) else {
                continue;
            };
            let triangle = scene.indices[at];
            // Ties go to the smaller index, so that the result does not depend on the order of the
            // traversal.
            if closest.is_none_or(|n| (distance, triangle) < (n.distance, n.triangle)) {
                *closest = Some(Hit { distance, triangle });
            }
        }
    }
}

/// Inserts a child among those from `first` to `end`, which are sorted: the nearest is last.
#[inline(always)]
fn insert(stack: &mut [(f32, u32)], first: usize, end: usize, child: (f32, u32)) {
    let mut at = end;
    while at > first && stack[at - 1].0 < child.0 {
        stack[at] = stack[at - 1];
        at -= 1;
    }
    stack[at] = child;
}
