//! More triangles for the same shape.

use std::collections::{BinaryHeap, HashMap};

use super::builder::Builder;
use super::models::Surface;

/// An edge, its lower vertex first.
type Edge = [u32; 2];

fn edge(a: u32, b: u32) -> Edge {
    [a.min(b), a.max(b)]
}

/// Splits the longest edge, again and again, until there are `wished` triangles or one more: an
/// edge inside a mesh has two triangles, which become four.
pub(super) fn refine(model: &mut Builder, wished: usize, surface: Surface) {
    if model.triangle_count() >= wished {
        return;
    }
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
    while model.triangle_count() < wished {
        let (_, e) = longest.pop().expect("every split leaves edges behind");
        split(model, &mut triangles_at, &mut longest, e, surface);
    }
}

/// The squared length of an edge as bits, which sort as the number does.
fn length(model: &Builder, [a, b]: Edge) -> u64 {
    let (a, b) = (model.positions[a as usize], model.positions[b as usize]);
    (0..3).map(|x| (a[x] - b[x]).powi(2)).sum::<f64>().to_bits()
}

fn split(
    model: &mut Builder,
    triangles_at: &mut HashMap<Edge, [u32; 2]>,
    longest: &mut BinaryHeap<(u64, Edge)>,
    e: Edge,
    surface: Surface,
) {
    let old = triangles_at.remove(&e).expect("an edge is split once");
    let middle = model.vertex(middle(model, e, surface));
    let mut halves = [[0; 2]; 2];
    let mut spokes = Vec::with_capacity(2);
    // A boundary edge has one triangle, which stands there twice.
    let sides = if old[0] == old[1] { 0..1 } else { 0..2 };
    for side in sides {
        let idx = old[side];
        // The triangle is (from, to, apex), whatever its first corner was.
        let t = model.triangles[idx as usize];
        let first = (0..3)
            .find(|&i| edge(t[i], t[(i + 1) % 3]) == e)
            .expect("the triangle has the edge");
        let [from, to, apex] = [0, 1, 2].map(|i| t[(first + i) % 3]);
        let new = model.triangles.len() as u32;
        model.triangles[idx as usize] = [from, middle, apex];
        model.triangles.push([middle, to, apex]);
        model.part_of.push(model.part_of[idx as usize]);
        let moved = triangles_at
            .get_mut(&edge(to, apex))
            .expect("it is an edge of the triangle");
        moved
            .iter_mut()
            .filter(|t| **t == idx)
            .for_each(|t| *t = new);
        let (of_from, of_to) = (usize::from(from == e[1]), usize::from(to == e[1]));
        halves[of_from][side..].fill(idx);
        halves[of_to][side..].fill(new);
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

/// Splits every triangle into four.
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
