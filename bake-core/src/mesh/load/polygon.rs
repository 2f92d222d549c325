//! Triangulation of the polygons of a mesh file.

use earcut::{Earcut, utils3d::project3d_to_2d};

use super::large_polygon;

/// A triangulator of polygons that reuses its buffers.
pub(super) struct Triangulator {
    earcut: Earcut<f64>,
    corners: Vec<[f64; 3]>,
    /// The corners projected to the polygon's plane.
    projected: Vec<[f64; 2]>,
    /// Three indices into the corners for each triangle.
    indices: Vec<u32>,
    crossing: usize,
}

/// The share of a polygon's area by which its triangles may differ from it: far above the rounding of
/// sums in double precision, far below what a crossing of any size to speak of makes.
const AREA_TOLERANCE: f64 = 1e-6;

/// The corners up to which ears are cut off, which takes a time that grows with their square or more.
const MAX_EARS: usize = 1_000;

impl Triangulator {
    pub(super) fn new() -> Self {
        Self {
            earcut: Earcut::new(),
            corners: Vec::new(),
            projected: Vec::new(),
            indices: Vec::new(),
            crossing: 0,
        }
    }

    /// Returns a warning if polygons so far cross themselves.
    pub(super) fn warnings(&self) -> Vec<String> {
        let warning = match self.crossing {
            0 => None,
            n => Some(format!(
                "{n} polygons cross themselves: their triangles may cover more than they enclose"
            )),
        };
        warning.into_iter().collect()
    }

    /// Returns the triangles of a polygon as indices into its corners. A polygon of fewer than
    /// three corners has none.
    ///
    /// A polygon that crosses itself becomes a fan and gets a [warning](Triangulator::warnings). The
    /// signed triangles of a fan add up to the winding number of the polygon at every point, so that
    /// a fan covers all that the polygon encloses, and perhaps more.
    pub(super) fn triangulate(
        &mut self,
        polygon: impl Iterator<Item = [f64; 3]>,
    ) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.corners.clear();
        self.corners.extend(polygon);
        self.indices.clear();
        let outline = Outline::of(&self.corners);
        self.crossing += usize::from(outline == Outline::Crossing);
        // A fan would cover a concave polygon wrongly: partly twice, partly not at all.
        if outline == Outline::Concave
            && project3d_to_2d(&self.corners, self.corners.len(), &mut self.projected)
        {
            if self.corners.len() > MAX_EARS {
                large_polygon::cut(&self.projected, &mut self.indices);
            } else {
                let no_holes: [u32; 0] = [];
                let projected = self.projected.iter().copied();
                self.earcut.earcut(projected, &no_holes, &mut self.indices);
            }
            if !covers(&self.projected, &self.indices) {
                self.crossing += 1;
                self.indices.clear();
            }
        }
        if self.indices.is_empty() {
            // The polygon is convex, crosses itself, or is so degenerate that any triangulation
            // will do.
            let n = self.corners.len() as u32;
            self.indices.extend((2..n).flat_map(|i| [0, i - 1, i]));
        }
        self.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]])
    }
}

/// Whether the triangles have as much area as the polygon that they were cut from. A polygon that
/// crosses itself has less than its triangles, because parts of it count as negative, or more, if the
/// cutting gave up.
fn covers(polygon: &[[f64; 2]], indices: &[u32]) -> bool {
    let doubled =
        |[a, b, c]: [[f64; 2]; 3]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let apex = polygon[0];
    let whole: f64 = polygon
        .windows(2)
        .map(|pair| doubled([apex, pair[0], pair[1]]))
        .sum();
    let corner = |v: u32| polygon[v as usize];
    let triangles = indices.chunks_exact(3);
    let cut: f64 = triangles
        .map(|t| doubled([corner(t[0]), corner(t[1]), corner(t[2])]).abs())
        .sum();
    (cut - whole.abs()).abs() <= AREA_TOLERANCE * cut.max(whole.abs())
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Outline {
    /// The fan around the first corner covers the polygon exactly: no triangle of the fan is wound
    /// against the polygon's normal.
    Fan,
    /// The polygon needs more than a fan, unless it crosses itself.
    Concave,
    /// The polygon encloses as large an area one way round as the other way round.
    Crossing,
}

impl Outline {
    fn of(corners: &[[f64; 3]]) -> Self {
        let Some((&apex, rim)) = corners.split_first() else {
            return Self::Fan;
        };
        let areas = || {
            rim.windows(2)
                .map(move |pair| cross(sub(pair[0], apex), sub(pair[1], apex)))
        };
        // The fan's signed areas sum to the polygon's for every shape (Newell's normal).
        let normal = areas().fold([0.0; 3], |n, a| [n[0] + a[0], n[1] + a[1], n[2] + a[2]]);
        let total: f64 = areas().map(length).sum();
        if total > 0.0 && length(normal) <= AREA_TOLERANCE * total {
            return Self::Crossing;
        }
        let is_forward =
            |a: [f64; 3]| a[0] * normal[0] + a[1] * normal[1] + a[2] * normal[2] >= 0.0;
        match areas().all(is_forward) {
            true => Self::Fan,
            false => Self::Concave,
        }
    }
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
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

    fn triangles(polygon: &[[f64; 3]]) -> Vec<[u32; 3]> {
        Triangulator::new()
            .triangulate(polygon.iter().copied())
            .collect()
    }

    /// Returns the sum of the triangles' areas, which is larger than the polygon's if they overlap.
    fn area(polygon: &[[f64; 3]]) -> f64 {
        let corner = |v: u32| polygon[v as usize];
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
            let x = f64::from(2 * tooth);
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
    fn dart_area(p: &[[f64; 3]; 4]) -> f64 {
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

    #[test]
    fn a_polygon_that_crosses_itself_keeps_what_it_encloses() {
        // Two bow ties: with triangles of equal areas, and with one four times as large.
        for (right, at) in [(2.0, 1.0), (3.0, 1.0)] {
            let bow = [
                [0.0, 0.0, 0.0],
                [right, right, 0.0],
                [right, 2.0 * at - right, 0.0],
                [0.0, 2.0, 0.0],
            ];
            for start in 0..4 {
                let mut bow = bow;
                bow.rotate_left(start);
                let mut triangulator = Triangulator::new();
                let cut: Vec<_> = triangulator.triangulate(bow.into_iter()).collect();
                let is_covered = |p: [f64; 2]| {
                    cut.iter().any(|t| {
                        let [a, b, c] = t.map(|v| bow[v as usize]);
                        let side = |a: [f64; 3], b: [f64; 3]| {
                            (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
                        };
                        let sides = [side(a, b), side(b, c), side(c, a)];
                        sides.iter().all(|v| *v >= 0.0) || sides.iter().all(|v| *v <= 0.0)
                    })
                };
                assert!(
                    is_covered([0.1, 1.0]) && is_covered([right - 0.1, 1.0]),
                    "{start}"
                );
                assert_eq!(triangulator.warnings().len(), 1, "{right} {start}");
            }
        }
        let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let mut triangulator = Triangulator::new();
        assert_eq!(triangulator.triangulate(square.into_iter()).count(), 2);
        assert!(triangulator.warnings().is_empty());
    }

    /// Polygons of 20,000 corners that cross themselves somewhere become fans, with a warning.
    #[test]
    fn polygons_of_many_corners_that_cross_themselves_are_fans() {
        let n = 20_001;
        let at = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin(), 0.0];
        // A loop within a loop, which meet where the radius is zero.
        let corner = |i: u32| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
            at(1.0 + 2.0 * angle.cos(), angle)
        };
        let mut triangulator = Triangulator::new();
        let cut = triangulator.triangulate((0..n).map(corner));
        assert_eq!(cut.count(), n as usize - 2);
        assert_eq!(triangulator.warnings().len(), 1);
    }

    /// A gear of 10,000 teeth: every second corner is reflex.
    #[test]
    fn polygons_of_many_corners_are_cut_exactly() {
        let n = 20_000;
        let corner = |i: u32| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
            let radius = if i.is_multiple_of(2) { 1.0 } else { 0.9 };
            [radius * angle.cos(), radius * angle.sin(), 0.0]
        };
        let gear: Vec<_> = (0..n).map(corner).collect();
        // The polygon is n triangles with two sides of lengths 1 and 0.9 at its center.
        let expected = f64::from(n) * 0.45 * (std::f64::consts::TAU / f64::from(n)).sin();
        assert!((area(&gear) - expected).abs() < 1e-9 * expected);
        assert_eq!(triangles(&gear).len(), n as usize - 2);
    }
}
