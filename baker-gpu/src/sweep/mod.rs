//! The direction sweep as compute passes.
//!
//! # Theory
//!
//! For one direction d the rays of all cells are parallel: what lies ahead of the cells of a
//! row changes only where one of the rays passes a silhouette of the mesh, so that a running
//! sum along the row of what begins and ends there tells every cell how many layers of surface
//! it has ahead; not zero is occluded. The CPU baker's sweep has the idea in full, with a
//! picture. Its stages are kernels here, each beside this file, in this order for every axis w
//! and some rows b and blocks of directions (a, b, 1) and their opposites:
//!
//! 1. `silhouettes`: which directions of a row each triangle faces: a byte.
//! 2. `levels`: the rank of each vertex among the planes V − b·W = j − k·b, in each of which
//!    lies a row (j, k) of cells: an edge crosses exactly those between its ends' ranks.
//! 3. `crossings`: for each pair of an edge and a row b that is a silhouette and crosses a
//!    level, the crossing points, and for each direction the column from which on it counts.
//! 4. `piercings`: where a row's own line goes through the mesh a layer changes from above the
//!    row, where it is ahead of d, to below, ahead of −d.
//! 5. `summation`: running sums along the rows, to 32 bits a cell and batch.
//! 6. `moments`: those bits, to sums of integers a cell, the same as on the CPU.
//!
//! What is decided from rounded numbers (facings, ranks) is decided once and kept; on which
//! side of a row an edge passes is asked in exact integers, by `crossings` and `piercings`
//! alike. So what begins along a row also ends: rounding moves a step by a cell at the most,
//! and never leaves a streak. [`piercings`](mod@piercings) has the argument.
//!
//! # Practice
//!
//! Counters are bytes, four directions to a word. One that does not suffice is noticed, and
//! its brick is baked again with words. Kernels keep vectors, never arrays, in an invocation:
//! dynamically indexed arrays would live in memory. Nothing is read back but the sums.

mod gpu_data;
mod kernels;
mod mesh;
mod piercings;
mod plan;
mod view;

use std::ops::Range;
use std::sync::OnceLock;

use aogrid_bake_core::{
    FaceBits, FaceSums, FixedTexel, Observer, PreparedMesh, RawGrid, cube_face, fixed_texels,
};
use aogrid_grid_format::{FACE_SIZES, Method};
use wgpu::{Buffer, BufferUsages};

use crate::pace::Pace;
use crate::shaders::WORKGROUP;
use crate::store::Store;
use crate::work::{Extent, Work};
use crate::{BakeError, Context};
use gpu_data::{Frame, TABLE};
use kernels::Kernels;
pub(crate) use kernels::shaders;
use mesh::Mesh;
use piercings::Search;
use plan::{Brick, LANES, Pass, Room, counter_bytes};
use view::{Levels, View};

/// Numbers a cell that are read back: count, a and the three of m.
const SUMS: u64 = 5;

/// Invocations that a device should have at least, where edges are too few: then the levels
/// of one edge are shared out.
const ENOUGH_INVOCATIONS: u32 = 1 << 15;

/// Invocations that share an edge, at most, where that is all it is for.
const MOST_PARTS: u32 = 32;

/// Steps that an invocation should count, at most: Mesa's software stops its loops after
/// 65,535 rounds, silently.
const MOST_STEPS: f64 = (1 << 14) as f64;

/// WebGPU's limit on workgroups along an axis of a dispatch.
const MOST_WORKGROUPS: u32 = 65_535;

/// Bakes faces by the direction sweep, again and again with the same buffers.
pub struct Sweeper {
    context: Context,
    kernels: [[OnceLock<Kernels>; 2]; 2],
    store: Store,
    pace: Pace,
}

/// A mesh in the device's memory, ready to be swept.
pub struct UploadedMesh {
    mesh: PreparedMesh,
    buffers: Mesh,
}

impl UploadedMesh {
    /// The mesh.
    pub fn mesh(&self) -> &PreparedMesh {
        &self.mesh
    }
}

/// What to compute.
#[derive(Clone, Copy)]
struct Request {
    size: u32,
    directions: bool,
    bits: bool,
}

impl Sweeper {
    /// Without buffers and pipelines yet.
    pub fn new(context: &Context) -> Self {
        Self {
            context: context.clone(),
            kernels: Default::default(),
            store: Store::default(),
            pace: Pace::default(),
        }
    }

    /// Copies a mesh to the device.
    ///
    /// # Errors
    ///
    /// It does not fit, or the device fails.
    pub fn upload(&mut self, mesh: PreparedMesh) -> Result<UploadedMesh, BakeError> {
        let unobserved = aogrid_bake_core::UNOBSERVED;
        let mut work = Work::new(&self.context, &mut self.pace, unobserved, 0);
        let buffers = Mesh::new(&work, &mesh)?;
        work.check()?;
        Ok(UploadedMesh { mesh, buffers })
    }

    /// Bakes six faces of `size` × `size` texels around every cell of the mesh's grid. The same
    /// input gives the same bits, and those of the CPU wherever the faces are the same. Without
    /// `directions` every moment 1 is zero: the papers' occlusion-only variant.
    ///
    /// # Errors
    ///
    /// A face size out of its range, cancellation, or the device fails.
    pub fn bake(
        &mut self,
        mesh: &UploadedMesh,
        size: u32,
        directions: bool,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        let request = Request {
            size,
            directions,
            bits: false,
        };
        Ok(self.run(mesh, request, observer)?.0)
    }

    /// [`Sweeper::bake`] with directions, and the faces themselves: `size`² · 6 bits a cell.
    ///
    /// # Errors
    ///
    /// As [`Sweeper::bake`].
    pub fn bake_with_bits(
        &mut self,
        mesh: &UploadedMesh,
        size: u32,
        observer: Observer<'_>,
    ) -> Result<(RawGrid, FaceBits), BakeError> {
        let request = Request {
            size,
            directions: true,
            bits: true,
        };
        self.run(mesh, request, observer)
    }

    fn run(
        &mut self,
        mesh: &UploadedMesh,
        request: Request,
        observer: Observer<'_>,
    ) -> Result<(RawGrid, FaceBits), BakeError> {
        let size = request.size;
        if !FACE_SIZES.contains(&size) {
            return Err(aogrid_bake_core::OptionsError::FaceSize(size).into());
        }
        let spec = *mesh.mesh.spec();
        // What a bake that ended early has left in the counters must not be seen again.
        let store = std::mem::take(&mut self.store);
        let context = self.context.clone();
        let mut bake = Bake {
            kernels: &self.kernels,
            store,
            work: Work::new(&context, &mut self.pace, observer, spec.cell_count()),
            mesh,
            request,
            texels: fixed_texels(size),
            sums: vec![FaceSums::default(); spec.cell_count()],
            bits: FaceBits::new(if request.bits { spec.cell_count() } else { 0 }, size),
        };
        bake.run()?;
        let Bake {
            sums, bits, store, ..
        } = bake;
        self.store = store;
        let directions = Method::Faces { size }.directions();
        let raw = RawGrid {
            spec,
            moments: sums.iter().map(|s| s.moments(directions)).collect(),
            counts: sums.iter().map(|s| s.count).collect(),
            directions,
        };
        Ok((raw, bits))
    }
}

/// One bake under way.
struct Bake<'a> {
    kernels: &'a [[OnceLock<Kernels>; 2]; 2],
    store: Store,
    work: Work<'a>,
    mesh: &'a UploadedMesh,
    request: Request,
    texels: Vec<FixedTexel>,
    sums: Vec<FaceSums>,
    bits: FaceBits,
}

/// The masks of a pass, read back.
type Masks = (Pass, Vec<u32>);

/// The sums of a brick, and the masks of its passes if they were asked for.
type Found = (Vec<i32>, Vec<Masks>);

/// Buffers of a brick.
struct Buffers {
    counters: Buffer,
    wrapped: Buffer,
    facings: Buffer,
    ranks: Buffer,
    masks: Buffer,
    sums: Buffer,
}

impl Bake<'_> {
    fn run(&mut self) -> Result<(), BakeError> {
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

        let search = Search::new(mesh, brick, self.request.size, self.mesh.buffers.reach);
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

    /// The share of each bit of each batch: of m, and of a.
    fn shares(&self, pass: &Pass) -> Vec<[i32; 4]> {
        let texel = |batch, bit| texel_of(self.request.size, pass, batch, bit);
        let share = |texel: usize| {
            let FixedTexel { a, m: [x, y, z] } = self.texels[texel];
            [x, y, z, a]
        };
        (0..pass.n_batches())
            .flat_map(|batch| (0..u32::BITS).map(move |bit| (batch, bit)))
            .map(|(batch, bit)| texel(batch, bit).map_or([0; 4], share))
            .collect()
    }
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

/// A pass over a brick.
struct PassRun<'a> {
    pass: &'a Pass,
    brick: &'a Brick,
    buffers: &'a Buffers,
    wide: bool,
}

/// A pass with its kernels and what they are bound to.
struct Bound<'a> {
    run: &'a PassRun<'a>,
    kernels: &'a Kernels,
    data: Frame,
    frame: Buffer,
    levels: Buffer,
    buckets: Buffer,
    shares: Buffer,
    /// Levels that an edge crosses, on average.
    edge_levels: f64,
}

impl<'a> Bound<'a> {
    fn new(bake: &Bake<'_>, run: &'a PassRun<'a>, kernels: &'a Kernels) -> Self {
        let mesh = &bake.mesh.mesh;
        let view = View::new(mesh, run.brick, run.pass.w, bake.request.size);
        let Levels {
            levels, buckets, ..
        } = &view.levels(run.pass);
        let found = view.levels(run.pass);
        let uniform = |label, bytes: &[u8], size: usize| {
            let mut padded = bytes.to_vec();
            padded.resize(size, 0);
            bake.work.upload(label, BufferUsages::UNIFORM, &padded)
        };
        let [_, v, w] = view.axes;
        let edge = bake.mesh.buffers.edge_cells;
        let edge_levels = (edge[v] + view.shear[1] * edge[w]) * f64::from(view.cells[2]);
        let data = Frame {
            n_vertices: mesh.vertices().len() as u32,
            n_triangles: mesh.triangles().len() as u32,
            n_pairs: bake.mesh.buffers.n_pairs,
            n_edges: bake.mesh.buffers.n_edges,
            parts: parts(bake.mesh.buffers.n_edges, run.pass, edge_levels),
            ..view.frame(run.pass, &found, mesh.lattice().bits())
        };
        let table = TABLE * 16;
        Self {
            run,
            kernels,
            frame: uniform("frame", bytemuck::bytes_of(&data), size_of::<Frame>()),
            levels: uniform("levels", bytemuck::cast_slice(levels), table),
            buckets: uniform("buckets", bytemuck::cast_slice(buckets), table),
            shares: uniform(
                "shares",
                bytemuck::cast_slice(&bake.shares(run.pass)),
                table,
            ),
            edge_levels,
            data,
        }
    }

    fn before_piercings(&self, bake: &mut Bake<'_>) -> Result<(), BakeError> {
        let Self {
            run, data, kernels, ..
        } = self;
        let (mesh, buffers) = (&bake.mesh.buffers, run.buffers);
        let per_row = f64::from(WORKGROUP * data.n_rows);

        let kernel = &kernels.silhouettes;
        let bound = bake
            .work
            .bind(kernel, &[&self.frame, &mesh.normals, &buffers.facings]);
        bake.work
            .dispatch(kernel, &bound, line(data.n_triangles, per_row))?;

        let kernel = &kernels.levels;
        let bound = bake.work.bind(
            kernel,
            &[
                &self.frame,
                &self.levels,
                &self.buckets,
                &mesh.positions,
                &buffers.ranks,
            ],
        );
        bake.work
            .dispatch(kernel, &bound, line(data.n_vertices, 2.0 * per_row))?;

        let kernel = &kernels.crossings;
        let bound = bake.work.bind(
            kernel,
            &[
                &self.frame,
                &buffers.counters,
                &buffers.wrapped,
                &self.levels,
                &mesh.positions,
                &mesh.edges,
                &buffers.facings,
                &buffers.ranks,
            ],
        );
        let parts = f64::from(data.parts);
        let units = per_row * (parts + 4.0 * self.edge_levels);
        let mut extent = line(data.n_edges, units);
        extent.z = data.parts;
        bake.work.dispatch(kernel, &bound, extent)
    }

    fn pierce(&self, bake: &mut Bake<'_>, found: &[gpu_data::Piercing]) -> Result<(), BakeError> {
        if found.is_empty() {
            return Ok(());
        }
        let Self {
            run, data, kernels, ..
        } = self;
        let frame = Frame {
            n_piercings: found.len() as u32,
            ..*data
        };
        let bytes = bytemuck::bytes_of(&frame);
        let frame = bake.work.upload("frame", BufferUsages::UNIFORM, bytes);
        let bytes = bytemuck::cast_slice(found);
        let candidates = bake.work.upload("piercings", BufferUsages::STORAGE, bytes);
        let kernel = &kernels.piercings;
        let bound = bake.work.bind(
            kernel,
            &[
                &frame,
                &run.buffers.counters,
                &run.buffers.wrapped,
                &self.levels,
                &run.buffers.facings,
                &run.buffers.ranks,
                &candidates,
            ],
        );
        let lanes = data.n_blocks * LANES;
        let mut extent = line(
            found.len() as u32,
            f64::from(WORKGROUP * data.n_rows * lanes),
        );
        extent.y = data.n_rows;
        bake.work.dispatch(kernel, &bound, extent)
    }

    fn after_piercings(&self, bake: &mut Bake<'_>) -> Result<(), BakeError> {
        let Self {
            run, data, kernels, ..
        } = self;
        let buffers = run.buffers;
        let batches = run.pass.n_batches();
        let [n_u, n_v, n_w] = data.cells;

        let kernel = &kernels.summation;
        let bound = bake
            .work
            .bind(kernel, &[&self.frame, &buffers.counters, &buffers.masks]);
        let counter = if run.wide { 4 } else { 1 };
        let units = f64::from(WORKGROUP * n_u * 8 * counter * batches);
        let mut extent = line(n_v * n_w, units);
        extent.y = batches;
        bake.work.dispatch(kernel, &bound, extent)?;

        let kernel = &kernels.moments;
        let bound = bake.work.bind(
            kernel,
            &[&self.frame, &buffers.masks, &self.shares, &buffers.sums],
        );
        let units = f64::from(WORKGROUP * 32 * batches);
        bake.work
            .dispatch(kernel, &bound, line(n_u * n_v * n_w, units))
    }
}

/// Workgroups for so many invocations.
fn line(invocations: u32, units: f64) -> Extent {
    Extent {
        n: invocations.div_ceil(WORKGROUP),
        y: 1,
        z: 1,
        units,
    }
}

/// In how many parts the levels of each edge are shared out: so that there are enough
/// invocations, and that none loops too long.
fn parts(n_edges: u32, pass: &Pass, edge_levels: f64) -> u32 {
    let for_many = ENOUGH_INVOCATIONS / (n_edges * pass.n_rows).max(1);
    // All of an invocation's share of pairs at the worst, in every direction of every block.
    let steps = edge_levels * f64::from(pass.n_rows * pass.n_blocks * LANES);
    let for_short = (steps / MOST_STEPS).ceil() as u32;
    for_many
        .min(MOST_PARTS)
        .max(for_short)
        .clamp(1, MOST_WORKGROUPS)
}
