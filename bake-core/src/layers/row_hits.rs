//! Row hits: where the line of a row of cells meets a triangle, and cells change sides.

use std::ops::Range;

use rayon::prelude::*;

use super::frame::{Frame, Side};
use crate::PreparedMesh;

/// A row's line through a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct RowHit {
    pub k: u32,
    pub j: u32,
    /// The first of the region's columns beyond the triangle: from here on s is larger by `delta`
    /// in all directions.
    pub column: u32,
    /// +1 where the normal points back along the row, so that it goes in; else −1.
    pub delta: i8,
}

/// All row hits along one axis, ordered by layer and row.
#[derive(Debug, Default)]
pub(super) struct RowHits(Vec<RowHit>);

/// Triangles that a thread looks at in one go.
const TRIANGLES_CHUNK: usize = 1 << 12;

impl RowHits {
    /// Finds those along each axis.
    pub(super) fn all(mesh: &PreparedMesh, frames: &[Frame; 3]) -> [Self; 3] {
        let bounds = Bounds::new(frames);
        let find = |triangles: &[[u32; 3]]| {
            let mut found = <[Self; 3]>::default();
            for corners in triangles {
                let [a, b, c] = corners.map(|corner| &mesh.vertices()[corner as usize]);
                let between = bounds.between([a, b, c]);
                // Most triangles of a fine mesh lie between all rows.
                if between.crossed >= 2 {
                    find(&[*a, *b, *c], frames, &between, &mut found);
                }
            }
            found
        };
        let chunks: Vec<_> = mesh
            .triangles()
            .par_chunks(TRIANGLES_CHUNK)
            .map(find)
            .collect();
        let mut all = <[Self; 3]>::default();
        for chunk in chunks {
            for (all, found) in all.iter_mut().zip(chunk) {
                all.0.extend(found.0);
            }
        }
        for hits in &mut all {
            hits.0.sort_unstable();
        }
        all
    }

    /// Those in some layers.
    pub(super) fn in_layers(&self, k: &Range<u32>) -> &[RowHit] {
        let start = self.0.partition_point(|hit| hit.k < k.start);
        let end = self.0.partition_point(|hit| hit.k < k.end);
        &self.0[start..end]
    }

    /// The most hits of one row.
    pub(super) fn max_in_row(&self) -> usize {
        let same_row = |a: &RowHit, b: &RowHit| (a.k, a.j) == (b.k, b.j);
        let rows = self.0.chunk_by(same_row).map(<[_]>::len);
        rows.max().unwrap_or(0)
    }
}

/// The cells of the region along x, y and z.
struct Bounds {
    bits: u32,
    start: [i32; 3],
    end: [i32; 3],
}

/// The planes of cells between a triangle's bounds, along x, y and z.
struct Between {
    first: [i32; 3],
    end: [i32; 3],
    /// Along how many axes there are any.
    crossed: u32,
}

impl Bounds {
    fn new(frames: &[Frame; 3]) -> Self {
        // Frame w is along the axis w.
        let along = frames.each_ref().map(|frame| &frame.cells[2]);
        Self {
            bits: frames[0].bits,
            start: along.map(|cells| cells.start as i32),
            end: along.map(|cells| cells.end as i32),
        }
    }

    #[inline(always)]
    fn between(&self, [a, b, c]: [&[i32; 3]; 3]) -> Between {
        let mut between = Between {
            first: [0; 3],
            end: [0; 3],
            crossed: 0,
        };
        let round_up = (1 << self.bits) - 1;
        for x in 0..3 {
            let low = a[x].min(b[x]).min(c[x]);
            let high = a[x].max(b[x]).max(c[x]);
            between.first[x] = ((low + round_up) >> self.bits).max(self.start[x]);
            between.end[x] = ((high >> self.bits) + 1).min(self.end[x]);
            between.crossed += u32::from(between.first[x] < between.end[x]);
        }
        between
    }
}

/// Finds a triangle's row hits along each axis.
fn find(points: &[[i32; 3]; 3], frames: &[Frame; 3], between: &Between, found: &mut [RowHits; 3]) {
    for (frame, found) in frames.iter().zip(found) {
        let [_, v, w] = frame.axes;
        let [rows, layers] = [v, w].map(|x| between.first[x]..between.end[x]);
        if !rows.is_empty() && !layers.is_empty() {
            hits_of(points, frame, [rows, layers], found);
        }
    }
}

fn hits_of(
    points: &[[i32; 3]; 3],
    frame: &Frame,
    [rows, layers]: [Range<i32>; 2],
    found: &mut RowHits,
) {
    let points = points.each_ref().map(|p| frame.project(p));
    let edge = |i: usize| {
        let [[_, av, aw], [_, bv, bw]] = [points[i], points[(i + 1) % 3]];
        Side::new([av, aw], [bv, bw])
    };
    let edges = [edge(0), edge(1), edge(2)];
    for k in layers {
        for j in rows.clone() {
            let at = [i64::from(j) << frame.bits, i64::from(k) << frame.bits];
            let sides = edges.each_ref().map(|edge| edge.of(at).signum());
            let sides = sides[0] + sides[1] + sides[2];
            if sides.abs() == 3 {
                found.0.push(RowHit {
                    k: k as u32,
                    j: j as u32,
                    column: column(&points, frame, at),
                    // Counter-clockwise in (v, w) is a normal along +u.
                    delta: if sides > 0 { -1 } else { 1 },
                });
            }
        }
    }
}

/// The first column whose cells are not before the point where the row's line meets the plane of
/// the triangle, which is not parallel to it.
fn column(points: &[[i64; 3]; 3], frame: &Frame, [v, w]: [i64; 2]) -> u32 {
    let [a, b, c] = *points;
    let along = |p: [i64; 3], x: usize| p[x] - a[x];
    let minor = |y: usize, z: usize| (along(b, y) * along(c, z) - along(b, z) * along(c, y)) as f64;
    let [n_u, n_v, n_w] = [minor(1, 2), minor(2, 0), minor(0, 1)];
    let rise = (n_v * (v - a[1]) as f64 + n_w * (w - a[2]) as f64) / n_u;
    let at = (a[0] as f64 - rise) / f64::from(1_u32 << frame.bits);
    let cells = &frame.cells[0];
    let from_start = at.ceil() - f64::from(cells.start);
    from_start.clamp(0.0, cells.len() as f64) as u32
}
