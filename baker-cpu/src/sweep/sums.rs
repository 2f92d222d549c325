//! Sums: what cells add up to, in a tile and in the whole grid.
//!
//! Both keep one quantity after the other, so that those of neighbours are next to each other.
//! Sums are whole numbers ([`FaceSums`]): no order of adding matters.

use aogrid_bake_core::{FaceSums, Moments};
use rayon::prelude::*;

use super::counters::Tile;
use super::frame::{Frame, LANES};
use super::summation::Share;

/// What is summed: occluded texels, and their shares of the moments.
const QUANTITIES: usize = 5;

/// Those of a tile's cells, by row, then quantity, then cell.
#[derive(Default)]
pub(super) struct Sums {
    of: Vec<i32>,
    /// Cells along a row, and up to a multiple of [`LANES`].
    stride: usize,
}

/// Those of a row's cells.
pub(super) struct RowSums<'a>(pub [&'a mut [i32]; QUANTITIES]);

impl Sums {
    /// Before a tile is begun, or gone on with. All sums are zero if it is begun.
    pub(super) fn of_tile(&mut self, frame: &Frame, tile: &Tile) {
        self.stride = (frame.n[0] as usize).next_multiple_of(LANES);
        let n = tile.rows() * QUANTITIES * self.stride;
        self.of.resize(self.of.len().max(n), 0);
    }

    #[inline(always)]
    pub(super) fn row(&mut self, row: usize) -> RowSums<'_> {
        let n = QUANTITIES * self.stride;
        let mut quantities = self.of[row * n..][..n].chunks_exact_mut(self.stride);
        RowSums(std::array::from_fn(|_| {
            quantities.next().expect("there are five")
        }))
    }
}

impl RowSums<'_> {
    #[inline(always)]
    pub(super) fn add(&mut self, cell: usize, count: u32, share: &Share) {
        let [counts, shares @ ..] = &mut self.0;
        counts[cell] += count.cast_signed();
        for (sums, share) in shares.iter_mut().zip(share) {
            sums[cell] += share;
        }
    }
}

/// Those of all cells of a grid.
#[derive(Default)]
pub(super) struct Totals {
    of: [Vec<i32>; QUANTITIES],
    /// Between neighbours along x, y and z.
    strides: [usize; 3],
}

/// Sums between the layers of a grid. Rows that are a power of two apart would drive each other
/// out of a core's first cache.
const GAP: usize = 16;

impl Totals {
    /// All zero.
    pub(super) fn start(&mut self, resolution: [u32; 3]) {
        let [n_x, n_y, n_z] = resolution.map(|n| n as usize);
        let layer = n_x * n_y + GAP;
        self.strides = [1, n_x, layer];
        for of in &mut self.of {
            of.clear();
            of.resize(layer * n_z, 0);
        }
    }

    /// Adds those of a tile, and leaves them zero.
    pub(super) fn take(&mut self, frame: &Frame, tile: &Tile, sums: &mut Sums) {
        let [along_u, along_v, along_w] =
            [frame.u, frame.v, frame.w].map(|axis| self.strides[axis]);
        let rows = |j: u32, k: u32| {
            let first = k as usize * along_w + j as usize * along_v;
            (tile.row(j, k).expect("it is of the tile"), first)
        };
        let mut take = |(row, first): (u32, usize)| {
            for (all, sums) in self.of.iter_mut().zip(sums.row(row as usize).0) {
                add(&mut all[first..], along_u, &mut sums[..frame.n[0] as usize]);
            }
        };
        // One row after the other that is near it in the grid.
        let (js, ks) = (tile.j.clone(), tile.k.clone());
        match along_v < along_w {
            true => ks.for_each(|k| js.clone().for_each(|j| take(rows(j, k)))),
            false => js.for_each(|j| ks.clone().for_each(|k| take(rows(j, k)))),
        }
    }

    /// The moments of all cells, x fastest, and how many texels are occluded, of `directions`.
    pub(super) fn moments(&self, directions: u32) -> (Vec<Moments>, Vec<u32>) {
        let layer = self.strides[2];
        let n_cells = self.of[0].len() / layer * (layer - GAP);
        let mut moments = vec![Moments::default(); n_cells];
        let mut counts = vec![0; n_cells];
        let layers = moments
            .par_chunks_mut(layer - GAP)
            .zip(counts.par_chunks_mut(layer - GAP))
            .enumerate();
        layers.for_each(|(z, (moments, counts))| {
            let [count, a, x, y, z] = self.of.each_ref().map(|of| &of[z * layer..]);
            let sums = count.iter().zip(a).zip(x.iter().zip(y).zip(z));
            let cells = moments.iter_mut().zip(counts);
            for ((moments, into), ((&count, &a), ((&x, &y), &z))) in cells.zip(sums) {
                let count = count.cast_unsigned();
                let m = [x, y, z];
                *into = count;
                *moments = FaceSums { count, a, m }.moments(directions);
            }
        });
        (moments, counts)
    }
}

/// Adds sums to every `stride`-th of others, and leaves them zero.
#[inline(always)]
fn add(all: &mut [i32], stride: usize, sums: &mut [i32]) {
    if stride == 1 {
        // The same, for a compiler that would not see it.
        for (all, sum) in all.iter_mut().zip(sums) {
            *all += std::mem::take(sum);
        }
    } else {
        for (all, sum) in all.iter_mut().step_by(stride).zip(sums) {
            *all += std::mem::take(sum);
        }
    }
}
