//! The overlap of a triangle and a box.

/// Whether the triangle and the cube with this corner and side have a point in common: no
/// direction among the cube's and the triangle's normals and the products of their edges separates
/// them.
pub(super) fn overlaps_cube(corners: &[[f64; 3]; 3], corner: [f64; 3], side: f64) -> bool {
    let half = 0.5 * side;
    let p = corners.map(|c| [0, 1, 2].map(|x| c[x] - corner[x] - half));
    let separates = |axis: [f64; 3]| {
        let along = p.map(|p| dot(axis, p));
        let radius = half * (axis[0].abs() + axis[1].abs() + axis[2].abs());
        let (min, max) = (
            along[0].min(along[1]).min(along[2]),
            along[0].max(along[1]).max(along[2]),
        );
        min > radius || max < -radius
    };
    let units = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let edges = [0, 1, 2].map(|i| subtract(p[(i + 1) % 3], p[i]));
    let products = edges.iter().flat_map(|&e| units.map(|u| cross(u, e)));
    !(units.into_iter().any(separates)
        || separates(cross(edges[0], edges[1]))
        || products.into_iter().any(separates))
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_that_touch_pass_and_miss() {
        let unit = |corners: [[f64; 3]; 3]| overlaps_cube(&corners, [0.0; 3], 1.0);
        // Inside; through, with all corners outside; a large one past a corner; beside a face.
        assert!(unit([[0.2, 0.2, 0.2], [0.3, 0.2, 0.2], [0.2, 0.3, 0.2]]));
        assert!(unit([[-5.0, -5.0, 0.5], [5.0, -5.0, 0.5], [0.0, 9.0, 0.5]]));
        assert!(!unit([[2.2, 0.0, 0.0], [0.0, 2.2, 0.0], [2.0, 2.0, 1.0]]));
        assert!(unit([[1.8, 0.0, 0.5], [0.0, 1.8, 0.5], [2.0, 2.0, 0.5]]));
        assert!(!unit([[1.1, 0.0, 0.0], [1.1, 1.0, 0.0], [1.1, 0.0, 1.0]]));
        // A sliver that only a product of edges separates.
        assert!(!unit([
            [2.2, -0.1, -1.0],
            [-0.2, 2.3, 1.5],
            [2.3, -0.1, -1.0]
        ]));
    }
}
