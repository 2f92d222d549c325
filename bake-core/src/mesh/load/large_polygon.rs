//! Triangulation of polygons of many corners by a sweep line, in O((n + k) log n) for n corners and k
//! crossings, and a look beforehand whether k is small.

use std::collections::HashMap;

use i_triangle::i_overlay::i_float::int::point::IntPoint;
use i_triangle::int::triangulation::IntTriangulation;
use i_triangle::int::triangulator::IntTriangulator;

/// The pairs of edges that are compared for each corner. With k crossings, about 2 · 16 k/n of the pairs
/// cross: where none does, k is hardly more than a quarter of n, and the sweep line is fast.
const PAIRS_PER_CORNER: usize = 16;

/// The corners that may lie on one point: the sweep line takes a time that grows with their square,
/// about 0.1 s for so many.
const MAX_MEETING: u32 = 1_000;

/// The bits of the coordinates that the sweep line computes with, exactly: as many as a double has, so
/// that corners move by a rounding of the polygon's size at most.
const COORDINATE_BITS: i32 = 52;

/// Appends the triangles of a polygon as indices into its corners; none if it crosses itself, or meets
/// itself in one point too often. What touches itself, such as a hole that is cut open to its outline,
/// does not cross.
pub(super) fn cut(polygon: &[[f64; 2]], indices: &mut Vec<u32>) {
    let points = whole_numbers(polygon);
    let mut corners = HashMap::with_capacity(points.len());
    for (idx, point) in points.iter().enumerate() {
        let (_, count) = corners.entry((point.x, point.y)).or_insert((idx as u32, 0));
        *count += 1;
        if *count > MAX_MEETING {
            return;
        }
    }
    if crosses_often(&points) {
        return;
    }
    let mut triangles = IntTriangulation::default();
    IntTriangulator::<i64, u32>::default().triangulate_contour_into(points, &mut triangles);
    let corner = |point: &IntPoint<i64>| corners.get(&(point.x, point.y)).map(|(idx, _)| *idx);
    // A point that is no corner is a crossing.
    let found: Option<Vec<u32>> = triangles.points.iter().map(corner).collect();
    if let Some(found) = found {
        indices.extend(triangles.indices.iter().map(|idx| found[*idx as usize]));
    }
}

/// Returns the corners relative to the first, scaled to whole numbers.
fn whole_numbers(polygon: &[[f64; 2]]) -> Vec<IntPoint<i64>> {
    let offset = |p: &[f64; 2]| [p[0] - polygon[0][0], p[1] - polygon[0][1]];
    let largest = polygon
        .iter()
        .flat_map(offset)
        .fold(0.0, |m, v| v.abs().max(m));
    // In two steps: the scale of the smallest numbers is no double.
    let half = 2f64.powi((COORDINATE_BITS - largest.log2().ceil().max(-1e3) as i32) / 2);
    let whole = |v: f64| (v * half * half).round() as i64;
    let point = |p| IntPoint::new(whole(offset(p)[0]), whole(offset(p)[1]));
    polygon.iter().map(point).collect()
}

/// Whether some of a few random pairs of edges cross each other in their insides.
fn crosses_often(points: &[IntPoint<i64>]) -> bool {
    let n = points.len();
    let edge = |idx: usize| [points[idx], points[(idx + 1) % n]];
    let mut state = 1;
    (0..n * PAIRS_PER_CORNER).any(|pair| {
        let other = (u128::from(splitmix(&mut state)) * n as u128) >> 64;
        cross(edge(pair % n), edge(other as usize))
    })
}

/// Returns a random number: always the same ones, so that a file has one triangulation.
fn splitmix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mixed = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    mixed ^ (mixed >> 31)
}

/// Whether each segment has the ends of the other strictly on both of its sides.
fn cross([a, b]: [IntPoint<i64>; 2], [c, d]: [IntPoint<i64>; 2]) -> bool {
    let side = |[a, b]: [IntPoint<i64>; 2], p: IntPoint<i64>| {
        let wide = |v: i64, w: i64| i128::from(v) * i128::from(w);
        (wide(b.x - a.x, p.y - a.y) - wide(b.y - a.y, p.x - a.x)).signum()
    };
    side([a, b], c) * side([a, b], d) < 0 && side([c, d], a) * side([c, d], b) < 0
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 100_000;

    fn triangles(polygon: &[[f64; 2]]) -> Vec<u32> {
        let mut indices = Vec::new();
        cut(polygon, &mut indices);
        indices
    }

    /// Returns twice the area of the triangles.
    fn doubled_area(polygon: &[[f64; 2]], indices: &[u32]) -> f64 {
        let of = |t: &[u32]| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|idx| polygon[idx as usize]);
            ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
        };
        indices.chunks(3).map(of).sum()
    }

    /// Returns a polygon of edges that all span it, one cell from the next, closed below.
    fn zigzag() -> Vec<[f64; 2]> {
        let height = N as f64;
        let corner = |idx: usize| [idx as f64, if idx.is_multiple_of(2) { 0.0 } else { height }];
        let base = [[N as f64 - 3.0, -1.0], [0.0, -1.0]];
        (0..N - 2).map(corner).chain(base).collect()
    }

    fn circle(radius: f64) -> impl DoubleEndedIterator<Item = [f64; 2]> {
        let angle = |idx: i32| f64::from(idx) / (N / 2) as f64 * std::f64::consts::TAU;
        (0..N as i32 / 2).map(move |idx| [radius * angle(idx).cos(), radius * angle(idx).sin()])
    }

    /// Under the zigzag's mean height N/2 lies a strip of the height 1.
    #[test]
    fn long_edges_are_cut_exactly() {
        let zigzag = zigzag();
        let cut = triangles(&zigzag);
        assert_eq!(cut.len(), 3 * (N - 2));
        let (found, expected) = (doubled_area(&zigzag, &cut), ((N - 3) * (N + 2)) as f64);
        assert!((found - expected).abs() < 1e-9 * expected, "{found}");
    }

    /// A ring whose outline is cut open to its hole, along the same segment there and back.
    #[test]
    fn what_touches_itself_does_not_cross() {
        let ring: Vec<_> = circle(1.0)
            .chain(circle(1.0).take(1))
            .chain(circle(0.5).take(1))
            .chain(circle(0.5).rev())
            .collect();
        let n = (N / 2) as f64;
        let expected = 0.75 * n * (std::f64::consts::TAU / n).sin();
        let found = doubled_area(&ring, &triangles(&ring));
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }

    /// One crossing of two long edges, of all edges by one, and of each edge by many others.
    #[test]
    fn crossings_are_found() {
        let mut one = zigzag();
        one.swap(50_000, 50_002);
        let mut all = zigzag();
        let height = N as f64 / 2.0;
        all.splice(N - 2.., [[N as f64, height], [-1.0, height]]);
        let star: Vec<_> = (0..N)
            .map(|idx| (idx * 49_999 % N) as f64 / N as f64 * std::f64::consts::TAU)
            .map(|angle| [angle.cos(), angle.sin()])
            .collect();
        for polygon in [one, all, star] {
            assert!(triangles(&polygon).is_empty());
        }
    }

    /// Every third corner is the center: the sweep line would take minutes.
    #[test]
    fn edges_that_meet_in_one_point_end_it() {
        let mut hub: Vec<_> = circle(1.0).collect();
        hub.iter_mut()
            .step_by(3)
            .for_each(|corner| *corner = [0.0; 2]);
        assert!(triangles(&hub).is_empty());
        assert!(triangles(&hub[..2_900]).len() > 3 * 900);
    }

    #[test]
    fn any_size_of_coordinates_will_do() {
        for scale in [1e-300, 1e-30, 1.0, 1e30, 1e150] {
            let square = [[3.0, 3.0], [4.0, 3.0], [3.5, 3.5], [4.0, 4.0], [3.0, 4.0]];
            let scaled = square.map(|p| p.map(|v| v * scale));
            let cut = triangles(&scaled);
            assert!((doubled_area(&square, &cut) - 1.5).abs() < 1e-12, "{scale}");
        }
        assert!(triangles(&[[1.0; 2]; 5]).is_empty());
    }
}
