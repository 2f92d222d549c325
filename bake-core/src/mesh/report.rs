//! Mesh statistics that help to explain an unexpected bake.

use std::f64::consts::PI;

use super::area::{cross, has_area};
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
    /// The length of the edges that are a silhouette for some of sixteen directions in a plane, which the
    /// direction sweep handles together; about the mean over all planes, in object units. The time of
    /// the sweep depends on it.
    pub silhouette_length: f64,
}

impl MeshReport {
    /// Measures `mesh`.
    pub fn new(mesh: &TriangleMesh) -> Self {
        let triangles = weld(mesh);
        let is_degenerate = |(t, corners): (&[u32; 3], _)| {
            t[0] == t[1] || t[1] == t[2] || t[2] == t[0] || !has_area(corners)
        };
        let edges = EdgeStatistics::new(mesh, &triangles);
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
            boundary_edges: edges.boundary,
            non_manifold_edges: edges.non_manifold,
            silhouette_length: edges.silhouette_length,
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

#[derive(Default)]
struct EdgeStatistics {
    boundary: usize,
    non_manifold: usize,
    silhouette_length: f64,
}

impl EdgeStatistics {
    /// Measures the edges of welded triangles.
    fn new(mesh: &TriangleMesh, triangles: &[[u32; 3]]) -> Self {
        let mut half_edges: Vec<_> = (0_u32..)
            .zip(triangles)
            // A triangle with two coincident corners is a line, which bounds nothing.
            .filter(|(_, [a, b, c])| a != b && b != c && c != a)
            .flat_map(|(idx, &[a, b, c])| [(a, b, c), (b, c, a), (c, a, b)].map(|e| (e, idx)))
            .map(|((a, b, opposite), idx)| ([a.min(b), a.max(b)], opposite, idx, a > b))
            .collect();
        half_edges.sort_unstable();
        let position = |vertex: u32| mesh.positions()[vertex as usize].map(f64::from);
        let normal = |idx: u32| {
            let [a, b, c] = triangles[idx as usize].map(position);
            cross(a, b, c)
        };
        let mut statistics = Self::default();
        for same in half_edges.chunk_by(|a, b| a.0 == b.0) {
            statistics.boundary += usize::from(same.len() == 1);
            statistics.non_manifold += usize::from(same.len() > 2);
            // Triangles that are repeated are swept once.
            let mut different = same.chunk_by(|a, b| a.1 == b.1).map(|equal| equal[0]);
            let share = match (different.next(), different.next(), different.next()) {
                (Some((_, _, one, one_way)), Some((_, _, other, other_way)), None) => {
                    let angle = angle(normal(one), normal(other));
                    let is_consistent = one_way != other_way;
                    silhouette_share((if is_consistent { angle } else { PI - angle }) / PI)
                }
                // An edge of one triangle is always a silhouette, one of several nearly always.
                _ => 1.0,
            };
            let [a, b] = same[0].0.map(position);
            let squares: f64 = (0..3).map(|x| (b[x] - a[x]).powi(2)).sum();
            statistics.silhouette_length += share * squares.sqrt();
        }
        statistics
    }
}

/// Returns the share of planes in which an edge is a silhouette for some of sixteen directions, from
/// the share of all directions for which it is one: sixteen times as many if those hardly ever fall on
/// two neighboring directions, and, as the sixteen cover a quarter turn, some three tenths of smooth
/// surfaces' edges. (Measured: 23 to 34 % of scanned meshes' edges.)
fn silhouette_share(of_directions: f64) -> f64 {
    (16.0 * of_directions).min(0.3 + 0.7 * of_directions)
}

/// Returns the angle between two vectors; 0 if one is zero.
fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let across = cross([0.0; 3], a, b);
    dot(across, across).sqrt().atan2(dot(a, b))
}

#[cfg(test)]
mod tests {
    use super::super::Part;
    use super::*;
    use crate::models::Model;

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

    /// Two triangles in a plane have their outline, whichever way they wind. A box has its edges, four of
    /// each length, each for half of all directions, but not its diagonals.
    #[test]
    fn silhouettes_have_the_length_of_sharp_edges() {
        let points = [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, -4.0, 0.0]];
        // Two sides of length 4 and two of length 5.
        let boundary = 18.0;
        for second in [[1, 0, 3], [0, 1, 3]] {
            let found = report(&points, &[[0, 1, 2], second]).silhouette_length;
            assert!((found - boundary).abs() < 1e-12, "{found}");
        }
        let mesh = Model::Box.mesh(None).unwrap();
        let bounds = mesh.bounds();
        let sides: f64 = (0..3)
            .map(|x| f64::from(bounds.max[x] - bounds.min[x]))
            .sum();
        let found = MeshReport::new(&mesh).silhouette_length;
        assert!(
            (found - 0.65 * 4.0 * sides).abs() < 1e-5 * sides,
            "{found} {sides}"
        );
    }

    #[test]
    fn degenerate_and_duplicate_triangles_are_counted() {
        let points = [[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0], [0.0, 1.0, 0.0]];
        let mesh = report(&points, &[[0, 1, 2], [0, 1, 1], [0, 1, 3], [3, 0, 1]]);
        assert_eq!((mesh.degenerate, mesh.duplicate), (2, 1));
        let once = report(&points, &[[0, 1, 2], [0, 1, 1], [0, 1, 3]]);
        assert_eq!(mesh.silhouette_length, once.silhouette_length);
    }
}
