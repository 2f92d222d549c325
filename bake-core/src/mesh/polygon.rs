//! Triangulation of the polygons of a mesh file.

use earcut::{Earcut, utils3d::project3d_to_2d};

/// A triangulator of polygons that reuses its buffers.
pub(super) struct Triangulator {
    earcut: Earcut<f64>,
    corners: Vec<[f64; 3]>,
    /// The corners projected to the polygon's plane.
    projected: Vec<[f64; 2]>,
    /// Three indices into the corners for each triangle.
    indices: Vec<u32>,
}

impl Triangulator {
    pub(super) fn new() -> Self {
        Self {
            earcut: Earcut::new(),
            corners: Vec::new(),
            projected: Vec::new(),
            indices: Vec::new(),
        }
    }

    /// Returns the triangles of a polygon as indices into its corners. A polygon of fewer than
    /// three corners has none.
    pub(super) fn triangulate(
        &mut self,
        polygon: impl Iterator<Item = [f32; 3]>,
    ) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.corners.clear();
        self.corners.extend(polygon.map(|p| p.map(f64::from)));
        self.indices.clear();
        // A fan would cover a concave polygon wrongly: partly twice, partly not at all.
        if !fan_covers(&self.corners)
            && project3d_to_2d(&self.corners, self.corners.len(), &mut self.projected)
        {
            let no_holes: [u32; 0] = [];
            self.earcut
                .earcut(self.projected.iter().copied(), &no_holes, &mut self.indices);
        }
        if self.indices.is_empty() {
            // The polygon is convex, or so degenerate that any triangulation will do.
            let n = self.corners.len() as u32;
            self.indices.extend((2..n).flat_map(|i| [0, i - 1, i]));
        }
        self.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]])
    }
}

/// Whether the fan around the first corner covers the polygon exactly: no triangle of the fan is
/// wound against the polygon's normal.
fn fan_covers(corners: &[[f64; 3]]) -> bool {
    let Some((&apex, rim)) = corners.split_first() else {
        return true;
    };
    let areas = || {
        rim.windows(2)
            .map(move |pair| cross(sub(pair[0], apex), sub(pair[1], apex)))
    };
    // The fan's signed areas sum to the polygon's for every shape (Newell's normal).
    let normal = areas().fold([0.0; 3], |n, a| [n[0] + a[0], n[1] + a[1], n[2] + a[2]]);
    areas().all(|a| a[0] * normal[0] + a[1] * normal[1] + a[2] * normal[2] >= 0.0)
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
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

    fn triangles(polygon: &[[f32; 3]]) -> Vec<[u32; 3]> {
        Triangulator::new()
            .triangulate(polygon.iter().copied())
            .collect()
    }

    /// Returns the sum of the triangles' areas, which is larger than the polygon's if they overlap.
    fn area(polygon: &[[f32; 3]]) -> f64 {
        let corner = |v: u32| polygon[v as usize].map(f64::from);
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(corner);
            cross(sub(b, a), sub(c, a))
                .iter()
                .map(|v| v * v)
                .sum::<f64>()
                .sqrt()
                / 2.0
        };
        triangles(polygon).iter().map(area).sum()
    }

    #[test]
    fn convex_polygons_become_fans() {
        let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(triangles(&square), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triangles(&square[..3]), [[0, 1, 2]]);
        assert!(triangles(&square[..2]).is_empty());
        assert!(triangles(&[]).is_empty());
    }

    #[test]
    fn concave_polygons_are_covered_once() {
        // A concave quad in a slanted plane, from every starting corner. The fan around its first
        // corner has the right area, the one around the second corner does not.
        let dart = [
            [0.0, 0.0, 0.0],
            [2.0, -2.0, 1.0],
            [0.0, 2.0, 2.0],
            [-2.0, -2.0, 3.0],
        ];
        // A comb with four teeth in the x–y plane: area 4 · 1 + 7 · 1.
        let mut comb = vec![[0.0, 0.0, 0.0], [7.0, 0.0, 0.0]];
        for tooth in (0..4).rev() {
            let x = (2 * tooth) as f32;
            comb.extend([[x + 1.0, 2.0, 0.0], [x, 2.0, 0.0]]);
            if tooth > 0 {
                comb.extend([[x, 1.0, 0.0], [x - 1.0, 1.0, 0.0]]);
            }
        }
        for (polygon, expected) in [(dart.to_vec(), dart_area(&dart)), (comb, 11.0)] {
            for start in 0..polygon.len() {
                let mut rotated = polygon.clone();
                rotated.rotate_left(start);
                let found = area(&rotated);
                assert!(
                    (found - expected).abs() < 1e-5,
                    "{start}: {found} {expected}"
                );
                rotated.reverse();
                let found = area(&rotated);
                assert!(
                    (found - expected).abs() < 1e-5,
                    "{start}: {found} {expected}"
                );
            }
        }
    }

    /// Returns the area of a quad whose diagonal 0–2 lies inside.
    fn dart_area(p: &[[f32; 3]; 4]) -> f64 {
        let p = p.map(|v| v.map(f64::from));
        let half = |a, b, c| {
            let n = cross(sub(b, a), sub(c, a));
            n.iter().map(|v| v * v).sum::<f64>().sqrt() / 2.0
        };
        half(p[0], p[1], p[2]) + half(p[0], p[2], p[3])
    }

    #[test]
    fn degenerate_polygons_give_triangles_without_area() {
        let line = [[0.0; 3], [1.0; 3], [2.0; 3], [3.0; 3]];
        assert_eq!(triangles(&line).len(), 2);
        assert_eq!(area(&line), 0.0);
        let point = [[1.0; 3]; 5];
        assert_eq!(area(&point), 0.0);
    }
}
