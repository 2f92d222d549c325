//! Levels: the planes in which the rows of cells of a brick lie, and the uniforms of a pass.

use aogrid_bake_core::sweep::AxisFrame;

use super::gpu_data::{Bucket, Frame, Level, MAX_ROWS, TABLE_LEN};
use super::plan::Pass;

/// The smallest number of buckets per row of texels. With as many, most buckets hold no more
/// fractions than a [`Bucket`] stores.
const MIN_BUCKETS: u32 = 64;

/// The filler of a [`Bucket`] after the last fraction; larger than any fraction.
const NO_FRACTION: f32 = 2.0;

/// The levels of a pass.
pub(super) struct Levels {
    /// The levels of each row of texels: an entry for each k.
    pub levels: Vec<Level>,
    /// The buckets of each row of texels, [`Levels::buckets_per_row`] each.
    pub buckets: Vec<Bucket>,
    pub buckets_per_row: u32,
    /// The lowest whole part of any level, and the number of levels from there on.
    lowest_whole: i32,
    pub n_ranks: u32,
}

/// Returns b of each row of texels; rows beyond the pass repeat the last row's.
fn row_slopes(frame: &AxisFrame, pass: &Pass) -> [f32; MAX_ROWS as usize] {
    let row = |row: usize| pass.first_row + (row as u32).min(pass.n_rows - 1);
    std::array::from_fn(|idx| frame.row_slope(row(idx)) as f32)
}

impl Levels {
    /// Returns the levels of a pass. Row (j, k) lies in the plane V − b·W = j − k·b. Levels are
    /// numbered in the order of that value: by its whole part, then by the rank of its fraction
    /// among those of all k.
    pub(super) fn new(frame: &AxisFrame, pass: &Pass) -> Self {
        let [_, n_v, n_w] = frame.cells;
        let [_, first_v, first_w] = frame.first;
        let mut levels = Vec::new();
        for slope in &row_slopes(frame, pass)[..pass.n_rows as usize] {
            let first = levels.len();
            levels.extend((0..n_w).map(|k| level(first_w, k, *slope)));
            let row = &mut levels[first..];
            row.sort_by(|a: &Level, b| a.fraction.total_cmp(&b.fraction));
            // Store the inverse permutation: from k to the index in this order.
            for idx in 0..row.len() {
                let k = row[idx].k as usize;
                row[k].order = idx as u32;
            }
        }
        let wholes = || levels.iter().map(|level| level.whole);
        let lowest_whole = first_v as i32 + wholes().min().unwrap_or(0);
        let highest = (first_v + n_v) as i32 + wholes().max().unwrap_or(0);
        let buckets_per_row = n_w.next_power_of_two().max(MIN_BUCKETS);
        debug_assert!((buckets_per_row * pass.n_rows) as usize <= TABLE_LEN);
        Self {
            buckets: levels
                .chunks(n_w as usize)
                .flat_map(|row| buckets(row, buckets_per_row))
                .collect(),
            levels,
            buckets_per_row,
            lowest_whole,
            n_ranks: (highest - lowest_whole) as u32 * n_w,
        }
    }

    /// Returns the uniforms of a pass, except those that depend on the mesh.
    pub(super) fn uniforms(&self, frame: &AxisFrame, pass: &Pass, bits: u32) -> Frame {
        Frame {
            cells: frame.cells,
            bits,
            first_cell: frame.first.map(|n| n as i32),
            size: frame.size,
            axes: frame.axes.map(|x| x as u32),
            buckets_per_row: self.buckets_per_row,
            lowest_whole: self.lowest_whole,
            n_ranks: self.n_ranks,
            half_slope: (frame.shear[0] / f64::from(frame.size)) as f32,
            n_rows: pass.n_rows,
            first_block: pass.first_block,
            n_blocks: pass.n_blocks,
            row_slopes: row_slopes(frame, pass),
            ..Frame::default()
        }
    }
}

fn level(first_k: u32, k: u32, slope: f32) -> Level {
    let value = -((first_k + k) as f32) * slope;
    let whole = value.floor();
    Level {
        fraction: value - whole,
        k,
        whole: whole as i32,
        order: 0,
    }
}

/// Returns the mesh's bounds along u, v and w, relative to the brick's first cell and enlarged by a
/// cell: a thousand times the distance by which rounding moves a delta.
pub(super) fn padded_bounds(frame: &AxisFrame, [low, high]: [[f64; 3]; 2]) -> [[f32; 3]; 2] {
    let local = |p: [f64; 3], padding: f64| {
        std::array::from_fn(|i| (p[frame.axes[i]] - f64::from(frame.first[i]) + padding) as f32)
    };
    [local(low, -1.0), local(high, 1.0)]
}

/// Returns the `n` buckets of a row of texels, whose levels are sorted by their fractions.
fn buckets(row: &[Level], n: u32) -> impl Iterator<Item = Bucket> + '_ {
    (0..n).map(move |idx| {
        let low = idx as f32 / n as f32;
        let start = row.partition_point(|level| level.fraction < low);
        let fraction = |i: usize| row.get(start + i).map_or(NO_FRACTION, |l| l.fraction);
        Bucket {
            fractions: [0, 1, 2].map(fraction),
            start: start as u32,
        }
    })
}
