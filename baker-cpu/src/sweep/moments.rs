//! Moments: integer sums of occluded texels, for the cells of a tile and of the whole grid.
//!
//! Both store one quantity after the other, so that those of neighboring cells are contiguous. The
//! sums are whole numbers ([`FaceSums`]), so the order of addition does not matter.

use aogrid_bake_core::sweep::{AxisFrame, LANES};
use aogrid_bake_core::{FaceSums, Moments};
use rayon::prelude::*;

use super::data::{QUANTITIES, RowMoments, Tile};

/// The moments of a tile's cells, by row, then quantity, then cell.
#[derive(Default)]
pub(super) struct TileMoments {
    values: Vec<i32>,
    /// Cells along a row, rounded up to a multiple of [`LANES`].
    stride: usize,
}

impl TileMoments {
    /// Reserves space for a tile, before it is started or resumed. All sums are zero at its start.
    pub(super) fn reserve_tile(&mut self, frame: &AxisFrame, tile: &Tile) {
        self.stride = (frame.cells[0] as usize).next_multiple_of(LANES);
        let n = tile.rows() * QUANTITIES * self.stride;
        self.values.resize(self.values.len().max(n), 0);
    }

    #[inline(always)]
    pub(super) fn row(&mut self, row: usize) -> RowMoments<'_> {
        let n = QUANTITIES * self.stride;
        let mut quantities = self.values[row * n..][..n].chunks_exact_mut(self.stride);
        RowMoments(std::array::from_fn(|_| {
            quantities.next().expect("a row has five quantities")
        }))
    }
}

/// The moments of all cells of a grid.
#[derive(Default)]
pub(super) struct GridMoments {
    values: [Vec<i32>; QUANTITIES],
    /// The strides between neighbors along x, y and z.
    strides: [usize; 3],
}

/// The padding between the layers of a grid. Rows at power-of-two distances would evict each other
/// from the L1 cache.
const LAYER_PADDING: usize = 16;

impl GridMoments {
    /// Resets all moments to zero.
    pub(super) fn reset(&mut self, resolution: [u32; 3]) {
        let [n_x, n_y, n_z] = resolution.map(|n| n as usize);
        let layer = n_x * n_y + LAYER_PADDING;
        self.strides = [1, n_x, layer];
        for values in &mut self.values {
            values.clear();
            values.resize(layer * n_z, 0);
        }
    }

    /// Adds the moments of a tile, and leaves those zero.
    pub(super) fn accumulate(
        &mut self,
        frame: &AxisFrame,
        tile: &Tile,
        tile_moments: &mut TileMoments,
    ) {
        let [along_u, along_v, along_w] = frame.axes.map(|axis| self.strides[axis]);
        let rows = |j: u32, k: u32| {
            let first = k as usize * along_w + j as usize * along_v;
            (tile.row(j, k).expect("the tile contains the row"), first)
        };
        let mut drain_row = |(row, first): (u32, usize)| {
            for (all, row_values) in self.values.iter_mut().zip(tile_moments.row(row as usize).0) {
                drain_strided(
                    &mut all[first..],
                    along_u,
                    &mut row_values[..frame.cells[0] as usize],
                );
            }
        };
        // Adjacent rows of the grid are visited one after the other.
        let (js, ks) = (tile.j.clone(), tile.k.clone());
        match along_v < along_w {
            true => ks.for_each(|k| js.clone().for_each(|j| drain_row(rows(j, k)))),
            false => js.for_each(|j| ks.clone().for_each(|k| drain_row(rows(j, k)))),
        }
    }

    /// Returns the moments of all cells, x fastest, and the number of occluded texels of each, out
    /// of `directions`.
    pub(super) fn moments(&self, directions: u32) -> (Vec<Moments>, Vec<u32>) {
        let layer = self.strides[2];
        let n_cells = self.values[0].len() / layer * (layer - LAYER_PADDING);
        let mut moments = vec![Moments::default(); n_cells];
        let mut counts = vec![0; n_cells];
        let layers = moments
            .par_chunks_mut(layer - LAYER_PADDING)
            .zip(counts.par_chunks_mut(layer - LAYER_PADDING))
            .enumerate();
        layers.for_each(|(z, (moments, counts))| {
            let [count, a, x, y, z] = self.values.each_ref().map(|values| &values[z * layer..]);
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

/// Adds values to every `stride`-th of others, and leaves them zero.
#[inline(always)]
fn drain_strided(all: &mut [i32], stride: usize, values: &mut [i32]) {
    if stride == 1 {
        // The same loop with a constant stride, which the compiler vectorizes.
        for (all, value) in all.iter_mut().zip(values) {
            *all += std::mem::take(value);
        }
    } else {
        for (all, value) in all.iter_mut().step_by(stride).zip(values) {
            *all += std::mem::take(value);
        }
    }
}
