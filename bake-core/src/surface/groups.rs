//! Vertices that share their values.

use crate::TriangleMesh;
use crate::mesh::first_duplicate;

/// Vertices of one position and one normal share their values, so that seams of texture coordinates do
/// not show, and hard edges do.
#[derive(Clone, Debug)]
pub struct VertexGroups {
    /// The first vertex of each vertex's group.
    first: Vec<u32>,
    /// The normal of each vertex, of length 1, if the file has any; zero for vertices without.
    normals: Option<Vec<[f32; 3]>>,
}

/// Returns the bits of a vector as a key. Adding zero makes −0 and +0 equal.
fn bits(v: [f32; 3]) -> [u32; 3] {
    v.map(|x| (x + 0.0).to_bits())
}

impl VertexGroups {
    /// Groups the vertices of a mesh, by position alone if there are no normals.
    ///
    /// # Panics
    ///
    /// If there are normals, but not as many as vertices.
    pub fn new(mesh: &TriangleMesh, normals: Option<Vec<[f32; 3]>>) -> Self {
        let keys: Vec<_> = mesh.positions().iter().map(|p| bits(*p)).collect();
        let mut first = first_duplicate(&keys);
        if let Some(normals) = &normals {
            assert_eq!(normals.len(), keys.len(), "a normal for each vertex");
            let keys: Vec<_> = normals.iter().map(|n| bits(*n)).collect();
            let of_normals = first_duplicate(&keys);
            let pairs = first.iter().zip(&of_normals);
            first = first_duplicate(&pairs.map(|(p, n)| [*p, *n, 0]).collect::<Vec<_>>());
        }
        Self { first, normals }
    }

    /// Returns the number of vertices.
    pub fn len(&self) -> usize {
        self.first.len()
    }

    /// Whether there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// Returns the first vertex of a vertex's group.
    pub fn first(&self, vertex: u32) -> usize {
        self.first[vertex as usize] as usize
    }

    /// Returns the first vertices of the groups of a triangle's corners.
    pub fn corners(&self, triangle: [u32; 3]) -> [usize; 3] {
        triangle.map(|vertex| self.first(vertex))
    }

    /// Returns the normal that the file gives a vertex, if it gives one.
    pub fn normal(&self, vertex: usize) -> Option<[f64; 3]> {
        let normal = self.normals.as_ref()?[vertex].map(f64::from);
        super::normalized(normal)
    }
}
