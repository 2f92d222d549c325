//! Vertices at the same place are one vertex, whatever the file says.

use std::collections::HashMap;

use super::TriangleMesh;

/// Triangles over welded vertices: corners at exactly the same position have the same index.
/// The numbers are those of the first vertex at the place, so they do not depend on hashing.
pub(super) fn weld(mesh: &TriangleMesh) -> Vec<[u32; 3]> {
    let mut first_at: HashMap<[u32; 3], u32> = HashMap::with_capacity(mesh.positions().len());
    let welded: Vec<u32> = (0..)
        .zip(mesh.positions())
        // Adding zero turns −0 into +0, which are the same place.
        .map(|(vertex, p)| {
            *first_at
                .entry(p.map(|v| (v + 0.0).to_bits()))
                .or_insert(vertex)
        })
        .collect();
    let renumber = |vertex: u32| welded[vertex as usize];
    mesh.triangles().iter().map(|t| t.map(renumber)).collect()
}
