//! The outline of a mesh in a slice.

use std::collections::HashMap;

use aogrid_bake_core::TriangleMesh;

/// A line between two points, in the coordinates of the two axes after the one across the slice.
pub(crate) type Segment = [[f64; 2]; 2];

/// Returns the outline of a mesh in the slice of this thickness across `axis` at the coordinate `at`:
/// the cut through its triangles, and the border of what lies flat in the slice. A sheet along the
/// slice is cut nowhere, and would be missing otherwise.
pub(crate) fn outline(mesh: &TriangleMesh, axis: usize, at: f64, thickness: f64) -> Vec<Segment> {
    let turned = |corner: [f32; 3]| [1, 2, 3].map(|i| f64::from(corner[(axis + i) % 3]));
    let mut segments = Vec::new();
    let mut flat = Vec::new();
    for triangle in mesh.corners().map(|t| t.map(turned)) {
        match cut_triangle(triangle, at) {
            Some(segment) => segments.push(segment),
            None if lies_in(triangle, at, thickness) => flat.push(triangle),
            None => (),
        }
    }
    segments.extend(border(&flat));
    segments
}

/// The cosine of the angle between slice and triangle above which it counts as flat. Steeper ones
/// belong to surfaces that the slice cuts beside them.
const MIN_FLAT_COS: f64 = 0.9;

/// Whether a triangle lies flat within half the thickness of the slice's middle.
fn lies_in(t: [[f64; 3]; 3], at: f64, thickness: f64) -> bool {
    let [u, v] = [1, 2].map(|i| [0, 1, 2].map(|x| t[i][x] - t[0][x]));
    let normal = [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ];
    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    let is_near = |corner: &[f64; 3]| (corner[2] - at).abs() <= 0.5 * thickness;
    t.iter().all(is_near) && normal[2].abs() >= MIN_FLAT_COS * length && length > 0.0
}

/// Returns the edges that an odd number of the triangles has, seen along the axis.
fn border(triangles: &[[[f64; 3]; 3]]) -> Vec<Segment> {
    let mut counts: HashMap<[[u64; 3]; 2], (usize, Segment)> = HashMap::new();
    let edges = triangles
        .iter()
        .flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
    for (idx, edge) in edges.enumerate() {
        let mut key = edge.map(|corner| corner.map(f64::to_bits));
        key.sort_unstable();
        let segment = edge.map(|[u, v, _]| [u, v]);
        match counts.remove(&key) {
            Some(_) => (),
            None => _ = counts.insert(key, (idx, segment)),
        }
    }
    let mut odd: Vec<_> = counts.into_values().collect();
    // The order of a hash map differs from run to run.
    odd.sort_unstable_by_key(|(idx, _)| *idx);
    odd.into_iter().map(|(_, segment)| segment).collect()
}

/// Returns the segment in which the plane cuts a triangle, if it does.
fn cut_triangle(t: [[f64; 3]; 3], z: f64) -> Option<Segment> {
    // A corner on the plane counts as above, so that either no edge or two edges cross.
    let above = t.map(|corner| corner[2] >= z);
    let mut crossings = (0..3).filter_map(|i| {
        let j = (i + 1) % 3;
        let (a, b) = (t[i], t[j]);
        (above[i] != above[j]).then(|| {
            let s = (z - a[2]) / (b[2] - a[2]);
            [a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])]
        })
    });
    Some([crossings.next()?, crossings.next()?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use aogrid_bake_core::mesh::Part;

    #[test]
    fn a_plane_cuts_two_edges_or_none() {
        let t = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 4.0, 2.0]];
        assert_eq!(cut_triangle(t, 1.0), Some([[1.0, 2.0], [0.0, 2.0]]));
        assert_eq!(cut_triangle(t, 3.0), None);
        assert_eq!(cut_triangle(t, -1.0), None);
        // Through a corner: at the apex, and along the lower edge.
        assert_eq!(cut_triangle(t, 2.0), Some([[0.0, 4.0], [0.0, 4.0]]));
        assert_eq!(cut_triangle(t, 0.0), None);
    }

    #[test]
    fn a_sheet_along_the_slice_has_its_border() {
        let corners = [
            [0.0, 0.0, 1.0],
            [2.0, 0.0, 1.0],
            [2.0, 1.0, 1.0],
            [0.0, 1.0, 1.0],
        ];
        let positions = corners.map(|p| p.map(|x| x as f32)).to_vec();
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        let whole = Part {
            name: String::new(),
            triangles: 0..2,
        };
        let sheet = TriangleMesh::new(positions, triangles, vec![whole]).unwrap();
        let lengths = |at: f64| -> Vec<f64> {
            let segments = outline(&sheet, 2, at, 0.5);
            let length = |[a, b]: Segment| f64::hypot(b[0] - a[0], b[1] - a[1]);
            segments.into_iter().map(length).collect()
        };
        // The four sides without the diagonal, at the sheet's own height, too.
        assert_eq!(lengths(1.1), [2.0, 1.0, 2.0, 1.0]);
        assert_eq!(lengths(1.0), [2.0, 1.0, 2.0, 1.0]);
        assert!(lengths(1.3).is_empty());
    }
}
