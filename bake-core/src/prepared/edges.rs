//! Which triangles meet at an edge.

use std::ops::Range;

use rayon::prelude::*;

/// A triangle's side, as seen from the edge it lies on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HalfEdge(u32);

/// Where [`HalfEdge`] keeps the direction. It leaves 31 bits for the triangle.
const REVERSED: u32 = 1 << 31;

impl HalfEdge {
    /// The triangle's index.
    pub fn triangle(self) -> usize {
        (self.0 & !REVERSED) as usize
    }

    /// Whether the triangle runs along the edge from its second vertex to its first.
    pub fn is_reversed(self) -> bool {
        self.0 & REVERSED != 0
    }
}

/// Two half-edges between the same two vertices. Where more than two meet they are paired, in
/// opposite directions as far as possible: whoever sums over half-edges does not care.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Edge {
    /// The lower index first.
    pub vertices: [u32; 2],
    /// The two triangles at the edge, in no particular direction: also where the winding of a
    /// mesh is inconsistent the two are one edge.
    pub sides: [HalfEdge; 2],
}

/// A half-edge without a partner: of a boundary, or the odd one where an odd number meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoneEdge {
    /// The lower index first.
    pub vertices: [u32; 2],
    /// The triangle at the edge.
    pub side: HalfEdge,
}

/// All edges, ordered by their vertices.
#[derive(Clone, Debug, Default)]
pub(crate) struct Edges {
    pub pairs: Vec<Edge>,
    pub lone: Vec<LoneEdge>,
    pub facts: EdgeFacts,
}

/// Facts about all edges that are cheap to collect while they are found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct EdgeFacts {
    /// Edges, each counted once whatever the number of its half-edges.
    pub distinct: usize,
    /// Pairs whose half-edges run the same way.
    pub same_way: usize,
    /// Triangles among which are all that have the three corners of another; some come twice.
    pub may_repeat: Vec<u32>,
}

impl EdgeFacts {
    fn add(&mut self, other: &Self) {
        self.distinct += other.distinct;
        self.same_way += other.same_way;
        self.may_repeat.extend(&other.may_repeat);
    }
}

impl Edge {
    /// Whether both triangles run along the edge in the same direction: their windings contradict
    /// each other.
    pub(crate) fn runs_one_way(&self) -> bool {
        self.sides[0].is_reversed() == self.sides[1].is_reversed()
    }
}

/// More parts than this would read the triangles more often than it saves.
const MOST_PARTS: usize = 8;

/// Finds the edges of triangles whose corners differ. The result does not depend on the number
/// of threads: each takes a range of lower vertices, and the ranges follow each other.
pub(crate) fn edges(triangles: &[[u32; 3]], n_vertices: usize) -> Edges {
    let n_parts = rayon::current_num_threads().clamp(1, MOST_PARTS);
    let bound = |part: usize| (n_vertices * part / n_parts) as u32;
    let parts: Vec<Edges> = (0..n_parts)
        .into_par_iter()
        .map(|part| edges_from(triangles, bound(part)..bound(part + 1)))
        .collect();
    let mut facts = EdgeFacts::default();
    parts.iter().for_each(|part| facts.add(&part.facts));
    Edges {
        pairs: joined(parts.iter().map(|part| &part.pairs[..]).collect()),
        lone: joined(parts.iter().map(|part| &part.lone[..]).collect()),
        facts,
    }
}

/// One after the other, copied by all threads.
fn joined<T: Copy + Default + Send + Sync>(parts: Vec<&[T]>) -> Vec<T> {
    let mut all = vec![T::default(); parts.iter().map(|part| part.len()).sum()];
    let mut rest = &mut all[..];
    let mut places = Vec::new();
    for part in parts {
        let (place, after) = rest.split_at_mut(part.len());
        places.push((place, part));
        rest = after;
    }
    places
        .into_par_iter()
        .for_each(|(place, part)| place.copy_from_slice(part));
    all
}

/// The edges whose lower vertex is in `lower`: half-edges sorted into one bucket a vertex
/// (counting, then placing), then each bucket by itself.
fn edges_from(triangles: &[[u32; 3]], lower: Range<u32>) -> Edges {
    let n_buckets = lower.len();
    let bucket = |vertex: u32| (vertex.wrapping_sub(lower.start)) as usize;
    let mut ends = vec![0_u32; n_buckets + 1];
    for [a, b, c] in triangles {
        for vertex in [a.min(b), b.min(c), c.min(a)] {
            if let Some(n) = ends.get_mut(bucket(*vertex).saturating_add(1)) {
                *n += 1;
            }
        }
    }
    // Vertex `lower.end − 1` counts into the last entry, and none into the first.
    for idx in 1..ends.len() {
        ends[idx] += ends[idx - 1];
    }
    let n_half_edges = ends[n_buckets] as usize;
    let mut half_edges = vec![0_u64; n_half_edges];
    // Placing moves each bucket's start to its end, which is the next one's start.
    let mut starts = ends;
    for (triangle, &[a, b, c]) in (0_u32..).zip(triangles) {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let low = bucket(from.min(to));
            if low < n_buckets {
                let place = &mut starts[low];
                half_edges[*place as usize] = packed(from, to, triangle);
                *place += 1;
            }
        }
    }
    let mut edges = Edges::default();
    edges.pairs.reserve(n_half_edges / 2);
    let mut start = 0;
    let mut neighbors = Vec::new();
    for (vertex, &end) in lower.clone().zip(&starts) {
        let bucket = &mut half_edges[start..end as usize];
        start = end as usize;
        bucket.sort_unstable();
        let before = edges.pairs.len();
        for same_end in bucket.chunk_by(|a, b| a >> 32 == b >> 32) {
            pair_up(vertex, same_end, &mut edges);
        }
        let Edges { pairs, facts, .. } = &mut edges;
        if share_two_edges(&pairs[before..], &mut neighbors) {
            facts.may_repeat.extend(neighbors.as_flattened());
        }
    }
    edges
}

/// Whether the same two triangles, given in `neighbors`, meet at two of `edges`, which have one lower vertex: triangles
/// with the same three corners do, at the two edges of their lowest corner, and others do not
/// unless more than two triangles meet at an edge.
fn share_two_edges(edges: &[Edge], neighbors: &mut Vec<[u32; 2]>) -> bool {
    if edges.len() < 2 {
        return false;
    }
    neighbors.clear();
    neighbors.extend(edges.iter().map(|edge| {
        let [one, other] = edge.sides.map(|side| side.0 & !REVERSED);
        [one.min(other), one.max(other)]
    }));
    neighbors.sort_unstable();
    neighbors.windows(2).any(|pair| pair[0] == pair[1])
}

/// The upper vertex, then the half-edge, so that a sorted bucket has edges together and in them
/// the reversed half-edges last.
fn packed(from: u32, to: u32, triangle: u32) -> u64 {
    let direction = if from > to { REVERSED } else { 0 };
    u64::from(from.max(to)) << 32 | u64::from(triangle | direction)
}

/// Takes the half-edges from both ends, which pairs opposite directions first.
fn pair_up(lower: u32, same_end: &[u64], edges: &mut Edges) {
    let vertices = [lower, (same_end[0] >> 32) as u32];
    let side = |packed: &u64| HalfEdge(*packed as u32);
    let mut rest = same_end;
    let mut same_way = 0;
    while let [first, middle @ .., last] = rest {
        let edge = Edge {
            vertices,
            sides: [side(first), side(last)],
        };
        same_way += usize::from(edge.runs_one_way());
        edges.pairs.push(edge);
        rest = middle;
    }
    if let [odd] = rest {
        let side = side(odd);
        edges.lone.push(LoneEdge { vertices, side });
    }
    edges.facts.distinct += 1;
    edges.facts.same_way += same_way;
    if same_end.len() > 2 {
        let triangles = same_end
            .iter()
            .map(|half_edge| side(half_edge).0 & !REVERSED);
        edges.facts.may_repeat.extend(triangles);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_threads(n: usize, triangles: &[[u32; 3]], n_vertices: usize) -> Edges {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
        pool.unwrap().install(|| edges(triangles, n_vertices))
    }

    #[test]
    fn a_tetrahedron_has_six_edges_also_with_a_face_turned_over() {
        for last in [[0, 3, 2], [0, 2, 3]] {
            let found = edges(&[[0, 2, 1], [0, 1, 3], [1, 2, 3], last], 4);
            assert_eq!((found.pairs.len(), found.lone.len()), (6, 0));
            let odd = |e: &&Edge| e.sides[0].is_reversed() == e.sides[1].is_reversed();
            let expected = if last == [0, 3, 2] { 0 } else { 3 };
            assert_eq!(found.pairs.iter().filter(odd).count(), expected);
        }
    }

    #[test]
    fn crowded_edges_pair_opposite_directions_first() {
        // Three along 0 → 1, two back.
        let fan = [[0, 1, 2], [1, 0, 3], [0, 1, 4], [0, 1, 5], [1, 0, 6]];
        let found = edges(&fan, 7);
        let at: Vec<_> = found
            .pairs
            .iter()
            .filter(|e| e.vertices == [0, 1])
            .collect();
        assert_eq!(at.len(), 2);
        for edge in at {
            let [one, other] = edge.sides;
            assert_ne!(one.is_reversed(), other.is_reversed());
        }
        let odd = found.lone.iter().filter(|e| e.vertices == [0, 1]).count();
        assert_eq!(odd, 1);
    }

    #[test]
    fn every_half_edge_is_found_once_for_any_number_of_threads() {
        let n = 50;
        let corner = |i: u32, k: u32| (i * k + i / 7) % n;
        let triangles: Vec<[u32; 3]> = (0..400)
            .map(|i| [corner(i, 3), corner(i, 5), corner(i, 11)])
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect();
        let one = with_threads(1, &triangles, n as usize);
        let mut sides: Vec<(usize, [u32; 2])> = Vec::new();
        for edge in &one.pairs {
            sides.extend(edge.sides.map(|s| (s.triangle(), edge.vertices)));
        }
        sides.extend(one.lone.iter().map(|e| (e.side.triangle(), e.vertices)));
        sides.sort_unstable();
        let mut expected: Vec<_> = (0..)
            .zip(&triangles)
            .flat_map(|(t, &[a, b, c])| [(t, [a, b]), (t, [b, c]), (t, [c, a])])
            .map(|(t, [a, b])| (t, [a.min(b), a.max(b)]))
            .collect();
        expected.sort_unstable();
        assert_eq!(sides, expected);
        for threads in [2, 3, 8] {
            let many = with_threads(threads, &triangles, n as usize);
            assert_eq!((&many.pairs, &many.lone), (&one.pairs, &one.lone));
        }
    }
}
