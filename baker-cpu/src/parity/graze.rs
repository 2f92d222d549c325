//! The distance between a texel's ray and the mesh's edges.

use aogrid_bake_core::PreparedMesh;
use aogrid_bake_core::cube_face;

/// Returns the smallest distance, in cells, between the ray of `texel` from `cell` and any edge of
/// the mesh; infinite if the mesh has no edges.
pub fn graze(mesh: &PreparedMesh, size: u32, (cell, texel): (usize, usize)) -> f64 {
    let spec = mesh.spec();
    let from = spec.cell_at(cell).map(f64::from);
    let direction = cube_face::texels(size)[texel].direction;
    let along: [f64; 3] = std::array::from_fn(|x| direction[x] / spec.cell_size()[x]);
    let along = along.map(|v| v / dot(along, along).sqrt());
    let scale = f64::from(1_u32 << mesh.lattice().bits());
    let vertex = |v: u32| mesh.vertices()[v as usize].map(|c| f64::from(c) / scale);
    let interior_edges = mesh.edges().iter().map(|edge| edge.vertices);
    let boundary_edges = mesh.boundary_edges().iter().map(|edge| edge.vertices);
    interior_edges
        .chain(boundary_edges)
        .map(|ends| distance(from, along, ends.map(vertex)))
        .fold(f64::INFINITY, f64::min)
}

/// Returns the distance between a ray along the unit vector `along` and the segment from p to q.
fn distance(from: [f64; 3], along: [f64; 3], [p, q]: [[f64; 3]; 2]) -> f64 {
    let edge = minus(q, p);
    let to_p = minus(p, from);
    let [edge_edge, edge_along] = [dot(edge, edge), dot(edge, along)];
    // Closest points of the two lines: minimize |to_p + s·edge − t·along| over s and t.
    let denominator = edge_edge - edge_along * edge_along;
    let s = if denominator > 0.0 {
        (edge_along * dot(to_p, along) - dot(edge, to_p)) / denominator
    } else {
        0.0
    };
    let distance_at = |s: f64| {
        let point = plus(to_p, edge, s);
        let t = dot(point, along).max(0.0);
        let off = plus(point, along, -t);
        dot(off, off).sqrt()
    };
    // If the closest point lies behind the ray's start, the minimum may be elsewhere on the
    // segment; rays here never come near that case.
    distance_at(s.clamp(0.0, 1.0))
        .min(distance_at(0.0))
        .min(distance_at(1.0))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    plus(a, b, -1.0)
}

fn plus(a: [f64; 3], b: [f64; 3], s: f64) -> [f64; 3] {
    std::array::from_fn(|x| a[x] + s * b[x])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_match_hand_computed_ones() {
        let x = [1.0, 0.0, 0.0];
        let at = |ends| distance([0.0; 3], x, ends);
        // Crossing above, beside an end, behind, and parallel.
        assert_eq!(at([[5.0, -1.0, 0.25], [5.0, 3.0, 0.25]]), 0.25);
        assert_eq!(at([[5.0, 0.5, 0.0], [7.0, 3.0, 0.0]]), 0.5);
        assert_eq!(at([[-2.0, 0.0, 0.0], [-3.0, 0.0, 0.0]]), 2.0);
        assert_eq!(at([[2.0, 0.0, 3.0], [9.0, 0.0, 3.0]]), 3.0);
    }
}
