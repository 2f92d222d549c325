//! A pass: the batches of one axis and up to sixteen rows of its faces, shared out to threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};

use aogrid_bake_core::{FaceBits, FixedTexel, Observer, PreparedMesh, Progress};
use rayon::prelude::*;

use super::Vertices;
use super::batch::{BatchWork, Workspace};
use super::counters::Tile;
use super::frame::{Frame, LANES};
use super::instructions::Instructions;
use super::piercings::Piercings;
use super::silhouettes::Silhouettes;
use super::summation::{self, Mask};
use super::sums::Totals;
use crate::BakeError;

/// What all passes of a bake share.
pub(super) struct Job<'a> {
    pub mesh: &'a PreparedMesh,
    pub instructions: Instructions,
    /// Texels along a face's side.
    pub size: u32,
    /// All of them.
    pub texels: &'a [FixedTexel],
    pub vertices: &'a Vertices,
    pub workspaces: &'a Mutex<Vec<Workspace>>,
    pub totals: &'a Mutex<Totals>,
    pub bits: Option<&'a Mutex<FaceBits>>,
    pub observer: Observer<'a>,
    pub done: AtomicUsize,
    pub cancelled: AtomicBool,
}

/// See the [module](self).
pub(super) struct Pass<'a> {
    pub job: &'a Job<'a>,
    pub frame: &'a Frame,
    pub piercings: &'a Piercings,
    pub tiles: Vec<Tile>,
    pub first_row: u32,
    pub n_rows: usize,
    pub silhouettes: &'a Silhouettes,
}

impl Job<'_> {
    /// Runs some passes on all threads.
    pub(super) fn run(&self, passes: &[Pass<'_>]) -> Result<(), BakeError> {
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

    /// Takes batches until there are none: tile by tile, so that a thread rarely has to leave
    /// its tile, which is when it hands over its sums.
    fn run_batches(&self, passes: &[Pass<'_>], next: &AtomicUsize) {
        let mut workspace = self.workspaces().pop().unwrap_or_default();
        let tiles = passes
            .iter()
            .flat_map(|pass| pass.tiles.iter().map(move |tile| (pass, tile)));
        let mut first = 0;
        let mut batch = next.fetch_add(1, Ordering::Relaxed);
        for (pass, tile) in tiles {
            let end = first + pass.n_rows;
            let mut has_sums = false;
            while batch < end {
                if !self.cancelled.load(Ordering::Relaxed) {
                    has_sums = true;
                    self.instructions.run(BatchWork {
                        pass,
                        tile,
                        row: batch - first,
                        workspace: &mut workspace,
                    });
                    self.observe(pass);
                }
                batch = next.fetch_add(1, Ordering::Relaxed);
            }
            if has_sums {
                let mut totals = self.totals.lock().expect("no thread has panicked");
                totals.take(pass.frame, tile, &mut workspace.sums);
            }
            first = end;
        }
        self.workspaces().push(workspace);
    }

    fn workspaces(&self) -> MutexGuard<'_, Vec<Workspace>> {
        self.workspaces.lock().expect("no thread has panicked")
    }

    fn observe(&self, pass: &Pass<'_>) {
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

impl<'a> Pass<'a> {
    /// The passes of an axis: their first rows, and how many rows they have.
    pub(super) fn rows(size: u32) -> impl Iterator<Item = (u32, usize)> {
        let starts = (0..size).step_by(LANES);
        starts.map(move |first| (first, (size - first).min(LANES as u32) as usize))
    }

    /// Sets the bits that a strip's masks say, if somebody wants them.
    pub(super) fn keep_bits(
        &self,
        tile: &Tile,
        (row, b, block): (usize, u32, usize),
        masks: &[Mask],
    ) {
        let Some(bits) = self.job.bits else {
            return;
        };
        let mut bits = bits.lock().expect("no thread has panicked");
        for (i, &mask) in masks[..self.frame.n[0] as usize].iter().enumerate() {
            let cell = self.cell_idx(tile, row, i);
            for bit in (0..Mask::BITS as usize).filter(|bit| mask >> bit & 1 != 0) {
                if let Some(texel) = summation::texel_of(self.frame, b, block, bit) {
                    bits.set(cell, texel);
                }
            }
        }
    }

    fn cell_idx(&self, tile: &Tile, row: usize, i: usize) -> usize {
        let mut cell = [0; 3];
        cell[self.frame.u] = i as u32;
        cell[self.frame.v] = tile.j.start + (row % tile.j.len()) as u32;
        cell[self.frame.w] = tile.k.start + (row / tile.j.len()) as u32;
        self.job.mesh.spec().cell_idx(cell)
    }
}
