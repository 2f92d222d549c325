//! One bake by the direction sweep: dispatches brick by brick and pass by pass, and reads the
//! results back.

use std::ops::Range;

use aogrid_bake_core::{FaceBits, FaceSums, FixedTexel, RawGrid, fixed_texels};
use aogrid_grid_format::Sampling;

use super::buffers::{Buffers, NUMBERS_PER_CELL};
use super::kernels::Kernels;
use super::pass::{PassBindings, PassInputs};
use super::plan::{Brick, MemoryBudget, Pass};
use super::row_hits::RowHitSearch;
use super::{KernelCache, Request, UploadedMesh};
use crate::BakeError;
use crate::store::BufferPool;
use crate::work::Submitter;

/// The state of a running bake.
pub(super) struct Bake<'a> {
    kernels: &'a KernelCache,
    pool: BufferPool,
    submitter: Submitter<'a>,
    mesh: &'a UploadedMesh,
    request: Request,
    texels: Vec<FixedTexel>,
    sums: Vec<FaceSums>,
    bits: FaceBits,
}

/// The masks of a pass as read back.
type PassMasks = (Pass, Vec<u32>);

/// The sums of a brick, and the masks of its passes if they were requested.
type BrickResult = (Vec<i32>, Vec<PassMasks>);

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

    pub(super) async fn run(&mut self) -> Result<(), BakeError> {
        let spec = *self.mesh.prepared.spec();
        let mut done = 0;
        for brick in Brick::all(&spec) {
            let cells = brick.cell_count() as usize;
            let narrow = self.bake_brick(&brick, false, done).await?;
            let (sums, masks) = match narrow {
                Some(result) => result,
                None => {
                    let wide = self.bake_brick(&brick, true, done).await?;
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
        self.submitter.flush().await
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
    async fn bake_brick(
        &mut self,
        brick: &Brick,
        wide: bool,
        done: usize,
    ) -> Result<Option<BrickResult>, BakeError> {
        let mesh = &self.mesh.prepared;
        let budget = self.memory_budget(wide);
        let passes = Pass::all(brick, self.request.size, &budget);
        let device = &self.submitter.context().device;
        let buffers = Buffers::new(device, &mut self.pool, brick, &passes, &budget);
        for buffer in [&buffers.sums, &buffers.overflowed] {
            self.submitter.encoder().clear_buffer(buffer, 0, None);
        }
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
                mesh: self.mesh,
                size: self.request.size,
                pass,
                brick,
                buffers: &buffers,
                wide,
            };
            let row_hits = async |submitter: &mut Submitter<'_>, bindings: &PassBindings<'_>| {
                match &all_candidates {
                    Some(all) => bindings.dispatch_row_hits(submitter, &all[pass.w]).await,
                    None => row_hits_in_batches(submitter, bindings, &search, &batches).await,
                }
            };
            self.run_pass(&inputs, row_hits).await?;
            let cells = brick.cell_count() as usize;
            self.submitter
                .set_done(done + cells * (idx + 1) / (passes.len() + 1));
            if self.request.bits {
                let bytes = u64::from(brick.cell_count() * pass.n_batches()) * 4;
                let read = self.submitter.read(&[(&buffers.masks, bytes)]).await?;
                masks.push((*pass, bytemuck::pod_collect_to_vec(&read[0])));
            }
        }
        let bytes = u64::from(brick.cell_count()) * NUMBERS_PER_CELL * 4;
        let read = self
            .submitter
            .read(&[(&buffers.sums, bytes), (&buffers.overflowed, 4)])
            .await?;
        let overflowed = read[1].iter().any(|byte| *byte != 0);
        Ok((!overflowed).then(|| (bytemuck::pod_collect_to_vec(&read[0]), masks)))
    }

    fn memory_budget(&self, wide: bool) -> MemoryBudget {
        let mesh = &self.mesh.prepared;
        let limits = self.submitter.context().device.limits();
        MemoryBudget {
            binding: limits.max_storage_buffer_binding_size,
            counter: if wide { 4 } else { 1 },
            n_vertices: mesh.vertices().len() as u64,
            n_triangles: mesh.triangles().len() as u64,
        }
    }

    /// Runs the kernels of a pass; `row_hits` dispatches those of its row hits.
    async fn run_pass(
        &mut self,
        inputs: &PassInputs<'_>,
        row_hits: impl AsyncFnOnce(&mut Submitter<'_>, &PassBindings<'_>) -> Result<(), BakeError>,
    ) -> Result<(), BakeError> {
        let (wide, directions) = (inputs.wide, self.request.directions);
        let kernels = &self.kernels[usize::from(wide)][usize::from(directions)];
        let submitter = &mut self.submitter;
        let device = &submitter.context().device;
        let kernels = kernels.get_or_init(|| Kernels::new(device, wide, directions));
        let bindings = PassBindings::new(submitter, inputs, &self.texels, kernels);
        bindings.dispatch_crossings(submitter).await?;
        row_hits(submitter, &bindings).await?;
        bindings.dispatch_summation(submitter).await
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
                let texel = pass.texel_idx(self.request.size, batch, bit);
                self.bits
                    .set(cell, texel.expect("lanes beyond the face are never set"));
            }
        }
    }
}

/// Dispatches the row hits of a pass, one batch of candidates after the other.
async fn row_hits_in_batches(
    submitter: &mut Submitter<'_>,
    bindings: &PassBindings<'_>,
    search: &RowHitSearch<'_>,
    batches: &[Range<usize>],
) -> Result<(), BakeError> {
    for batch in batches {
        bindings
            .dispatch_row_hits(submitter, &search.find(batch.clone())[bindings.w()])
            .await?;
        // Flush, so that the device holds only one batch at a time.
        submitter.flush().await?;
    }
    Ok(())
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
