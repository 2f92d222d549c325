//! One bake by the sweep: brick by brick, pass by pass, and what is read back.

use std::ops::Range;

use aogrid_bake_core::{FaceBits, FaceSums, FixedTexel, RawGrid, cube_face, fixed_texels};
use aogrid_grid_format::Method;
use wgpu::Buffer;

use super::gpu_data::SHARES;
use super::kernels::Kernels;
use super::pass::{Bound, PassRun};
use super::piercings::Search;
use super::plan::{Brick, LANES, Pass, Room, counter_bytes};
use super::{AllKernels, Request, UploadedMesh};
use crate::BakeError;
use crate::store::Store;
use crate::work::Work;

/// Numbers a cell that are read back: count, a and the three of m.
const SUMS: u64 = 5;

/// One bake under way.
pub(super) struct Bake<'a> {
    kernels: &'a AllKernels,
    store: Store,
    pub work: Work<'a>,
    pub mesh: &'a UploadedMesh,
    pub request: Request,
    texels: Vec<FixedTexel>,
    sums: Vec<FaceSums>,
    bits: FaceBits,
}

/// The masks of a pass, read back.
type Masks = (Pass, Vec<u32>);

/// The sums of a brick, and the masks of its passes if they were asked for.
type Found = (Vec<i32>, Vec<Masks>);

/// Buffers of a brick.
pub(super) struct Buffers {
    pub counters: Buffer,
    pub wrapped: Buffer,
    pub facings: Buffer,
    pub ranks: Buffer,
    pub masks: Buffer,
    pub sums: Buffer,
}

impl<'a> Bake<'a> {
    pub(super) fn new(
        kernels: &'a AllKernels,
        store: Store,
        work: Work<'a>,
        mesh: &'a UploadedMesh,
        request: Request,
    ) -> Self {
        let cells = mesh.mesh.spec().cell_count();
        Self {
            kernels,
            store,
            work,
            mesh,
            request,
            texels: fixed_texels(request.size),
            sums: vec![FaceSums::default(); cells],
            bits: FaceBits::new(if request.bits { cells } else { 0 }, request.size),
        }
    }

    pub(super) fn run(&mut self) -> Result<(), BakeError> {
        let spec = *self.mesh.mesh.spec();
        let mut done = 0;
        for brick in Brick::all(&spec) {
            let cells = brick.cell_count() as usize;
            let narrow = self.brick(&brick, false, done)?;
            let (sums, masks) = match narrow {
                Some(found) => found,
                None => {
                    let wide = self.brick(&brick, true, done)?;
                    wide.expect("words hold a step for each of 2³¹ triangles")
                }
            };
            done += cells;
            self.take_sums(&brick, &sums);
            for (pass, masks) in masks {
                self.take_bits(&brick, &pass, &masks);
            }
        }
        self.work.set_done(done);
        self.work.flush()
    }

    /// What was asked for, and the buffers for the next bake.
    pub(super) fn finish(self) -> ((RawGrid, FaceBits), Store) {
        let directions = Method::Faces {
            size: self.request.size,
        }
        .directions();
        let raw = RawGrid {
            spec: *self.mesh.mesh.spec(),
            moments: self.sums.iter().map(|s| s.moments(directions)).collect(),
            counts: self.sums.iter().map(|s| s.count).collect(),
            directions,
            layers: None,
        };
        ((raw, self.bits), self.store)
    }

    /// Bakes a brick; none if a byte was too small for its layers.
    fn brick(
        &mut self,
        brick: &Brick,
        wide: bool,
        done: usize,
    ) -> Result<Option<Found>, BakeError> {
        let mesh = &self.mesh.mesh;
        let room = Room {
            binding: self
                .work
                .context()
                .device
                .limits()
                .max_storage_buffer_binding_size,
            counter: if wide { 4 } else { 1 },
            n_vertices: mesh.vertices().len() as u64,
            n_triangles: mesh.triangles().len() as u64,
        };
        let passes = Pass::all(brick, self.request.size, &room);
        let buffers = self.buffers(brick, &passes, &room);
        self.work.encoder().clear_buffer(&buffers.sums, 0, None);
        self.work.encoder().clear_buffer(&buffers.wrapped, 0, None);

        let search = Search::new(mesh, brick, self.request.size, self.mesh.buffers.reach());
        let batches = search.batches();
        // Mostly all candidates are one batch: found once for all axes.
        let all = match &batches[..] {
            [one] => Some(search.find(one.clone())),
            _ => None,
        };
        let mut masks = Vec::new();
        for (idx, pass) in passes.iter().enumerate() {
            let run = PassRun {
                pass,
                brick,
                buffers: &buffers,
                wide,
            };
            self.pass(&run, |this, bound| match &all {
                Some(all) => bound.pierce(this, &all[pass.w]),
                None => this.pierce_in_batches(bound, &search, &batches, pass.w),
            })?;
            let cells = brick.cell_count() as usize;
            self.work
                .set_done(done + cells * (idx + 1) / (passes.len() + 1));
            if self.request.bits {
                let bytes = u64::from(brick.cell_count() * pass.n_batches()) * 4;
                let read = self.work.read(&[(&buffers.masks, bytes)])?;
                masks.push((*pass, bytemuck::pod_collect_to_vec(&read[0])));
            }
        }
        let bytes = u64::from(brick.cell_count()) * SUMS * 4;
        let read = self
            .work
            .read(&[(&buffers.sums, bytes), (&buffers.wrapped, 4)])?;
        let wrapped = read[1].iter().any(|byte| *byte != 0);
        Ok((!wrapped).then(|| (bytemuck::pod_collect_to_vec(&read[0]), masks)))
    }

    fn buffers(&mut self, brick: &Brick, passes: &[Pass], room: &Room) -> Buffers {
        let device = &self.work.context().device;
        let batches = passes.iter().map(Pass::n_batches).max().unwrap_or(1);
        let rows = passes.iter().map(|p| p.n_rows).max().unwrap_or(1);
        let cells = u64::from(brick.cell_count());
        let mut storage = |name, bytes: u64| self.store.storage(device, name, bytes);
        Buffers {
            counters: storage("counters", counter_bytes(brick, batches, room.counter)),
            wrapped: storage("wrapped", 4),
            facings: storage(
                "facings",
                room.n_triangles * u64::from(rows.div_ceil(4)) * 4,
            ),
            ranks: storage("ranks", room.n_vertices * u64::from(rows) * 4),
            masks: storage("masks", cells * u64::from(batches) * 4),
            sums: storage("sums", cells * SUMS * 4),
        }
    }

    fn pass(
        &mut self,
        run: &PassRun<'_>,
        pierce: impl FnOnce(&mut Self, &Bound<'_>) -> Result<(), BakeError>,
    ) -> Result<(), BakeError> {
        let (wide, directions) = (run.wide, self.request.directions);
        let kernels = &self.kernels[usize::from(wide)][usize::from(directions)];
        let device = &self.work.context().device;
        let kernels = kernels.get_or_init(|| Kernels::new(device, wide, directions));
        let bound = Bound::new(self, run, kernels);
        bound.before_piercings(self)?;
        pierce(self, &bound)?;
        bound.after_piercings(self)
    }

    fn pierce_in_batches(
        &mut self,
        bound: &Bound<'_>,
        search: &Search<'_>,
        batches: &[Range<usize>],
        w: usize,
    ) -> Result<(), BakeError> {
        for batch in batches {
            bound.pierce(self, &search.find(batch.clone())[w])?;
            // So that the device holds one batch only.
            self.work.flush()?;
        }
        Ok(())
    }

    fn take_sums(&mut self, brick: &Brick, sums: &[i32]) {
        let n = brick.cell_count() as usize;
        for local in 0..n {
            let cell = self.mesh.mesh.spec().cell_idx(cell_of(brick, local as u32));
            let of = |plane: usize| sums[plane * n + local];
            self.sums[cell] = FaceSums {
                count: of(0).cast_unsigned(),
                a: of(1),
                m: [of(2), of(3), of(4)],
            };
        }
    }

    fn take_bits(&mut self, brick: &Brick, pass: &Pass, masks: &[u32]) {
        let spec = self.mesh.mesh.spec();
        let [u, v, w] = [(pass.w + 1) % 3, (pass.w + 2) % 3, pass.w];
        let n = brick.cells;
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

    /// For each four bits of each batch's masks, the sums of the shares of all sixteen sets of
    /// them: of m, and of a.
    pub(super) fn shares(&self, pass: &Pass) -> Vec<[i32; 4]> {
        let texel = |batch, bit| texel_of(self.request.size, pass, batch, bit);
        let share = |texel: usize| {
            let FixedTexel { a, m: [x, y, z] } = self.texels[texel];
            [x, y, z, a]
        };
        let of_bit = |batch, bit| texel(batch, bit).map_or([0; 4], share);
        let mut sums = Vec::with_capacity((pass.n_batches() * SHARES) as usize);
        for batch in 0..pass.n_batches() {
            for first in (0..u32::BITS).step_by(4) {
                let of_bits = [0, 1, 2, 3].map(|bit| of_bit(batch, first + bit));
                sums.extend((0..16).map(|set| sum_of(&of_bits, set)));
            }
        }
        sums
    }
}

fn sum_of(shares: &[[i32; 4]; 4], set: u32) -> [i32; 4] {
    let is_in = |(bit, share): (u32, &[i32; 4])| (set >> bit & 1 != 0).then_some(*share);
    let add = |a: [i32; 4], b: [i32; 4]| std::array::from_fn(|x| a[x] + b[x]);
    (0..).zip(shares).filter_map(is_in).fold([0; 4], add)
}

/// A brick's cell, x fastest, in the grid.
fn cell_of(brick: &Brick, local: u32) -> [u32; 3] {
    let [n_x, n_y, _] = brick.cells;
    let [x, y, z] = brick.first;
    [
        x + local % n_x,
        y + local / n_x % n_y,
        z + local / (n_x * n_y),
    ]
}

/// Which texel a bit of a batch's mask is; none for a lane beyond the face's side.
fn texel_of(size: u32, pass: &Pass, batch: u32, bit: u32) -> Option<usize> {
    let b = pass.first_row + batch / pass.n_blocks;
    let a = (pass.first_block + batch % pass.n_blocks) * LANES + bit % LANES;
    let opposite = |i: u32| size - 1 - i;
    (a < size).then(|| match bit < LANES {
        true => cube_face::texel_idx(size, pass.w, true, [a, b]),
        false => cube_face::texel_idx(size, pass.w, false, [opposite(a), opposite(b)]),
    })
}
