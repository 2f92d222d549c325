//! The edges at which signed layers change.

use crate::PreparedMesh;
use crate::prepared::{Edges, HalfEdge};

/// Inconsistent edges per edge, above which windings say nothing: a soup with every fifth triangle
/// turned over has a third, real meshes with a few flipped faces less than 1 %.
const MAX_INCONSISTENT: f64 = 0.02;

/// The reliability of the windings of a mesh's triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Winding {
    /// Neighbors agree.
    Consistent,
    /// Neighbors contradict each other: only the parity of layers means anything.
    Contradictory,
}

/// An edge whose half-edges do not cancel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct UnbalancedEdge {
    /// Indices into [`PreparedMesh::vertices`], the lower first.
    pub vertices: [u32; 2],
    /// Half-edges from the first vertex to the second, less those the other way.
    pub net: i32,
}

/// The parts of a mesh on which its signed layers depend.
pub(super) struct Surface {
    pub edges: Vec<UnbalancedEdge>,
    pub winding: Winding,
}

impl Surface {
    /// Returns none if all edges are balanced.
    pub(super) fn of(mesh: &PreparedMesh) -> Option<Self> {
        let mut edges = unbalanced(mesh);
        if edges.is_empty() {
            return None;
        }
        let is_inconsistent = |edge: &&UnbalancedEdge| edge.net % 2 == 0;
        let inconsistent = edges.iter().filter(is_inconsistent).count();
        let max = MAX_INCONSISTENT * mesh.all_edges().facts.distinct as f64;
        let winding = match inconsistent as f64 <= max {
            true => Winding::Consistent,
            false => Winding::Contradictory,
        };
        if winding == Winding::Contradictory {
            // Two half-edges change no parity.
            edges.retain(|edge| edge.net % 2 != 0);
        }
        Some(Self { edges, winding })
    }
}

/// Returns the edges whose half-edges do not cancel.
fn unbalanced(mesh: &PreparedMesh) -> Vec<UnbalancedEdge> {
    let Edges { pairs, lone, facts } = mesh.all_edges();
    let direction = |side: HalfEdge| if side.is_reversed() { -1 } else { 1 };
    let mut edges: Vec<_> = lone
        .iter()
        .map(|edge| UnbalancedEdge {
            vertices: edge.vertices,
            net: direction(edge.side),
        })
        .collect();
    if facts.same_way > 0 {
        let one_way = pairs.iter().filter(|pair| pair.runs_one_way());
        edges.extend(one_way.map(|pair| UnbalancedEdge {
            vertices: pair.vertices,
            net: 2 * direction(pair.sides[0]),
        }));
    }
    edges.sort_unstable_by_key(|edge| edge.vertices);
    let same = |a: &UnbalancedEdge, b: &UnbalancedEdge| a.vertices == b.vertices;
    let sums = edges.chunk_by(same).map(|edges| UnbalancedEdge {
        vertices: edges[0].vertices,
        net: edges.iter().map(|edge| edge.net).sum(),
    });
    sums.filter(|edge| edge.net != 0).collect()
}
