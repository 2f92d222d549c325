//! The edges of a triangle mesh, with the triangles that meet at each.

use std::ops::Range;

use rayon::prelude::*;

/// A half-edge: a triangle at an edge, and its direction along the edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HalfEdge(u32);

/// The bit of [`HalfEdge`] that holds the direction. It leaves 31 bits for the triangle.
const REVERSED: u32 = 1 << 31;

impl HalfEdge {
    /// Returns the triangle's index.
    #[inline]
    pub fn triangle(self) -> usize {
        (self.0 & !REVERSED) as usize
    }

    /// Whether the triangle traverses the edge from its second vertex to its first.
    #[inline]
    pub fn is_reversed(self) -> bool {
        self.0 & REVERSED != 0
    }
}

/// An interior edge: two half-edges between the same two vertices. If more than two half-edges
/// meet, they form several edges, each of opposite half-edges as far as possible; sums over
/// half-edges do not depend on the pairing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Edge {
    /// The two vertices, the lower index first.
    pub vertices: [u32; 2],
    /// The two triangles at the edge. Their half-edges have the same direction if the mesh's
    /// winding is inconsistent there.
    pub sides: [HalfEdge; 2],
}

/// A boundary edge: a half-edge without an opposite one. It bounds a hole, or is the odd one where
/// an odd number of half-edges meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoundaryEdge {
    /// The two vertices, the lower index first.
    pub vertices: [u32; 2],
    /// The triangle at the edge.
    pub side: HalfEdge,
}

/// The edges of a mesh, ordered by their vertices.
#[derive(Clone, Debug, Default)]
pub(crate) struct Edges {
    /// Interior edges.
    pub pairs: Vec<Edge>,
    /// Boundary edges.
    pub lone: Vec<BoundaryEdge>,
    pub facts: EdgeFacts,
}

/// Statistics of all edges, which are cheap to collect while the edges are found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct EdgeFacts {
    /// Number of distinct vertex pairs, each counted once whatever the number of its half-edges.
    pub distinct: usize,
    /// Number of interior edges whose half-edges have the same direction.
    pub same_way: usize,
    /// A superset of the triangles that have the three corners of another triangle; may contain
    /// a triangle twice.
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
    /// Whether both triangles traverse the edge in the same direction, so that their windings are
    /// inconsistent.
    pub(crate) fn runs_one_way(&self) -> bool {
        self.sides[0].is_reversed() == self.sides[1].is_reversed()
    }
}

/// Maximum number of vertex ranges. Each range reads all triangles, which more ranges would do more
/// often than is saved.
const MAX_PARTS: usize = 8;

/// Finds the edges of triangles whose corners differ. Each thread takes a range of lower vertices,
/// and the ranges are joined in order, so that the result does not depend on the number of threads.
pub(crate) fn edges(triangles: &[[u32; 3]], n_vertices: usize) -> Edges {
    let n_parts = rayon::current_num_threads().clamp(1, MAX_PARTS);
    let bound = |part: usize| (n_vertices * part / n_parts) as u32;
    let parts: Vec<Edges> = (0..n_parts)
        .into_par_iter()
        .map(|part| edges_from(triangles, bound(part)..bound(part + 1)))
        .collect();
    let mut facts = EdgeFacts::default();
    parts.iter().for_each(|part| facts.add(&part.facts));
    Edges {
        pairs: concat(parts.iter().map(|part| &part.pairs[..]).collect()),
        lone: concat(parts.iter().map(|part| &part.lone[..]).collect()),
        facts,
    }
}

/// Concatenates slices, copied by all threads.
fn concat<T: Copy + Default + Send + Sync>(parts: Vec<&[T]>) -> Vec<T> {
    let mut all = vec![T::default(); parts.iter().map(|part| part.len()).sum()];
    let mut rest = &mut all[..];
    let mut copies = Vec::new();
    for part in parts {
        let (target, after) = rest.split_at_mut(part.len());
        copies.push((target, part));
        rest = after;
    }
    copies
        .into_par_iter()
        .for_each(|(target, part)| target.copy_from_slice(part));
    all
}

/// Finds the edges whose lower vertex is in `lower`: a counting sort of the half-edges into one
/// bucket per lower vertex, then a sort of each bucket.
fn edges_from(triangles: &[[u32; 3]], lower: Range<u32>) -> Edges {
    let n_buckets = lower.len();
    // Vertices below the range wrap around, so that one comparison excludes both sides.
    let bucket = |vertex: u32| (vertex.wrapping_sub(lower.start)) as usize;
    let mut ends = vec![0_u32; n_buckets + 1];
    for [a, b, c] in triangles {
        for vertex in [a.min(b), b.min(c), c.min(a)] {
            if let Some(n) = ends.get_mut(bucket(*vertex).saturating_add(1)) {
                *n += 1;
            }
        }
    }
    // Bucket b is counted in entry b + 1, so that the prefix sum makes entry b the start of bucket
    // b.
    for idx in 1..ends.len() {
        ends[idx] += ends[idx - 1];
    }
    let n_half_edges = ends[n_buckets] as usize;
    let mut half_edges = vec![0_u64; n_half_edges];
    // Insertion advances each bucket's start to its end.
    let mut starts = ends;
    for (triangle, &[a, b, c]) in (0_u32..).zip(triangles) {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let low = bucket(from.min(to));
            if low < n_buckets {
                let slot = &mut starts[low];
                half_edges[*slot as usize] = pack(from, to, triangle);
                *slot += 1;
            }
        }
    }
    // Within a bucket, half-edges with the same upper vertex belong to the same edge.
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

/// Whether two of `edges`, which have the same lower vertex, have the same two triangles.
/// `neighbors` receives the triangles of all edges.
///
/// Triangles with the same three corners share the two edges at their lowest corner. Other
/// triangles do not, unless more than two triangles meet at an edge.
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

/// Packs the upper vertex, then the half-edge, so that in a sorted bucket the half-edges of an edge
/// are adjacent, the reversed ones last.
fn pack(from: u32, to: u32, triangle: u32) -> u64 {
    let direction = if from > to { REVERSED } else { 0 };
    u64::from(from.max(to)) << 32 | u64::from(triangle | direction)
}

/// Pairs the half-edges of an edge from both ends of `same_end`, opposite directions first.
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
        edges.lone.push(BoundaryEdge { vertices, side });
    }
    edges.facts.distinct += 1;
    edges.facts.same_way += same_way;
    // At an edge of more than two triangles `share_two_edges` may miss repeated triangles.
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
    fn a_tetrahedron_has_six_edges_with_and_without_a_flipped_face() {
        for last in [[0, 3, 2], [0, 2, 3]] {
            let found = edges(&[[0, 2, 1], [0, 1, 3], [1, 2, 3], last], 4);
            assert_eq!((found.pairs.len(), found.lone.len()), (6, 0));
            let same_way = |e: &&Edge| e.sides[0].is_reversed() == e.sides[1].is_reversed();
            let expected = if last == [0, 3, 2] { 0 } else { 3 };
            assert_eq!(found.pairs.iter().filter(same_way).count(), expected);
        }
    }

    #[test]
    fn non_manifold_edges_pair_opposite_directions_first() {
        // Three half-edges from 0 to 1, two back.
        let fan = [[0, 1, 2], [1, 0, 3], [0, 1, 4], [0, 1, 5], [1, 0, 6]];
        let found = edges(&fan, 7);
        let paired: Vec<_> = found
            .pairs
            .iter()
            .filter(|e| e.vertices == [0, 1])
            .collect();
        assert_eq!(paired.len(), 2);
        for edge in paired {
            let [one, other] = edge.sides;
            assert_ne!(one.is_reversed(), other.is_reversed());
        }
        let unpaired = found.lone.iter().filter(|e| e.vertices == [0, 1]).count();
        assert_eq!(unpaired, 1);
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
