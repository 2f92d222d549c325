//! One axis' view of a brick: which axis is which, how steep directions are in cells, and the
//! planes in which the rows of cells lie.

use aogrid_bake_core::PreparedMesh;

use super::gpu_data::{Bucket, Frame, Level, MOST_ROWS, TABLE};
use super::plan::{Brick, Pass};

/// Fewest buckets a row of texels: then most hold no more fractions than a [`Bucket`] shows.
const FEWEST_BUCKETS: u32 = 64;

/// What fills a [`Bucket`] after the last fraction: none is below it.
const NO_FRACTION: f32 = 2.0;

/// A brick seen along its axis w; u, v, w follow each other cyclically.
pub(super) struct View {
    /// u, v and w.
    pub axes: [usize; 3],
    /// Cells of the brick along them, and the first.
    pub cells: [u32; 3],
    pub first: [u32; 3],
    /// Cells along u, and v, per cell along w of a direction of slope 1 in object space.
    pub shear: [f64; 2],
    size: u32,
}

/// The levels of a pass.
pub(super) struct Levels {
    /// For each row of texels, an entry for each k.
    pub levels: Vec<Level>,
    /// For each row of texels, see [`Levels::per_row`].
    pub buckets: Vec<Bucket>,
    /// Buckets a row of texels.
    pub per_row: u32,
    /// The lowest whole of any level, and how many levels follow it.
    lowest_whole: i32,
    pub n_ranks: u32,
}

impl View {
    pub(super) fn new(mesh: &PreparedMesh, brick: &Brick, w: usize, size: u32) -> Self {
        let axes = [(w + 1) % 3, (w + 2) % 3, w];
        let cell = mesh.spec().cell_size();
        let [u, v, w] = axes;
        Self {
            axes,
            cells: axes.map(|x| brick.cells[x]),
            first: axes.map(|x| brick.first[x]),
            shear: [cell[w] / cell[u], cell[w] / cell[v]],
            size,
        }
    }

    /// Cells along u (0) or v (1) per cell along w of a texel's direction.
    fn slope(&self, across: usize, texel: u32) -> f64 {
        let size = f64::from(self.size);
        self.shear[across] * ((f64::from(2 * texel + 1) - size) / size)
    }

    /// b of each row of texels; rows beyond the pass repeat its last.
    fn row_slopes(&self, pass: &Pass) -> [f32; MOST_ROWS as usize] {
        let row = |row: usize| pass.first_row + (row as u32).min(pass.n_rows - 1);
        std::array::from_fn(|idx| self.slope(1, row(idx)) as f32)
    }

    /// Row (j, k) lies in the plane V − b·W = j − k·b. Levels are numbered in the order of that
    /// value: by its whole part, then by the rank of its fraction among those of all k.
    pub(super) fn levels(&self, pass: &Pass) -> Levels {
        let [_, n_v, n_w] = self.cells;
        let mut levels = Vec::new();
        for slope in &self.row_slopes(pass)[..pass.n_rows as usize] {
            let first = levels.len();
            levels.extend((0..n_w).map(|k| self.level(k, *slope)));
            let row = &mut levels[first..];
            row.sort_by(|a: &Level, b| a.fraction.total_cmp(&b.fraction));
            for place in 0..row.len() {
                let k = row[place].k as usize;
                row[k].order = place as u32;
            }
        }
        let wholes = || levels.iter().map(|level| level.whole);
        let lowest_whole = self.first[1] as i32 + wholes().min().unwrap_or(0);
        let highest = (self.first[1] + n_v) as i32 + wholes().max().unwrap_or(0);
        let per_row = n_w.next_power_of_two().max(FEWEST_BUCKETS);
        debug_assert!((per_row * pass.n_rows) as usize <= TABLE);
        Levels {
            buckets: levels
                .chunks(n_w as usize)
                .flat_map(|row| buckets(row, per_row))
                .collect(),
            levels,
            per_row,
            lowest_whole,
            n_ranks: (highest - lowest_whole) as u32 * n_w,
        }
    }

    fn level(&self, k: u32, slope: f32) -> Level {
        let value = -((self.first[2] + k) as f32) * slope;
        let whole = value.floor();
        Level {
            fraction: value - whole,
            k,
            whole: whole as i32,
            order: 0,
        }
    }

    /// The mesh's bounds, wider by a cell: a thousand times more than rounding moves a step.
    pub(super) fn bounds_of(&self, [low, high]: [[f64; 3]; 2]) -> [[f32; 3]; 2] {
        let local = |p: [f64; 3], wider: f64| {
            std::array::from_fn(|i| (p[self.axes[i]] - f64::from(self.first[i]) + wider) as f32)
        };
        [local(low, -1.0), local(high, 1.0)]
    }

    /// All but what depends on the mesh.
    pub(super) fn frame(&self, pass: &Pass, levels: &Levels, bits: u32) -> Frame {
        Frame {
            cells: self.cells,
            bits,
            first_cell: self.first.map(|n| n as i32),
            size: self.size,
            axes: self.axes.map(|x| x as u32),
            buckets: levels.per_row,
            lowest_whole: levels.lowest_whole,
            n_ranks: levels.n_ranks,
            half_slope: (self.shear[0] / f64::from(self.size)) as f32,
            n_rows: pass.n_rows,
            first_block: pass.first_block,
            n_blocks: pass.n_blocks,
            row_slopes: self.row_slopes(pass),
            ..Frame::default()
        }
    }
}

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
