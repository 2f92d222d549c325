//! The data of a bake and of its passes.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize};

use aogrid_bake_core::sweep::{AxisFrame, LANES, texel_idx};
use aogrid_bake_core::{FaceBits, FixedTexel, Observer, PreparedMesh};

use super::VertexPositions;
use super::data::{Mask, Tile};
use super::moments::GridMoments;
use super::row_hits::RowHits;
use super::silhouettes::Silhouettes;
use super::simd::SimdLevel;
use super::workspace::Workspace;

/// The data that all passes of a bake share.
pub(super) struct SweepJob<'a> {
    pub mesh: &'a PreparedMesh,
    pub simd_level: SimdLevel,
    /// Texels along a face's side.
    pub size: u32,
    /// The texels of all six faces.
    pub texels: &'a [FixedTexel],
    pub vertices: &'a VertexPositions,
    pub workspaces: &'a Mutex<Vec<Workspace>>,
    pub grid_moments: &'a Mutex<GridMoments>,
    pub bits: Option<&'a Mutex<FaceBits>>,
    pub observer: Observer<'a>,
    pub done: AtomicUsize,
    pub cancelled: AtomicBool,
}

/// A pass: the batches of one axis and up to [`LANES`] texel rows.
pub(super) struct SweepPass<'a> {
    pub job: &'a SweepJob<'a>,
    pub frame: &'a AxisFrame,
    pub row_hits: &'a RowHits,
    pub tiles: Vec<Tile>,
    pub first_row: u32,
    pub n_rows: usize,
    pub silhouettes: &'a Silhouettes,
}

impl<'a> SweepPass<'a> {
    /// Returns the passes of an axis: the first texel row of each, and its number of rows.
    pub(super) fn rows(size: u32) -> impl Iterator<Item = (u32, usize)> {
        let starts = (0..size).step_by(LANES);
        starts.map(move |first| (first, (size - first).min(LANES as u32) as usize))
    }

    /// Records the occluded texels of a strip's masks, if the caller asked for bits.
    pub(super) fn record_bits(
        &self,
        tile: &Tile,
        (row, b, block): (usize, u32, usize),
        masks: &[Mask],
    ) {
        let Some(bits) = self.job.bits else {
            return;
        };
        let frame = self.frame;
        let mut bits = bits.lock().expect("no thread has panicked");
        for (i, &mask) in masks[..frame.cells[0] as usize].iter().enumerate() {
            let cell = self.cell_idx(tile, row, i);
            for bit in (0..Mask::BITS as usize).filter(|bit| mask >> bit & 1 != 0) {
                if let Some(texel) = texel_idx(frame.size, frame.axes[2], b, block, bit) {
                    bits.set(cell, texel);
                }
            }
        }
    }

    fn cell_idx(&self, tile: &Tile, row: usize, i: usize) -> usize {
        let [u, v, w] = self.frame.axes;
        let mut cell = [0; 3];
        cell[u] = i as u32;
        cell[v] = tile.j.start + (row % tile.j.len()) as u32;
        cell[w] = tile.k.start + (row / tile.j.len()) as u32;
        self.job.mesh.spec().cell_idx(cell)
    }
}
