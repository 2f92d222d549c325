//! The outline in which a plane cuts a mesh.

use aogrid_bake_core::TriangleMesh;

/// Returns the segments in which the plane across `axis` at the coordinate `at` cuts the mesh's
/// triangles, in the coordinates of the next two axes: (x, y) across z.
pub(crate) fn cut(mesh: &TriangleMesh, axis: usize, at: f64) -> Vec<[[f64; 2]; 2]> {
    let turned = |corner: [f32; 3]| [1, 2, 3].map(|i| f64::from(corner[(axis + i) % 3]));
    let triangles = mesh.corners().map(|t| t.map(turned));
    triangles.filter_map(|t| cut_triangle(t, at)).collect()
}

/// Returns the segment in which the plane cuts a triangle, if it does.
fn cut_triangle(t: [[f64; 3]; 3], z: f64) -> Option<[[f64; 2]; 2]> {
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
}
