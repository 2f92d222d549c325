//! A pass: the batches of one axis and up to sixteen texel rows, distributed over threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};

use aogrid_bake_core::sweep::{AxisFrame, LANES, texel_idx};
use aogrid_bake_core::{FaceBits, FixedTexel, Observer, PreparedMesh, Progress};
use rayon::prelude::*;

use super::VertexPositions;
use super::batch::{BatchKernel, Workspace};
use super::counters::Tile;
use super::moments::GridMoments;
use super::row_hits::RowHits;
use super::silhouettes::Silhouettes;
use super::simd::SimdLevel;
use super::summation::Mask;
use crate::error::BakeError;

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

/// A pass: see the [module](self).
pub(super) struct SweepPass<'a> {
    pub job: &'a SweepJob<'a>,
    pub frame: &'a AxisFrame,
    pub row_hits: &'a RowHits,
    pub tiles: Vec<Tile>,
    pub first_row: u32,
    pub n_rows: usize,
    pub silhouettes: &'a Silhouettes,
}

impl SweepJob<'_> {
    /// Runs some passes on all threads.
    pub(super) fn run(&self, passes: &[SweepPass<'_>]) -> Result<(), BakeError> {
        let next = AtomicUsize::new(0);
        (0..rayon::current_num_threads())
            .into_par_iter()
            .with_max_len(1)
            .for_each(|_| self.run_batches(passes, &next));
        match self.cancelled.load(Ordering::Relaxed) {
            true => Err(BakeError::Cancelled),
            false => Ok(()),
        }
    }

    /// Takes batches until none is left. Batches are ordered by tile, so that a thread rarely
    /// changes tiles, which is when it adds its moments to the grid's.
    fn run_batches(&self, passes: &[SweepPass<'_>], next: &AtomicUsize) {
        let mut workspace = self.workspaces().pop().unwrap_or_default();
        let tiles = passes
            .iter()
            .flat_map(|pass| pass.tiles.iter().map(move |tile| (pass, tile)));
        // All threads walk the same list of tiles; the shared counter assigns the batches.
        let mut first = 0;
        let mut batch = next.fetch_add(1, Ordering::Relaxed);
        for (pass, tile) in tiles {
            let end = first + pass.n_rows;
            let mut has_moments = false;
            while batch < end {
                if !self.cancelled.load(Ordering::Relaxed) {
                    has_moments = true;
                    self.simd_level.run(BatchKernel {
                        pass,
                        tile,
                        row: batch - first,
                        workspace: &mut workspace,
                    });
                    self.observe(pass);
                }
                batch = next.fetch_add(1, Ordering::Relaxed);
            }
            if has_moments {
                let mut grid_moments = self.grid_moments.lock().expect("no thread has panicked");
                grid_moments.accumulate(pass.frame, tile, &mut workspace.moments);
            }
            first = end;
        }
        self.workspaces().push(workspace);
    }

    fn workspaces(&self) -> MutexGuard<'_, Vec<Workspace>> {
        self.workspaces.lock().expect("no thread has panicked")
    }

    fn observe(&self, pass: &SweepPass<'_>) {
        let total = self.mesh.spec().cell_count();
        let batches = 3 * self.size as usize * pass.tiles.len();
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        // Axes may differ in their number of tiles.
        let done = (total * done / batches).min(total);
        if (self.observer)(Progress { done, total }).is_break() {
            self.cancelled.store(true, Ordering::Relaxed);
        }
    }
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
