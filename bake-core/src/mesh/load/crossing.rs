//! The search for a place where a polygon crosses itself, without looking at all pairs of edges.

/// The pairs of edges that are compared for each corner, in all: a polygon of which an edge crosses
/// hundreds of others is found in the first of them, and none takes longer than so many.
const PAIRS_PER_CORNER: usize = 16;

/// The cells that all edges together may pass, for each corner.
const CELLS_PER_CORNER: usize = 16;

/// Whether two edges of a polygon cross each other in their insides.
///
/// First each edge is compared with a few others all around the polygon, which finds stars and
/// scribbles, and then with those near to it, by a grid with about a cell for each corner, which finds a
/// single loop. Takes O(n log n) for n corners. What touches itself, such as a hole that is cut open to
/// its outline, does not cross. `false` may be wrong for polygons with many long edges of which few cross.
pub(super) fn crosses_itself(polygon: &[[f64; 2]]) -> bool {
    let n = polygon.len();
    let edge = |idx: usize| [polygon[idx % n], polygon[(idx + 1) % n]];
    let crosses = |a: usize, b: usize| cross(edge(a), edge(b));
    // Steps of the golden ratio meet all parts of the polygon evenly.
    let far = |idx: usize, turn: usize| (idx + 1 + turn * (n * 5 / 13)) % n;
    let turns = (1..=PAIRS_PER_CORNER).flat_map(|turn| (0..n).map(move |idx| (idx, turn)));
    if turns
        .into_iter()
        .any(|(idx, turn)| crosses(idx, far(idx, turn)))
    {
        return true;
    }
    let mut passed = cells(polygon);
    passed.sort_unstable();
    let in_same = passed.chunk_by(|a, b| a.0 == b.0);
    let mut budget = PAIRS_PER_CORNER * n;
    for group in in_same {
        for (at, &(_, a)) in group.iter().enumerate() {
            let others = &group[at + 1..];
            let Some(left) = budget.checked_sub(others.len()) else {
                return false;
            };
            budget = left;
            if others.iter().any(|&(_, b)| crosses(a as usize, b as usize)) {
                return true;
            }
        }
    }
    false
}

/// Returns the cells of a grid that each edge passes, with the edge; nothing if they are too many. Cells
/// are as large as edges are long on average, so that few edges pass each.
fn cells(polygon: &[[f64; 2]]) -> Vec<(u64, u32)> {
    let n = polygon.len();
    let edges = || (0..n).map(|idx| [polygon[idx], polygon[(idx + 1) % n]]);
    let perimeter: f64 = edges().map(|[a, b]| (b[0] - a[0]).hypot(b[1] - a[1])).sum();
    let least = |x: usize| polygon.iter().map(|p| p[x]).fold(f64::INFINITY, f64::min);
    let (min, size) = ([least(0), least(1)], perimeter / n as f64);
    let in_cells = |p: [f64; 2]| [(p[0] - min[0]) / size, (p[1] - min[1]) / size];
    let mut passed = Vec::new();
    for (idx, edge) in edges().enumerate() {
        let [a, b] = edge.map(in_cells);
        let [low, high] = [a[1].min(b[1]), a[1].max(b[1])];
        for row in low as u64..=high as u64 {
            // The part of the edge within the row.
            let at = |y: f64| match a[1] == b[1] {
                true => [a[0], b[0]],
                false => {
                    let t = ((y - a[1]) / (b[1] - a[1])).clamp(0.0, 1.0);
                    [a[0] + t * (b[0] - a[0]); 2]
                }
            };
            let ends = [at(row as f64), at(row as f64 + 1.0)].concat();
            let first = ends.iter().copied().fold(f64::INFINITY, f64::min) as u64;
            let last = ends.iter().copied().fold(0.0, f64::max) as u64;
            if passed.len() as u64 + (last - first) > (CELLS_PER_CORNER * n) as u64 {
                return vec![];
            }
            passed.extend((first..=last).map(|x| (row << 32 | x, idx as u32)));
        }
    }
    passed
}

/// Whether each segment has the ends of the other strictly on both of its sides.
fn cross([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    let side = |[a, b]: [[f64; 2]; 2], p: [f64; 2]| {
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    };
    side([a, b], c) * side([a, b], d) < 0.0 && side([c, d], a) * side([c, d], b) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a polygon of n corners at these radii and angles.
    fn polygon(n: u32, polar: impl Fn(f64) -> [f64; 2]) -> Vec<[f64; 2]> {
        let corner = |idx: u32| {
            let [radius, angle] = polar(f64::from(idx) / f64::from(n));
            [radius * angle.cos(), radius * angle.sin()]
        };
        (0..n).map(corner).collect()
    }

    #[test]
    fn loops_and_stars_cross_and_what_touches_does_not() {
        use std::f64::consts::TAU;
        let n = 20_001;
        let circle = polygon(n, |t| [1.0, TAU * t]);
        let gear = polygon(n - 1, |t| {
            [
                if (t * f64::from(n - 1)).round() % 2.0 == 0.0 {
                    1.0
                } else {
                    0.9
                },
                TAU * t,
            ]
        });
        assert!(!crosses_itself(&circle) && !crosses_itself(&gear));
        // A ring whose outline is cut open to its hole, along the same segment there and back.
        let mut ring: Vec<_> = circle.iter().copied().chain([circle[0]]).collect();
        ring.extend(
            circle
                .iter()
                .rev()
                .chain([&circle[n as usize - 1]])
                .map(|p| p.map(|v| v / 2.0)),
        );
        assert!(!crosses_itself(&ring));
        let star = polygon(n, |t| [1.0, 10_000.0 * TAU * t]);
        let eight = polygon(n, |t| [(2.0 * TAU * t).sin(), TAU * t]);
        let mut looped = circle.clone();
        looped.swap(500, 502);
        for crossing in [star, eight, looped] {
            assert!(crosses_itself(&crossing));
        }
    }
}
