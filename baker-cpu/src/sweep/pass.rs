//! A pass: the batches of one axis and up to sixteen rows of its faces, shared out to threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};

use aogrid_bake_core::{
    FaceBits, FaceSums, FixedTexel, Observer, PreparedMesh, Progress, fixed_texels,
};
use rayon::prelude::*;

use super::Vertices;
use super::counters::{Layout, MOST_PLACES, Tile};
use super::crossings::{AT_ONCE, Batch, Edges, Row};
use super::frame::{Frame, LANES};
use super::instructions::{Instructions, Vectors, Work};
use super::levels::Levels;
use super::piercings::Piercings;
use super::silhouettes::{Facing, Facings, Lists, Sides};
use super::steps::{Bytes, Steps, Taken};
use super::summation::{self, Mask, Sums};
use crate::BakeError;

/// What all passes of a bake share.
pub(super) struct Job<'a> {
    pub mesh: &'a PreparedMesh,
    /// Texels along a face's side.
    pub size: u32,
    texels: Vec<FixedTexel>,
    bits: Option<&'a Mutex<FaceBits>>,
    sums: Mutex<Vec<FaceSums>>,
    done: AtomicUsize,
    cancelled: AtomicBool,
    observer: Observer<'a>,
}

impl<'a> Job<'a> {
    pub(super) fn new(
        mesh: &'a PreparedMesh,
        size: u32,
        bits: Option<&'a Mutex<FaceBits>>,
        observer: Observer<'a>,
    ) -> Self {
        Self {
            mesh,
            size,
            texels: fixed_texels(size),
            bits,
            sums: Mutex::new(vec![FaceSums::default(); mesh.spec().cell_count()]),
            done: AtomicUsize::new(0),
            cancelled: AtomicBool::new(false),
            observer,
        }
    }

    /// The sums of all cells.
    pub(super) fn into_sums(self) -> Vec<FaceSums> {
        self.sums.into_inner().expect("no thread has panicked")
    }
}

/// See the [module](self).
pub(super) struct Pass<'a> {
    pub job: &'a Job<'a>,
    pub instructions: Instructions,
    pub vertices: &'a Vertices,
    pub facings: &'a [Facings],
    pub lists: &'a [Lists],
    pub workspaces: &'a Mutex<Vec<Workspace>>,
    pub frame: &'a Frame,
    pub piercings: &'a Piercings,
    pub tiles: &'a [Tile],
    pub first_row: u32,
    pub n_rows: usize,
}

/// What a thread needs for itself.
pub(super) struct Workspace {
    ranks: Vec<i32>,
    edges: Edges,
    steps: Steps,
    /// All zero between groups.
    counters: Box<Bytes>,
    masks: Vec<Mask>,
    /// Of the cells of a tile.
    sums: Sums,
}

impl Default for Workspace {
    fn default() -> Self {
        let counters = vec![0; MOST_PLACES].into_boxed_slice();
        Self {
            ranks: Vec::new(),
            edges: Edges::default(),
            steps: Steps::default(),
            counters: counters.try_into().expect("it has this length"),
            masks: Vec::new(),
            sums: Sums::default(),
        }
    }
}

impl Pass<'_> {
    pub(super) fn run(&self) -> Result<(), BakeError> {
        let next = AtomicUsize::new(0);
        (0..rayon::current_num_threads())
            .into_par_iter()
            .with_max_len(1)
            .for_each(|_| self.run_batches(&next));
        match self.job.cancelled.load(Ordering::Relaxed) {
            true => Err(BakeError::Cancelled),
            false => Ok(()),
        }
    }

    /// Takes batches until there are none: tile by tile, so that a thread rarely has to leave
    /// its tile, which is when it hands over its sums.
    fn run_batches(&self, next: &AtomicUsize) {
        let mut workspace = self.workspaces().pop().unwrap_or_default();
        let mut current = None;
        loop {
            let batch = next.fetch_add(1, Ordering::Relaxed);
            let (tile_idx, row) = (batch / self.n_rows, batch % self.n_rows);
            let tile = self.tiles.get(tile_idx);
            if let Some(left) = current.filter(|_| current != tile) {
                self.hand_over(left, &mut workspace.sums);
            }
            current = tile;
            let Some(tile) = tile else {
                break;
            };
            if !self.job.cancelled.load(Ordering::Relaxed) {
                self.instructions.run(BatchWork {
                    pass: self,
                    tile,
                    row,
                    workspace: &mut workspace,
                });
                self.observe();
            }
        }
        self.workspaces().push(workspace);
    }

    fn workspaces(&self) -> MutexGuard<'_, Vec<Workspace>> {
        self.workspaces.lock().expect("no thread has panicked")
    }

    fn observe(&self) {
        let job = self.job;
        let total = job.mesh.spec().cell_count();
        let batches = 3 * job.size as usize * self.tiles.len();
        let done = job.done.fetch_add(1, Ordering::Relaxed) + 1;
        // Axes may differ in their number of tiles.
        let done = (total * done / batches).min(total);
        if (job.observer)(Progress { done, total }).is_break() {
            job.cancelled.store(true, Ordering::Relaxed);
        }
    }

    /// Adds the sums of a tile to the grid's, in the grid's order, and leaves them zero.
    fn hand_over(&self, tile: &Tile, sums: &mut Sums) {
        let Frame { u, v, w, n, .. } = *self.frame;
        let mut cells = [const { 0..0 }; 3];
        cells[u] = 0..n[0];
        cells[v] = tile.j.clone();
        cells[w] = tile.k.clone();
        let [x, y, z] = cells;
        let mut all = self.job.sums.lock().expect("no thread has panicked");
        for z in z {
            for y in y.clone() {
                let first = self.job.mesh.spec().cell_idx([x.start, y, z]);
                for (x, all) in x.clone().zip(&mut all[first..]) {
                    let cell = [x, y, z];
                    let row = (cell[w] - tile.k.start) as usize * tile.j.len();
                    let row = row + (cell[v] - tile.j.start) as usize;
                    sums.take(row, cell[u] as usize, all);
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

/// A batch, in one tile.
struct BatchWork<'a> {
    pass: &'a Pass<'a>,
    tile: &'a Tile,
    /// From the pass's first.
    row: usize,
    workspace: &'a mut Workspace,
}

impl Work for BatchWork<'_> {
    #[inline(always)]
    fn run<V: Vectors>(mut self, vectors: V) {
        let pass = self.pass;
        let b = pass.first_row + self.row as u32;
        let levels = Levels::new(pass.frame, self.tile, b);
        let slopes: Vec<_> = (0..pass.frame.blocks())
            .map(|block| pass.frame.slopes(block))
            .collect();
        let batch = Batch {
            frame: pass.frame,
            positions: &pass.vertices.positions,
            levels: &levels,
            slopes: &slopes,
        };
        let layout = Layout::new(pass.frame);
        self.workspace.steps.start(layout, self.tile);
        self.rank(vectors, &levels);
        self.count_pairs(vectors, &batch);
        self.count_lone(vectors, &batch);
        self.count_piercings(&batch);
        self.sum(vectors, layout);
    }
}

impl BatchWork<'_> {
    #[inline(always)]
    fn rank<V: Vectors>(&mut self, vectors: V, levels: &Levels) {
        let Frame { v, w, .. } = *self.pass.frame;
        let by_axis = &self.pass.vertices.by_axis;
        let ranks = &mut self.workspace.ranks;
        ranks.resize(by_axis[v].len(), 0);
        vectors.ranks(levels, &by_axis[v], &by_axis[w], ranks);
    }

    /// Silhouettes of two triangles that cross a level: two layers more or fewer.
    #[inline(always)]
    fn count_pairs<V: Vectors>(&mut self, vectors: V, batch: &Batch<'_>) {
        for lists in self.pass.lists {
            let list = &lists[self.row];
            let mut first = 0;
            while first < list.sides.len() {
                self.make_room(vectors, batch, 2);
                let Workspace { edges, ranks, .. } = &mut *self.workspace;
                let (row, next) = Row::new(list, first, ranks);
                vectors.collect(&row, edges);
                first = next;
            }
        }
        self.count_collected(vectors, batch, 2);
    }

    /// Edges of one triangle that cross a level: always a layer more or fewer.
    #[inline(always)]
    fn count_lone<V: Vectors>(&mut self, vectors: V, batch: &Batch<'_>) {
        let (facings, row) = (self.pass.facings, self.row);
        for some in self.pass.job.mesh.lone_edges().chunks(AT_ONCE) {
            self.make_room(vectors, batch, 1);
            let Workspace { edges, ranks, .. } = &mut *self.workspace;
            for edge in some {
                let side = facings[edge.side.triangle()][row].along(edge.side);
                edges.push(edge.vertices, ranks, Sides::new(side, side));
            }
        }
        self.count_collected(vectors, batch, 1);
    }

    #[inline(always)]
    fn make_room<V: Vectors>(&mut self, vectors: V, batch: &Batch<'_>, unit: i8) {
        if !self.workspace.edges.has_room(AT_ONCE) {
            self.count_collected(vectors, batch, unit);
        }
    }

    #[inline(always)]
    fn count_collected<V: Vectors>(&mut self, vectors: V, batch: &Batch<'_>, unit: i8) {
        let Workspace { edges, steps, .. } = &mut *self.workspace;
        vectors.count(batch, edges, unit, steps);
        edges.n = 0;
    }

    fn count_piercings(&mut self, batch: &Batch<'_>) {
        let pass = self.pass;
        let Workspace { ranks, steps, .. } = &mut *self.workspace;
        let facing = |triangle: u32| -> Facing { pass.facings[triangle as usize][self.row] };
        let corners = |triangle: u32| {
            let vertices = pass.job.mesh.triangles()[triangle as usize];
            vertices.map(|vertex| (vertex, batch.end(vertex, ranks[vertex as usize])))
        };
        pass.piercings
            .count(batch, self.tile, facing, corners, steps);
    }

    /// Adds the batch's texels to the sums of the tile.
    #[inline(always)]
    fn sum<V: Vectors>(&mut self, vectors: V, layout: Layout) {
        let pass = self.pass;
        let b = pass.first_row + self.row as u32;
        let shares: Vec<_> = (0..pass.frame.blocks())
            .map(|block| summation::texels(&pass.job.texels, pass.frame, b, block))
            .map(|texels| vectors.shares(&texels))
            .collect();
        let stride = (layout.n_u as usize).next_multiple_of(LANES);
        self.workspace.sums.start(self.tile.rows(), stride);
        // Nobody writes those beyond the row's end.
        self.workspace.masks.clear();
        self.workspace.masks.resize(stride, 0);
        for group in 0..layout.groups(self.tile) {
            let Workspace {
                steps, counters, ..
            } = &mut *self.workspace;
            let first = group << layout.shift;
            let strips = first..(first + (1 << layout.shift)).min(layout.strips(self.tile));
            match steps.take(group, counters) {
                Taken::Nothing => {}
                Taken::Narrow => {
                    for (idx, strip) in strips.enumerate() {
                        let Workspace {
                            counters, masks, ..
                        } = &mut *self.workspace;
                        let counters = &mut counters[idx * layout.strip()..][..layout.strip()];
                        if !summation::is_zero(counters) {
                            if vectors.narrow_masks(counters, masks) {
                                summation::masks(counters, masks);
                            }
                            counters.fill(0);
                            self.add(vectors, strip, &shares);
                        }
                    }
                }
                Taken::Wide(counters) => {
                    for (strip, counters) in strips.zip(counters.chunks_exact(layout.strip())) {
                        summation::masks(counters, &mut self.workspace.masks);
                        self.add(vectors, strip, &shares);
                    }
                }
            }
        }
    }

    /// Adds to the cells of a strip what their masks say.
    #[inline(always)]
    fn add<V: Vectors>(&mut self, vectors: V, strip: usize, shares: &[V::Shares]) {
        let (row, block) = (strip / shares.len(), strip % shares.len());
        let Workspace { masks, sums, .. } = &mut *self.workspace;
        vectors.add(&shares[block], masks, sums.row(row));
        if let Some(bits) = self.pass.job.bits {
            let b = self.pass.first_row + self.row as u32;
            self.pass.set_bits(self.tile, (row, b, block), masks, bits);
        }
    }
}

impl Pass<'_> {
    fn set_bits(
        &self,
        tile: &Tile,
        (row, b, block): (usize, u32, usize),
        masks: &[Mask],
        bits: &Mutex<FaceBits>,
    ) {
        let mut bits = bits.lock().expect("no thread has panicked");
        for (i, &mask) in masks.iter().enumerate().take(self.frame.n[0] as usize) {
            let cell = self.cell_idx(tile, row, i);
            for bit in (0..Mask::BITS as usize).filter(|bit| mask >> bit & 1 != 0) {
                if let Some(texel) = summation::texel_of(self.frame, b, block, bit) {
                    bits.set(cell, texel);
                }
            }
        }
    }
}
