//! Mesh statistics that help to explain an unexpected bake.

use super::area::has_area;
use super::weld::weld;
use super::{Bounds, TriangleMesh};

/// Statistics of a mesh whose vertices are welded by exact position.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshReport {
    /// Triangles in total, with those that were left out.
    pub triangles: usize,
    /// Objects or groups.
    pub parts: usize,
    /// The bounding box of all triangles.
    pub bounds: Bounds,
    /// Triangles without area: two corners coincide, or all three are collinear.
    pub degenerate: usize,
    /// Triangles with the same three corners as an earlier triangle, in any order.
    pub duplicate: usize,
    /// Edges of exactly one triangle.
    pub boundary_edges: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
}

impl MeshReport {
    /// Measures `mesh`.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let triangles = weld(mesh);
        let is_degenerate = |(t, corners): (&[u32; 3], _)| {
            t[0] == t[1] || t[1] == t[2] || t[2] == t[0] || !has_area(corners)
        };
        let (boundary_edges, non_manifold_edges) = irregular_edges(&triangles);
        Self {
            triangles: triangles.len() + mesh.left_out(),
            parts: mesh.parts().len(),
            bounds: mesh.bounds(),
            degenerate: triangles
                .iter()
                .zip(mesh.corners())
                .filter(|&pair| is_degenerate(pair))
                .count()
                + mesh.left_out(),
            duplicate: duplicates(&triangles),
            boundary_edges,
            non_manifold_edges,
        }
    }

    /// Whether every edge has exactly two triangles, so that the mesh encloses a volume.
    pub fn is_closed(&self) -> bool {
        self.boundary_edges == 0 && self.non_manifold_edges == 0
    }
}

fn duplicates(triangles: &[[u32; 3]]) -> usize {
    let mut sorted = triangles.to_vec();
    for t in &mut sorted {
        t.sort_unstable();
    }
    sorted.sort_unstable();
    sorted.windows(2).filter(|pair| pair[0] == pair[1]).count()
}

/// Returns the number of boundary edges (of one triangle) and of non-manifold edges (of more than
/// two).
fn irregular_edges(triangles: &[[u32; 3]]) -> (usize, usize) {
    let mut edges: Vec<[u32; 2]> = triangles
        .iter()
        // A triangle with two coincident corners is a line, which bounds nothing.
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    let uses = edges.chunk_by(|a, b| a == b).map(<[_]>::len);
    uses.fold((0, 0), |(boundary, non_manifold), n| match n {
        1 => (boundary + 1, non_manifold),
        2 => (boundary, non_manifold),
        _ => (boundary, non_manifold + 1),
    })
}

#[cfg(test)]
mod tests {
    use super::super::Part;
    use super::*;

    fn report(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> MeshReport {
        let whole = Part {
            name: String::new(),
            triangles: 0..triangles.len(),
        };
        let mesh = TriangleMesh::new(positions.to_vec(), triangles.to_vec(), vec![whole]);
        MeshReport::new(&mesh.unwrap())
    }

    const TETRAHEDRON: [[f32; 3]; 4] =
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    #[test]
    fn a_tetrahedron_is_closed_with_and_without_shared_vertices() {
        assert!(report(&TETRAHEDRON, &FACES).is_closed());
        // The same with a vertex for each corner, one of them with negative zeros.
        let mut split: Vec<_> = FACES
            .iter()
            .flatten()
            .map(|&v| TETRAHEDRON[v as usize])
            .collect();
        split[0] = [-0.0; 3];
        let unshared = [[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]];
        assert!(report(&split, &unshared).is_closed());
    }

    #[test]
    fn holes_and_fins_are_counted() {
        let open = report(&TETRAHEDRON, &FACES[..3]);
        assert_eq!((open.boundary_edges, open.non_manifold_edges), (3, 0));
        assert!(!open.is_closed());
        let mut with_fin = TETRAHEDRON.to_vec();
        with_fin.push([-1.0, -1.0, 0.0]);
        let fin = report(&with_fin, &[&FACES[..], &[[0, 1, 4]]].concat());
        assert_eq!((fin.boundary_edges, fin.non_manifold_edges), (2, 1));
    }

    #[test]
    fn degenerate_and_duplicate_triangles_are_counted() {
        let points = [[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0], [0.0, 1.0, 0.0]];
        let mesh = report(&points, &[[0, 1, 2], [0, 1, 1], [0, 1, 3], [3, 0, 1]]);
        assert_eq!((mesh.degenerate, mesh.duplicate), (2, 1));
    }
}
