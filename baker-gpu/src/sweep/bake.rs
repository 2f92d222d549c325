//! One bake by the direction sweep: dispatches brick by brick and pass by pass, and reads the
//! results back.

use std::ops::Range;

use aogrid_bake_core::sweep::texel_idx;
use aogrid_bake_core::{FaceBits, FaceSums, FixedTexel, RawGrid, fixed_texels};
use aogrid_grid_format::Sampling;
use wgpu::Buffer;

use super::gpu_data::SUBSET_SUMS;
use super::kernels::Kernels;
use super::pass::{PassBindings, PassInputs};
use super::plan::{Brick, MemoryBudget, Pass, counter_bytes};
use super::row_hits::RowHitSearch;
use super::{KernelCache, Request, UploadedMesh};
use crate::BakeError;
use crate::store::BufferPool;
use crate::work::Submitter;

/// The numbers per cell that are read back: the count, a, and the three components of m.
const NUMBERS_PER_CELL: u64 = 5;

/// The state of a running bake.
pub(super) struct Bake<'a> {
    kernels: &'a KernelCache,
    pool: BufferPool,
    pub submitter: Submitter<'a>,
    pub mesh: &'a UploadedMesh,
    pub request: Request,
    texels: Vec<FixedTexel>,
    sums: Vec<FaceSums>,
    bits: FaceBits,
}

/// The masks of a pass as read back.
type PassMasks = (Pass, Vec<u32>);

/// The sums of a brick, and the masks of its passes if they were requested.
type BrickResult = (Vec<i32>, Vec<PassMasks>);

/// The buffers of a brick.
pub(super) struct Buffers {
    pub counters: Buffer,
    pub overflowed: Buffer,
    pub facing_intervals: Buffer,
    pub ranks: Buffer,
    pub masks: Buffer,
    pub sums: Buffer,
}

impl<'a> Bake<'a> {
    pub(super) fn new(
        kernels: &'a KernelCache,
        pool: BufferPool,
        submitter: Submitter<'a>,
        mesh: &'a UploadedMesh,
        request: Request,
    ) -> Self {
        let cells = mesh.prepared.spec().cell_count();
        Self {
            kernels,
            pool,
            submitter,
            mesh,
            request,
            texels: fixed_texels(request.size),
            sums: vec![FaceSums::default(); cells],
            bits: FaceBits::new(if request.bits { cells } else { 0 }, request.size),
        }
    }

    pub(super) fn run(&mut self) -> Result<(), BakeError> {
        let spec = *self.mesh.prepared.spec();
        let mut done = 0;
        for brick in Brick::all(&spec) {
            let cells = brick.cell_count() as usize;
            let narrow = self.bake_brick(&brick, false, done)?;
            let (sums, masks) = match narrow {
                Some(result) => result,
                None => {
                    let wide = self.bake_brick(&brick, true, done)?;
                    wide.expect("words hold a delta for each of 2³¹ triangles")
                }
            };
            done += cells;
            self.store_sums(&brick, &sums);
            for (pass, masks) in masks {
                self.store_bits(&brick, &pass, &masks);
            }
        }
        self.submitter.set_done(done);
        self.submitter.flush()
    }

    /// Returns the results, and the buffers for the next bake.
    pub(super) fn finish(self) -> ((RawGrid, FaceBits), BufferPool) {
        let directions = Sampling::CubeFaces {
            size: self.request.size,
        }
        .directions();
        let raw = RawGrid {
            spec: *self.mesh.prepared.spec(),
            moments: self.sums.iter().map(|s| s.moments(directions)).collect(),
            counts: self.sums.iter().map(|s| s.count).collect(),
            directions,
            layers: None,
        };
        ((raw, self.bits), self.pool)
    }

    /// Bakes a brick. Returns `None` if a counter overflowed, which only narrow ones do.
    fn bake_brick(
        &mut self,
        brick: &Brick,
        wide: bool,
        done: usize,
    ) -> Result<Option<BrickResult>, BakeError> {
        let mesh = &self.mesh.prepared;
        let budget = MemoryBudget {
            binding: self
                .submitter
                .context()
                .device
                .limits()
                .max_storage_buffer_binding_size,
            counter: if wide { 4 } else { 1 },
            n_vertices: mesh.vertices().len() as u64,
            n_triangles: mesh.triangles().len() as u64,
        };
        let passes = Pass::all(brick, self.request.size, &budget);
        let buffers = self.brick_buffers(brick, &passes, &budget);
        self.submitter
            .encoder()
            .clear_buffer(&buffers.sums, 0, None);
        self.submitter
            .encoder()
            .clear_buffer(&buffers.overflowed, 0, None);

        let search = RowHitSearch::new(mesh, brick, self.request.size);
        let batches = search.batches();
        // Mostly all candidates fit in one batch, which is then found once for all axes.
        let all_candidates = match &batches[..] {
            [one] => Some(search.find(one.clone())),
            _ => None,
        };
        let mut masks = Vec::new();
        for (idx, pass) in passes.iter().enumerate() {
            let inputs = PassInputs {
                pass,
                brick,
                buffers: &buffers,
                wide,
            };
            self.run_pass(&inputs, |this, bindings| match &all_candidates {
                Some(all) => bindings.dispatch_row_hits(this, &all[pass.w]),
                None => this.row_hits_in_batches(bindings, &search, &batches, pass.w),
            })?;
            let cells = brick.cell_count() as usize;
            self.submitter
                .set_done(done + cells * (idx + 1) / (passes.len() + 1));
            if self.request.bits {
                let bytes = u64::from(brick.cell_count() * pass.n_batches()) * 4;
                let read = self.submitter.read(&[(&buffers.masks, bytes)])?;
                masks.push((*pass, bytemuck::pod_collect_to_vec(&read[0])));
            }
        }
        let bytes = u64::from(brick.cell_count()) * NUMBERS_PER_CELL * 4;
        let read = self
            .submitter
            .read(&[(&buffers.sums, bytes), (&buffers.overflowed, 4)])?;
        let overflowed = read[1].iter().any(|byte| *byte != 0);
        Ok((!overflowed).then(|| (bytemuck::pod_collect_to_vec(&read[0]), masks)))
    }

    /// Returns buffers large enough for each of the passes over a brick.
    fn brick_buffers(&mut self, brick: &Brick, passes: &[Pass], budget: &MemoryBudget) -> Buffers {
        let device = &self.submitter.context().device;
        let batches = passes.iter().map(Pass::n_batches).max().unwrap_or(1);
        let rows = passes.iter().map(|p| p.n_rows).max().unwrap_or(1);
        let cells = u64::from(brick.cell_count());
        let mut storage = |name, bytes: u64| self.pool.storage(device, name, bytes);
        Buffers {
            counters: storage("counters", counter_bytes(brick, batches, budget.counter)),
            overflowed: storage("overflowed", 4),
            facing_intervals: storage(
                "facing intervals",
                budget.n_triangles * u64::from(rows.div_ceil(4)) * 4,
            ),
            ranks: storage("ranks", budget.n_vertices * u64::from(rows) * 4),
            masks: storage("masks", cells * u64::from(batches) * 4),
            sums: storage("sums", cells * NUMBERS_PER_CELL * 4),
        }
    }

    /// Runs the kernels of a pass; `row_hits` dispatches those of its row hits.
    fn run_pass(
        &mut self,
        inputs: &PassInputs<'_>,
        row_hits: impl FnOnce(&mut Self, &PassBindings<'_>) -> Result<(), BakeError>,
    ) -> Result<(), BakeError> {
        let (wide, directions) = (inputs.wide, self.request.directions);
        let kernels = &self.kernels[usize::from(wide)][usize::from(directions)];
        let device = &self.submitter.context().device;
        let kernels = kernels.get_or_init(|| Kernels::new(device, wide, directions));
        let bindings = PassBindings::new(self, inputs, kernels);
        bindings.dispatch_crossings(self)?;
        row_hits(self, &bindings)?;
        bindings.dispatch_summation(self)
    }

    fn row_hits_in_batches(
        &mut self,
        bindings: &PassBindings<'_>,
        search: &RowHitSearch<'_>,
        batches: &[Range<usize>],
        w: usize,
    ) -> Result<(), BakeError> {
        for batch in batches {
            bindings.dispatch_row_hits(self, &search.find(batch.clone())[w])?;
            // Flush, so that the device holds only one batch at a time.
            self.submitter.flush()?;
        }
        Ok(())
    }

    fn store_sums(&mut self, brick: &Brick, sums: &[i32]) {
        let n = brick.cell_count() as usize;
        for local in 0..n {
            let cell = self
                .mesh
                .prepared
                .spec()
                .cell_idx(cell_of(brick, local as u32));
            let number = |plane: usize| sums[plane * n + local];
            self.sums[cell] = FaceSums {
                count: number(0).cast_unsigned(),
                a: number(1),
                m: [number(2), number(3), number(4)],
            };
        }
    }

    fn store_bits(&mut self, brick: &Brick, pass: &Pass, masks: &[u32]) {
        let spec = self.mesh.prepared.spec();
        let [u, v, w] = [(pass.w + 1) % 3, (pass.w + 2) % 3, pass.w];
        let n = brick.cells;
        // Masks are in the order batch, u, w, v (v fastest).
        for (idx, &mask) in masks.iter().enumerate().filter(|(_, mask)| **mask != 0) {
            let (batch, idx) = (
                idx as u32 / brick.cell_count(),
                idx as u32 % brick.cell_count(),
            );
            let mut cell = brick.first;
            cell[u] += idx / (n[v] * n[w]);
            cell[v] += idx % n[v];
            cell[w] += idx / n[v] % n[w];
            let cell = spec.cell_idx(cell);
            for bit in (0..u32::BITS).filter(|bit| mask >> bit & 1 != 0) {
                let texel = texel_of(self.request.size, pass, batch, bit);
                self.bits
                    .set(cell, texel.expect("lanes beyond the face are never set"));
            }
        }
    }

    /// Returns, for each group of four bits of each batch's masks, the moments (m, a) of each of
    /// the 16 subsets of these texels.
    pub(super) fn subset_sums(&self, pass: &Pass) -> Vec<[i32; 4]> {
        let texel = |batch, bit| texel_of(self.request.size, pass, batch, bit);
        let moment = |texel: usize| {
            let FixedTexel { a, m: [x, y, z] } = self.texels[texel];
            [x, y, z, a]
        };
        let bit_moment = |batch, bit| texel(batch, bit).map_or([0; 4], moment);
        let mut sums = Vec::with_capacity((pass.n_batches() * SUBSET_SUMS) as usize);
        for batch in 0..pass.n_batches() {
            for first in (0..u32::BITS).step_by(4) {
                let moments = [0, 1, 2, 3].map(|bit| bit_moment(batch, first + bit));
                sums.extend((0..16).map(|subset| subset_sum(&moments, subset)));
            }
        }
        sums
    }
}

/// Returns the sum of the moments whose bits are set in `subset`.
fn subset_sum(moments: &[[i32; 4]; 4], subset: u32) -> [i32; 4] {
    let is_in = |(bit, moment): (u32, &[i32; 4])| (subset >> bit & 1 != 0).then_some(*moment);
    let add = |a: [i32; 4], b: [i32; 4]| std::array::from_fn(|x| a[x] + b[x]);
    (0..).zip(moments).filter_map(is_in).fold([0; 4], add)
}

/// Returns the grid coordinates of a brick's cell, given its index in the brick (x fastest).
fn cell_of(brick: &Brick, local: u32) -> [u32; 3] {
    let [n_x, n_y, _] = brick.cells;
    let [x, y, z] = brick.first;
    [
        x + local % n_x,
        y + local / n_x % n_y,
        z + local / (n_x * n_y),
    ]
}

/// Returns the index of the texel of a bit of a batch's mask, or `None` for a lane beyond the side
/// of the face.
fn texel_of(size: u32, pass: &Pass, batch: u32, bit: u32) -> Option<usize> {
    let b = pass.first_row + batch / pass.n_blocks;
    let block = pass.first_block + batch % pass.n_blocks;
    texel_idx(size, pass.w, b, block as usize, bit as usize)
}
