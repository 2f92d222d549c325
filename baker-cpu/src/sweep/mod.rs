//! The direction sweep: the six faces of all cells at once, one direction at a time.
//!
//! # Theory
//!
//! Casting rays asks for each cell: which of my directions meet the mesh? But all cells share
//! their directions, so one may as well ask for each direction d: which cells see the mesh?
//! Rays of one direction are parallel, and what lies ahead along parallel rays only changes
//! where one of them passes a *silhouette*. Counting silhouettes along a row of cells gives
//! the answer for all its cells: exactly, without a ray or a hierarchy, at a cost that grows
//! with the length of silhouettes and not with the number of cells times directions.
//!
//! Choose an axis w; d = (a, b, 1) in the frame (u, v, w). Rows of cells run along u. The rays
//! of one row, for every a, lie in one plane, which cuts the mesh in a curve:
//!
//! ```text
//!   height                 d          the curve's points where it turns back as seen
//!    above  ,--A---.      /           along d are its silhouettes, A and B. Seen along d
//!     the   |       '.   /            each falls on a place in the row, at c(A), c(B): from
//!     row    \        B /             the first cell right of c(A) on there are two layers
//!             '--.___/ /              more ahead, from the first right of c(B) on two fewer.
//!   ··o····o····o·+··o···+o····o···   cells of the row; + is c(A), c(B)
//!     0    0    0 ↑  2   ↑0    0      running sum of +2 and −2: layers ahead of each cell
//! ```
//!
//! A cell is occluded in direction d if the sum is not 0. Silhouettes below the row count the
//! same way for −d: two sums a row. And where the row itself enters the mesh, a layer changes
//! from one side of the row to the other: the *piercings*.
//!
//! 1. **Batches.** An axis w and a slope b: the `size` directions (a, b, 1) and their opposites.
//!    All share the rows' planes. 3 × `size` batches are the work of threads.
//! 2. **[Levels](levels).** Row (j, k) lies in the plane V − b·W = j − k·b. Each vertex gets a
//!    rank among these planes; an edge crosses exactly those between the ranks of its ends.
//! 3. **[Silhouettes](silhouettes).** A triangle faces d or not, sign(n·d). Each of its edges,
//!    by itself, begins or ends a layer there. Two triangles at an edge cancel unless the one
//!    faces d and the other does not. Nothing here asks for a closed mesh or for consistent
//!    winding: the sum over half-edges is right for any triangles, they only cancel less.
//! 4. **[Crossings](crossings).** An edge crosses a level at one point, shared by all
//!    directions of the batch; the first cell that it matters to is ⌈u − height·a⌉.
//! 5. **[Piercings](piercings)**, found once an axis in exact integers.
//! 6. **[Summation](summation)** along the row, and into the cells' moments.
//!
//! Why no row ends up with a layer that never closes, a *streak*: a triangle crosses a level
//! with two edges or none, because it has three vertices and each has one rank; the two add
//! opposite steps, because the triangle has one facing; and if they are on different sides of
//! the row, there is a piercing between them. So steps always cancel by the end of the row,
//! whatever is rounded how; rounding moves a step by a cell at the most. The one question with
//! two askers is on which side of the row an edge passes: crossings ask for the edge, piercings
//! for the triangle. Piercings know the answer in exact integers unless the row's line passes
//! so close to an edge that rounding could matter; then they ask the crossings' own expression.
//!
//! Differences to rays remain where a ray passes an edge within float distance: some texels in
//! 50 million. See also the limits of a [`PreparedMesh`].
//!
//! # Practice
//!
//! A [`Sweeper`] owns the buffers and is kept between bakes. Moments are sums of integers
//! ([`FaceSums`]), so that neither threads nor tiles nor instructions change a bit of them.
//! Counters are bytes; one that is too small for its layers is noticed, and its tile is
//! counted again in 32 bits.

mod counters;
mod crossings;
mod frame;
mod instructions;
mod levels;
mod piercings;
mod silhouettes;
mod summation;

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use aogrid_bake_core::fixed_texels;
use aogrid_bake_core::{FaceBits, FaceSums, FixedTexel, Observer, PreparedMesh, Progress, RawGrid};
use aogrid_grid_format::{FACE_SIZES, Method};
use rayon::prelude::*;

use crate::BakeError;
use counters::{Counter, Counters, Layout, Tile};
use crossings::{Batch, End};
use frame::{Frame, LANES};
use instructions::Instructions;
use levels::{Levels, Ranked};
use piercings::Piercings;
use silhouettes::{Facing, Lists};
use summation::{Mask, Shares};

/// Edges that a thread searches for silhouettes at a time.
const EDGES_AT_ONCE: usize = 1 << 15;

/// Bakes faces by the direction sweep, again and again with the same buffers.
pub struct Sweeper {
    instructions: Instructions,
    facings: Vec<[Facing; LANES]>,
    lists: Vec<Lists>,
    positions: Vec<[f32; 3]>,
    workspaces: Mutex<Vec<Workspace>>,
}

/// What a thread needs for itself.
#[derive(Default)]
struct Workspace {
    ranks: Vec<Ranked>,
    counters: Vec<i8>,
    wide_counters: Vec<i32>,
    dirty: Vec<bool>,
    masks: Vec<Mask>,
    /// Of the cells of a tile, row by row.
    sums: Vec<FaceSums>,
}

impl Default for Sweeper {
    fn default() -> Self {
        Self::new()
    }
}

impl Sweeper {
    /// Without buffers yet; with the best instructions that the machine has.
    pub fn new() -> Self {
        Self::with(Instructions::available()[0])
    }

    fn with(instructions: Instructions) -> Self {
        Self {
            instructions,
            facings: Vec::new(),
            lists: Vec::new(),
            positions: Vec::new(),
            workspaces: Mutex::default(),
        }
    }

    /// Bakes six faces of `size` × `size` texels around every cell of the mesh's grid, on all
    /// threads. The same input gives the same bits, for any number of threads.
    ///
    /// # Errors
    ///
    /// A face size out of its range, or cancellation.
    pub fn bake(
        &mut self,
        mesh: &PreparedMesh,
        size: u32,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        self.run(mesh, size, None, observer)
    }

    /// [`Sweeper::bake`], and the faces themselves: `size`² · 6 bits a cell.
    ///
    /// # Errors
    ///
    /// As [`Sweeper::bake`].
    pub fn bake_with_bits(
        &mut self,
        mesh: &PreparedMesh,
        size: u32,
        observer: Observer<'_>,
    ) -> Result<(RawGrid, FaceBits), BakeError> {
        let bits = Mutex::new(FaceBits::new(mesh.spec().cell_count(), size));
        let raw = self.run(mesh, size, Some(&bits), observer)?;
        Ok((raw, bits.into_inner().expect("no thread has panicked")))
    }

    fn run(
        &mut self,
        mesh: &PreparedMesh,
        size: u32,
        bits: Option<&Mutex<FaceBits>>,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        if !FACE_SIZES.contains(&size) {
            return Err(aogrid_bake_core::OptionsError::FaceSize(size).into());
        }
        let in_cells = |p: &[i32; 3]| p.map(|v| mesh.lattice().in_cells(v));
        mesh.vertices()
            .par_iter()
            .with_min_len(4096)
            .map(in_cells)
            .collect_into_vec(&mut self.positions);
        let mut sums = Vec::new();
        sums.resize(mesh.spec().cell_count(), FaceSums::default());
        let work = Work {
            texels: fixed_texels(size),
            size,
            bits,
            sums: Mutex::new(sums),
            done: AtomicUsize::new(0),
            cancelled: AtomicBool::new(false),
            observer,
        };
        for w in 0..3 {
            let frame = Frame::new(mesh, w, size);
            let piercings = Piercings::new(mesh, &frame);
            let tiles = Tile::all(&frame, mesh.vertices().len());
            for first_row in (0..size).step_by(LANES) {
                let n_rows = (size - first_row).min(LANES as u32);
                silhouettes::facings(mesh, &frame, first_row, &mut self.facings);
                self.find_silhouettes(mesh, n_rows as usize);
                let pass = Pass {
                    sweeper: self,
                    mesh,
                    frame: &frame,
                    piercings: &piercings,
                    tiles: &tiles,
                    first_row,
                    n_rows: n_rows as usize,
                    work: &work,
                };
                pass.run()?;
            }
        }
        let sums = work.sums.into_inner().expect("no thread has panicked");
        let directions = Method::Faces { size }.directions();
        Ok(RawGrid {
            spec: *mesh.spec(),
            moments: sums.par_iter().map(|s| s.moments(directions)).collect(),
            counts: sums.par_iter().map(|s| s.count).collect(),
            directions,
        })
    }

    fn find_silhouettes(&mut self, mesh: &PreparedMesh, n_rows: usize) {
        let n_chunks = mesh.edges().len().div_ceil(EDGES_AT_ONCE);
        self.lists.resize_with(n_chunks, Lists::default);
        let facings = &self.facings;
        self.lists
            .par_iter_mut()
            .zip(mesh.edges().par_chunks(EDGES_AT_ONCE))
            .enumerate()
            .for_each(|(chunk, (lists, edges))| {
                lists.iter_mut().for_each(Vec::clear);
                let first = (chunk * EDGES_AT_ONCE) as u32;
                silhouettes::find(edges, first, facings, n_rows, lists);
            });
    }
}

/// What all passes of a bake share.
struct Work<'a> {
    texels: Vec<FixedTexel>,
    size: u32,
    bits: Option<&'a Mutex<FaceBits>>,
    sums: Mutex<Vec<FaceSums>>,
    done: AtomicUsize,
    cancelled: AtomicBool,
    observer: Observer<'a>,
}

/// The batches of one axis and up to [`LANES`] rows of its faces.
struct Pass<'a> {
    sweeper: &'a Sweeper,
    mesh: &'a PreparedMesh,
    frame: &'a Frame,
    piercings: &'a Piercings,
    tiles: &'a [Tile],
    first_row: u32,
    n_rows: usize,
    work: &'a Work<'a>,
}

/// A batch, in one tile.
struct BatchWork<'a> {
    pass: &'a Pass<'a>,
    tile: &'a Tile,
    row: usize,
    workspace: &'a mut Workspace,
}

impl instructions::Work for BatchWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.pass.run_batch(self.tile, self.row, self.workspace);
    }
}

impl Pass<'_> {
    fn run(&self) -> Result<(), BakeError> {
        let next = AtomicUsize::new(0);
        (0..rayon::current_num_threads())
            .into_par_iter()
            .with_max_len(1)
            .for_each(|_| self.run_jobs(&next));
        match self.work.cancelled.load(Ordering::Relaxed) {
            true => Err(BakeError::Cancelled),
            false => Ok(()),
        }
    }

    /// Takes batches until there are none: tile by tile, so that a thread rarely has to leave
    /// its tile, which is when it hands over its sums.
    fn run_jobs(&self, next: &AtomicUsize) {
        let mut workspace = self.workspaces().pop().unwrap_or_default();
        let mut current = None;
        loop {
            let job = next.fetch_add(1, Ordering::Relaxed);
            let (tile_idx, row) = (job / self.n_rows, job % self.n_rows);
            let tile = self.tiles.get(tile_idx);
            if let Some(left) = current.filter(|_| current != tile) {
                self.hand_over(left, &mut workspace.sums);
            }
            current = tile;
            let Some(tile) = tile else {
                break;
            };
            if !self.work.cancelled.load(Ordering::Relaxed) {
                self.sweeper.instructions.run(BatchWork {
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

    fn workspaces(&self) -> std::sync::MutexGuard<'_, Vec<Workspace>> {
        let workspaces = self.sweeper.workspaces.lock();
        workspaces.expect("no thread has panicked")
    }

    fn observe(&self) {
        let total = self.mesh.spec().cell_count();
        let jobs = 3 * self.work.size as usize * self.tiles.len();
        let done = self.work.done.fetch_add(1, Ordering::Relaxed) + 1;
        // Axes may differ in their number of tiles.
        let done = (total * done / jobs).min(total);
        if (self.work.observer)(Progress { done, total }).is_break() {
            self.work.cancelled.store(true, Ordering::Relaxed);
        }
    }

    #[inline(always)]
    fn run_batch(&self, tile: &Tile, row: usize, workspace: &mut Workspace) {
        let layout = Layout::new(self.frame);
        let Workspace {
            ranks,
            counters,
            wide_counters,
            dirty,
            masks,
            sums,
        } = workspace;
        let levels = Levels::new(self.frame, tile, self.first_row + row as u32);
        let Frame { v, w, .. } = *self.frame;
        ranks.resize(self.sweeper.positions.len(), Ranked::default());
        for (ranked, position) in ranks.iter_mut().zip(&self.sweeper.positions) {
            *ranked = levels.rank(position[v], position[w]);
        }
        counters.resize((tile.rows() * layout.row).max(counters.len()), 0);
        dirty.resize(tile.rows().max(dirty.len()), false);
        sums.resize(
            (tile.rows() * layout.n_u).max(sums.len()),
            FaceSums::default(),
        );
        masks.resize(layout.n_u, 0);
        let mut narrow = Counters {
            layout,
            tile,
            values: counters,
            dirty,
            wrapped: false,
        };
        self.count(row, &levels, ranks, &mut narrow);
        if !narrow.wrapped {
            return self.sum(row, &mut narrow, masks, sums);
        }
        narrow.values.fill(0);
        let dirty = narrow.dirty;
        wide_counters.resize((tile.rows() * layout.row).max(wide_counters.len()), 0);
        let mut wide = Counters {
            layout,
            tile,
            values: wide_counters,
            dirty,
            wrapped: false,
        };
        self.count(row, &levels, ranks, &mut wide);
        self.sum(row, &mut wide, masks, sums);
    }

    /// All steps of a batch.
    #[inline(always)]
    fn count<C: Counter>(
        &self,
        row: usize,
        levels: &Levels,
        ranks: &[Ranked],
        counters: &mut Counters<'_, C>,
    ) {
        let slopes: Vec<_> = (0..self.frame.blocks())
            .map(|block| self.frame.slopes(block))
            .collect();
        let batch = Batch {
            frame: self.frame,
            levels,
            slopes: &slopes,
        };
        let end = |vertex: u32| self.end(vertex, ranks);
        for lists in &self.sweeper.lists {
            for silhouette in &lists[row] {
                let [a, b] = self.mesh.edges()[silhouette.edge as usize].vertices;
                if ranks[a as usize].rank != ranks[b as usize].rank {
                    let ends = [self.end(a, ranks), self.end(b, ranks)];
                    batch.count(ends, &silhouette.sides, counters);
                }
            }
        }
        for edge in self.mesh.lone_edges() {
            let [a, b] = edge.vertices;
            if ranks[a as usize].rank != ranks[b as usize].rank {
                let ends = [self.end(a, ranks), self.end(b, ranks)];
                let side = self.sweeper.facings[edge.side.triangle()][row].along(edge.side);
                batch.count(ends, &[side], counters);
            }
        }
        let facing = |triangle: u32| self.sweeper.facings[triangle as usize][row];
        let corners = |triangle: u32| {
            self.mesh.triangles()[triangle as usize].map(|vertex| (vertex, end(vertex)))
        };
        self.piercings.count(&batch, facing, corners, counters);
    }

    #[inline(always)]
    fn end(&self, vertex: u32, ranks: &[Ranked]) -> End {
        let position = &self.sweeper.positions[vertex as usize];
        End {
            ranked: ranks[vertex as usize],
            u: position[self.frame.u],
            w: position[self.frame.w],
        }
    }

    /// Adds a batch's texels to the sums of the tile, and leaves the counters zero.
    #[inline(always)]
    fn sum<C: Counter>(
        &self,
        row: usize,
        counters: &mut Counters<'_, C>,
        masks: &mut [Mask],
        sums: &mut [FaceSums],
    ) {
        let layout = counters.layout;
        let b = self.first_row + row as u32;
        let shares: Vec<_> = (0..self.frame.blocks())
            .map(|block| Shares::new(&self.work.texels, self.frame, b, block))
            .collect();
        for idx in 0..counters.tile.rows() {
            if !std::mem::take(&mut counters.dirty[idx]) {
                continue;
            }
            let values = &mut counters.values[idx * layout.row..][..layout.row];
            let sums = &mut sums[idx * layout.n_u..][..layout.n_u];
            for (block, shares) in shares.iter().enumerate() {
                let steps = &values[block * layout.block..][..layout.block];
                summation::masks(steps, masks);
                shares.add(masks, sums);
                if let Some(bits) = self.work.bits {
                    self.set_bits(counters.tile, idx, b, block, masks, bits);
                }
            }
            values.fill(C::default());
        }
    }

    fn set_bits(
        &self,
        tile: &Tile,
        row: usize,
        b: u32,
        block: usize,
        masks: &[Mask],
        bits: &Mutex<FaceBits>,
    ) {
        let mut bits = bits.lock().expect("no thread has panicked");
        for (i, &mask) in masks.iter().enumerate() {
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
        self.mesh.spec().cell_idx(cell)
    }

    /// Adds the sums of a tile to the grid's, and leaves them zero.
    fn hand_over(&self, tile: &Tile, sums: &mut [FaceSums]) {
        let n_u = self.frame.n[0] as usize;
        let mut all = self.work.sums.lock().expect("no thread has panicked");
        for row in 0..tile.rows() {
            for (i, sums) in sums[row * n_u..][..n_u].iter_mut().enumerate() {
                let share = std::mem::take(sums);
                if share.count > 0 {
                    summation::join(&mut all[self.cell_idx(tile, row, i)], &share);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use aogrid_bake_core::samples::Sample;
    use aogrid_bake_core::{BakeOptions, Placement, UNOBSERVED};

    use super::*;

    #[test]
    fn every_set_of_instructions_gives_the_same_bits() {
        let sets = Instructions::available();
        for (sample, resolution, size) in [
            (Sample::SpaceShip, [16, 12, 33], 16),
            (Sample::Robot, [33, 8, 9], 21),
        ] {
            let mesh = sample.mesh(Some(3000)).unwrap();
            let placement = Placement {
                resolution,
                ..Placement::default()
            };
            let spec = placement.place(&mesh.bounds()).unwrap();
            let mesh = PreparedMesh::new(&mesh, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
            let bake = |set| Sweeper::with(set).bake_with_bits(&mesh, size, UNOBSERVED);
            let portable = bake(sets[sets.len() - 1]).unwrap();
            assert!(portable.0.counts.iter().any(|n| *n > 0));
            for set in &sets {
                assert!(bake(*set).unwrap() == portable, "{set:?}");
            }
        }
    }
}
