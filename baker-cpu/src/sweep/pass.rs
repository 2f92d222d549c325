//! A pass: the batches of one axis and up to sixteen texel rows, distributed over threads.

use std::sync::MutexGuard;
use std::sync::atomic::{AtomicUsize, Ordering};

use aogrid_bake_core::Progress;
use rayon::prelude::*;

use super::batch::BatchKernel;
use super::job::{SweepJob, SweepPass};
use super::workspace::Workspace;
use crate::error::BakeError;

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
