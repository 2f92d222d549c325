//! Refinement: more triangles for the same shape.

use std::collections::{BinaryHeap, HashMap};

use super::builder::Builder;
use super::shapes::Surface;

/// An edge, the lower vertex index first.
type Edge = [u32; 2];

fn edge(a: u32, b: u32) -> Edge {
    [a.min(b), a.max(b)]
}

/// Splits the longest edge repeatedly until there are `requested` triangles or one more: the two
/// triangles at an interior edge become four.
pub(super) fn refine(model: &mut Builder, requested: usize, surface: Surface) {
    if model.triangle_count() >= requested {
        return;
    }
    // The triangles at each edge; a boundary edge has the same triangle twice.
    let mut triangles_at: HashMap<Edge, [u32; 2]> = HashMap::new();
    for (idx, &[a, b, c]) in (0..).zip(&model.triangles) {
        for e in [edge(a, b), edge(b, c), edge(c, a)] {
            triangles_at
                .entry(e)
                .and_modify(|pair| pair[1] = idx)
                .or_insert([idx; 2]);
        }
    }
    let mut longest: BinaryHeap<(u64, Edge)> = triangles_at
        .keys()
        .map(|&e| (length(model, e), e))
        .collect();
    while model.triangle_count() < requested {
        let (_, e) = longest.pop().expect("every split adds edges");
        split(model, &mut triangles_at, &mut longest, e, surface);
    }
}

/// Returns the bits of an edge's squared length, which sort like the number.
fn length(model: &Builder, [a, b]: Edge) -> u64 {
    let (a, b) = (model.positions[a as usize], model.positions[b as usize]);
    (0..3).map(|x| (a[x] - b[x]).powi(2)).sum::<f64>().to_bits()
}

/// Splits edge `e` at its middle, and updates the triangles at each edge and the queue of edges.
fn split(
    model: &mut Builder,
    triangles_at: &mut HashMap<Edge, [u32; 2]>,
    longest: &mut BinaryHeap<(u64, Edge)>,
    e: Edge,
    surface: Surface,
) {
    let old = triangles_at.remove(&e).expect("an edge is split once");
    let middle = model.vertex(middle(model, e, surface));
    // The triangles at the two halves of the edge, and the new edges to the opposite corners.
    let mut halves = [[0; 2]; 2];
    let mut spokes = Vec::with_capacity(2);
    // A boundary edge has one triangle, which is listed twice.
    let sides = if old[0] == old[1] { 0..1 } else { 0..2 };
    for side in sides {
        let idx = old[side];
        // Rotated so that it starts with the edge, the triangle is (from, to, apex).
        let t = model.triangles[idx as usize];
        let first = (0..3)
            .find(|&i| edge(t[i], t[(i + 1) % 3]) == e)
            .expect("the triangle has the edge");
        let [from, to, apex] = [0, 1, 2].map(|i| t[(first + i) % 3]);
        let new = model.triangles.len() as u32;
        model.triangles[idx as usize] = [from, middle, apex];
        model.triangles.push([middle, to, apex]);
        model.part_of.push(model.part_of[idx as usize]);
        // The edge (to, apex) now belongs to the new triangle.
        let moved = triangles_at
            .get_mut(&edge(to, apex))
            .expect("it is an edge of the triangle");
        moved
            .iter_mut()
            .filter(|t| **t == idx)
            .for_each(|t| *t = new);
        let (from_end, to_end) = (usize::from(from == e[1]), usize::from(to == e[1]));
        halves[from_end][side..].fill(idx);
        halves[to_end][side..].fill(new);
        spokes.push((edge(middle, apex), [idx, new]));
    }
    let halves = [0, 1].map(|end| (edge(e[end], middle), halves[end]));
    for (e, pair) in halves.into_iter().chain(spokes) {
        triangles_at.insert(e, pair);
        longest.push((length(model, e), e));
    }
}

fn middle(model: &Builder, [a, b]: Edge, surface: Surface) -> [f64; 3] {
    let (a, b) = (model.positions[a as usize], model.positions[b as usize]);
    surface(std::array::from_fn(|x| (a[x] + b[x]) / 2.0))
}

/// Subdivides every triangle into four.
pub(super) fn subdivide(model: &mut Builder, surface: Surface) {
    let coarse = std::mem::take(&mut model.triangles);
    let part_of = std::mem::take(&mut model.part_of);
    let mut middles: HashMap<Edge, u32> = HashMap::new();
    for ([a, b, c], part) in coarse.into_iter().zip(part_of) {
        let [ab, bc, ca] = [edge(a, b), edge(b, c), edge(c, a)].map(|e| {
            *middles.entry(e).or_insert_with(|| {
                model.positions.push(middle(model, e, surface));
                model.positions.len() as u32 - 1
            })
        });
        for t in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            model.triangles.push(t);
            model.part_of.push(part);
        }
    }
}
