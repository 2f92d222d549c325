//! A batch: all directions of one slope b, in one tile of the grid.

use aogrid_bake_core::sweep::LANES;

use super::data::{
    Batch, EDGE_CHUNK, EdgeFacing, FacingInterval, GroupCounters, Layout, Levels, SilhouetteChunk,
    Tile, block_texels,
};
use super::job::SweepPass;
use super::simd::{Simd, SimdKernel, is_zero, masks};
use super::workspace::Workspace;

/// The work of one batch in one tile, compiled for each SIMD level.
pub(super) struct BatchKernel<'a> {
    pub pass: &'a SweepPass<'a>,
    pub tile: &'a Tile,
    /// The texel row, counted from the pass's first.
    pub row: usize,
    pub workspace: &'a mut Workspace,
}

impl SimdKernel for BatchKernel<'_> {
    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let pass = self.pass;
        let b = pass.first_row + self.row as u32;
        // The plane offsets of the rows depend on b alone, so one set of levels serves the batch.
        let levels = Levels::new(pass.frame, self.tile, b);
        let slopes: Vec<_> = (0..pass.frame.blocks())
            .map(|block| pass.frame.slopes(block))
            .collect();
        let batch = Batch {
            mesh: pass.job.mesh,
            frame: pass.frame,
            tile: self.tile,
            b,
            positions: &pass.job.vertices.positions,
            levels: &levels,
            slopes: &slopes,
        };
        let layout = Layout::new(pass.frame);
        self.workspace.deltas.reset(layout, self.tile);
        self.rank(simd, &levels);
        self.count_interior_edges(simd, &batch);
        self.count_boundary_edges(simd, &batch);
        self.count_row_hits(&batch);
        self.sum(simd, layout);
    }
}

impl BatchKernel<'_> {
    #[inline(always)]
    fn rank<S: Simd>(&mut self, simd: S, levels: &Levels) {
        let [_, v, w] = self.pass.frame.axes;
        let by_axis = &self.pass.job.vertices.by_axis;
        let ranks = &mut self.workspace.ranks;
        ranks.resize(by_axis[v].len(), 0);
        simd.ranks(levels, &by_axis[v], &by_axis[w], ranks);
    }

    /// Counts interior edges that are silhouettes and cross a level: two layers more or fewer each.
    #[inline(always)]
    fn count_interior_edges<S: Simd>(&mut self, simd: S, batch: &Batch<'_>) {
        for lists in &self.pass.silhouettes.lists {
            let list = &lists[self.row];
            let mut first = 0;
            while first < list.facings.len() {
                self.reserve_edges(simd, batch, 2);
                let Workspace { edges, ranks, .. } = &mut *self.workspace;
                let (chunk, next) = SilhouetteChunk::new(list, first, ranks);
                simd.collect(&chunk, edges);
                first = next;
            }
        }
        self.flush_edges(simd, batch, 2);
    }

    /// Counts boundary edges that cross a level: always one layer more or fewer each.
    #[inline(always)]
    fn count_boundary_edges<S: Simd>(&mut self, simd: S, batch: &Batch<'_>) {
        let (facings, row) = (&self.pass.silhouettes.facings, self.row);
        for chunk in self.pass.job.mesh.boundary_edges().chunks(EDGE_CHUNK) {
            self.reserve_edges(simd, batch, 1);
            let Workspace { edges, ranks, .. } = &mut *self.workspace;
            for edge in chunk {
                let facing = facings[edge.side.triangle()][row].oriented(edge.side);
                edges.push(edge.vertices, ranks, EdgeFacing::new(facing, facing));
            }
        }
        self.flush_edges(simd, batch, 1);
    }

    #[inline(always)]
    fn reserve_edges<S: Simd>(&mut self, simd: S, batch: &Batch<'_>, unit: i8) {
        if !self.workspace.edges.has_capacity(EDGE_CHUNK) {
            self.flush_edges(simd, batch, unit);
        }
    }

    #[inline(always)]
    fn flush_edges<S: Simd>(&mut self, simd: S, batch: &Batch<'_>, unit: i8) {
        let Workspace { edges, deltas, .. } = &mut *self.workspace;
        simd.count(batch, edges, unit, deltas);
        edges.n = 0;
    }

    #[inline(always)]
    fn count_row_hits(&mut self, batch: &Batch<'_>) {
        let pass = self.pass;
        let Workspace { ranks, deltas, .. } = &mut *self.workspace;
        let facing = |triangle: u32| -> FacingInterval {
            pass.silhouettes.facings[triangle as usize][self.row]
        };
        let corners = |triangle: u32| {
            let vertices = pass.job.mesh.triangles()[triangle as usize];
            vertices.map(|vertex| (vertex, batch.end(vertex, ranks[vertex as usize])))
        };
        pass.row_hits
            .accumulate(batch, self.tile, facing, corners, deltas);
    }

    /// Adds the batch's texels to the moments of the tile.
    #[inline(always)]
    fn sum<S: Simd>(&mut self, simd: S, layout: Layout) {
        let pass = self.pass;
        let b = pass.first_row + self.row as u32;
        let lookups: Vec<_> = (0..pass.frame.blocks())
            .map(|block| block_texels(pass.job.texels, pass.frame, b, block))
            .map(|texels| simd.mask_lookup(&texels))
            .collect();
        self.workspace.moments.reserve_tile(pass.frame, self.tile);
        // Masks beyond the row's end stay zero: nothing writes them.
        let n_masks = (layout.n_u as usize).next_multiple_of(LANES);
        self.workspace.masks.clear();
        self.workspace.masks.resize(n_masks, 0);
        for group in 0..layout.groups(self.tile) {
            let Workspace {
                deltas, counters, ..
            } = &mut *self.workspace;
            let first = group << layout.shift;
            let strips = first..(first + (1 << layout.shift)).min(layout.strips(self.tile));
            match deltas.accumulate(group, counters) {
                GroupCounters::Empty => {}
                // Running sums are tried in bytes first; a strip that saturates is summed again in
                // 32 bits.
                GroupCounters::Narrow => {
                    for (idx, strip) in strips.enumerate() {
                        let Workspace {
                            counters,
                            masks: strip_masks,
                            ..
                        } = &mut *self.workspace;
                        let counters = &mut counters[idx * layout.strip()..][..layout.strip()];
                        if !is_zero(counters) {
                            if simd.narrow_masks(counters, strip_masks) {
                                masks(counters, strip_masks);
                            }
                            counters.fill(0);
                            self.accumulate(simd, strip, &lookups);
                        }
                    }
                }
                GroupCounters::Wide(counters) => {
                    for (strip, counters) in strips.zip(counters.chunks_exact(layout.strip())) {
                        masks(counters, &mut self.workspace.masks);
                        self.accumulate(simd, strip, &lookups);
                    }
                }
            }
        }
    }

    /// Adds the texels of a strip's masks to the moments of its cells.
    #[inline(always)]
    fn accumulate<S: Simd>(&mut self, simd: S, strip: usize, lookups: &[S::Lookup]) {
        let (row, block) = (strip / lookups.len(), strip % lookups.len());
        let Workspace { masks, moments, .. } = &mut *self.workspace;
        simd.accumulate(&lookups[block], masks, moments.row(row));
        let b = self.pass.first_row + self.row as u32;
        self.pass.record_bits(self.tile, (row, b, block), masks);
    }
}
