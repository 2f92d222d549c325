//! Lists and buffers of silhouette edges.

use aogrid_bake_core::prepared::{Edge, HalfEdge};
use aogrid_bake_core::sweep::LANES;

use super::facing::{EdgeFacing, TriangleFacing};

/// The edges that are silhouettes for some texel of a texel row.
#[derive(Debug, Default, PartialEq, Eq)]
pub(in crate::sweep) struct SilhouetteList {
    /// Their vertices, copied here because a look-up among all edges would miss the cache.
    pub vertices: Vec<[u32; 2]>,
    /// The oriented facings of each edge's triangles.
    pub facings: Vec<EdgeFacing>,
}

impl SilhouetteList {
    pub(in crate::sweep) fn clear(&mut self) {
        self.vertices.clear();
        self.facings.clear();
    }
}

/// The silhouettes of each texel row of a pass.
pub(in crate::sweep) type RowSilhouettes = [SilhouetteList; LANES];

/// The search for silhouettes among some edges.
pub(in crate::sweep) struct SilhouetteSearch<'a> {
    pub edges: &'a [Edge],
    pub facings: &'a [TriangleFacing],
    pub n_rows: usize,
    pub lists: &'a mut RowSilhouettes,
}

impl<'a> SilhouetteSearch<'a> {
    /// Returns the facings of an edge's triangles, and whether each triangle runs along the edge
    /// backwards.
    #[inline(always)]
    pub(in crate::sweep) fn facings_of(&self, edge: &Edge) -> [(&'a TriangleFacing, bool); 2] {
        let [one, other] = edge.sides;
        let facings = self.facings;
        let facing = |side: HalfEdge| (&facings[side.triangle()], side.is_reversed());
        [facing(one), facing(other)]
    }
}

/// The number of edges that a thread collects before it counts them.
const EDGE_CAPACITY: usize = 256;

/// Edges that cross levels, as a structure of arrays.
#[repr(C, align(64))]
pub(in crate::sweep) struct EdgeBuffer {
    /// The lower vertices, and the higher ones.
    pub vertices: [[u32; EDGE_CAPACITY]; 2],
    /// The ranks of the vertices.
    pub ranks: [[i32; EDGE_CAPACITY]; 2],
    pub facings: [EdgeFacing; EDGE_CAPACITY],
    pub n: usize,
}

impl Default for EdgeBuffer {
    fn default() -> Self {
        Self {
            vertices: [[0; EDGE_CAPACITY]; 2],
            ranks: [[0; EDGE_CAPACITY]; 2],
            facings: [EdgeFacing::default(); EDGE_CAPACITY],
            n: 0,
        }
    }
}

impl EdgeBuffer {
    #[inline(always)]
    pub(in crate::sweep) fn has_capacity(&self, n: usize) -> bool {
        self.n + n <= EDGE_CAPACITY
    }

    /// Appends the edge if it crosses a level. The caller has reserved space. Branchless: the test
    /// is unpredictable.
    #[inline(always)]
    pub(in crate::sweep) fn push(&mut self, vertices: [u32; 2], ranks: &[i32], facing: EdgeFacing) {
        let n = self.n & (EDGE_CAPACITY - 1);
        let [a, b] = vertices;
        let [from, to] = [ranks[a as usize], ranks[b as usize]];
        self.vertices[0][n] = a;
        self.vertices[1][n] = b;
        self.ranks[0][n] = from;
        self.ranks[1][n] = to;
        self.facings[n] = facing;
        self.n += usize::from(from != to);
    }
}

/// A chunk of at most [`EDGE_CHUNK`] silhouettes of one texel row.
pub(in crate::sweep) struct SilhouetteChunk<'a> {
    pub vertices: &'a [[u32; 2]],
    pub facings: &'a [EdgeFacing],
    /// The ranks of all vertices.
    pub ranks: &'a [i32],
}

impl<'a> SilhouetteChunk<'a> {
    /// Returns the chunk that starts at index `first` of a list, and the index of the next chunk.
    pub(in crate::sweep) fn new(
        list: &'a SilhouetteList,
        first: usize,
        ranks: &'a [i32],
    ) -> (Self, usize) {
        let next = (first + EDGE_CHUNK).min(list.facings.len());
        let chunk = Self {
            vertices: &list.vertices[first..next],
            facings: &list.facings[first..next],
            ranks,
        };
        (chunk, next)
    }

    /// Returns the chunk without its first `n` silhouettes.
    #[cfg(target_arch = "x86_64")]
    pub(in crate::sweep) fn after(&self, n: usize) -> Self {
        Self {
            vertices: &self.vertices[n..],
            facings: &self.facings[n..],
            ranks: self.ranks,
        }
    }
}

/// The number of edges that are collected at a time.
pub(in crate::sweep) const EDGE_CHUNK: usize = 64;
