//! One pass of the sweep: its kernels, what they are bound to, and how much they are to do.

use wgpu::{Buffer, BufferUsages};

use super::bake::{Bake, Buffers};
use super::gpu_data::{self, Frame, TABLE};
use super::kernels::Kernels;
use super::plan::{Brick, LANES, Pass};
use super::view::View;
use crate::BakeError;
use crate::shaders::WORKGROUP;
use crate::work::Extent;

/// Invocations that a device should have at least, where edges are too few: then the levels
/// of one edge are shared out.
const ENOUGH_INVOCATIONS: u32 = 1 << 15;

/// Invocations that search edges, at least, if there are rows enough: more workgroups, each for
/// fewer rows, fill a device; and those that run at the same time write near each other. Each
/// has to read its edges again, though.
const ENOUGH_SEARCHES: u32 = 1 << 18;

/// Invocations that share an edge, at most, where that is all it is for.
const MOST_PARTS: u32 = 32;

/// Steps that an invocation should count, at most: Mesa's software stops its loops after
/// 65,535 rounds, silently.
const MOST_STEPS: f64 = (1 << 14) as f64;

/// Steps of a piece, mostly. Fewer share work out more evenly; each takes a while to begin.
const STEPS_OF_PIECE: u32 = 32;

/// WebGPU's limit on workgroups along an axis of a dispatch.
const MOST_WORKGROUPS: u32 = 65_535;

/// A pass over a brick.
pub(super) struct PassRun<'a> {
    pub pass: &'a Pass,
    pub brick: &'a Brick,
    pub buffers: &'a Buffers,
    pub wide: bool,
}

/// A pass with its kernels and what they are bound to.
pub(super) struct Bound<'a> {
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
    pub(super) fn new(bake: &Bake<'_>, run: &'a PassRun<'a>, kernels: &'a Kernels) -> Self {
        let mesh = &bake.mesh.mesh;
        let view = View::new(mesh, run.brick, run.pass.w, bake.request.size);
        let found = view.levels(run.pass);
        let uniform = |label, bytes: &[u8], size: usize| {
            let mut padded = bytes.to_vec();
            padded.resize(size, 0);
            bake.work.upload(label, BufferUsages::UNIFORM, &padded)
        };
        let [_, v, w] = view.axes;
        let edge = bake.mesh.buffers.edge_cells;
        let edge_levels = (edge[v] + view.shear[1] * edge[w]) * f64::from(view.cells[2]);
        let [mesh_low, mesh_high] = view.bounds_of(bake.mesh.buffers.bounds);
        let data = Frame {
            piece_bits: steps_of_piece(found.n_ranks).ilog2(),
            mesh_low,
            mesh_high,
            n_vertices: mesh.vertices().len() as u32,
            n_triangles: mesh.triangles().len() as u32,
            n_pairs: bake.mesh.buffers.n_pairs,
            n_edges: bake.mesh.buffers.n_edges,
            parts: parts(bake.mesh.buffers.n_edges, run.pass, edge_levels),
            rows_each: rows_each(bake.mesh.buffers.n_edges, run.pass),
            ..view.frame(run.pass, &found, mesh.lattice().bits())
        };
        let table = TABLE * 16;
        Self {
            run,
            kernels,
            frame: uniform("frame", bytemuck::bytes_of(&data), size_of::<Frame>()),
            levels: uniform("levels", bytemuck::cast_slice(&found.levels), table),
            buckets: uniform("buckets", bytemuck::cast_slice(&found.buckets), table),
            shares: uniform(
                "shares",
                bytemuck::cast_slice(&bake.shares(run.pass)),
                table,
            ),
            edge_levels,
            data,
        }
    }

    pub(super) fn before_piercings(&self, bake: &mut Bake<'_>) -> Result<(), BakeError> {
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
        extent.y = data.n_rows.div_ceil(data.rows_each);
        extent.z = data.parts;
        bake.work.dispatch(kernel, &bound, extent)
    }

    pub(super) fn pierce(
        &self,
        bake: &mut Bake<'_>,
        found: &[gpu_data::Piercing],
    ) -> Result<(), BakeError> {
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

    pub(super) fn after_piercings(&self, bake: &mut Bake<'_>) -> Result<(), BakeError> {
        let Self {
            run, data, kernels, ..
        } = self;
        let buffers = run.buffers;
        let batches = run.pass.n_batches();
        let [n_u, n_v, n_w] = data.cells;

        bake.work.encoder().clear_buffer(&buffers.masks, 0, None);
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

/// Rows of texels that one workgroup searches its edges for.
fn rows_each(n_edges: u32, pass: &Pass) -> u32 {
    let groups = (ENOUGH_SEARCHES / n_edges.max(1)).clamp(1, pass.n_rows);
    pass.n_rows.div_ceil(groups)
}

/// Steps of a piece of work, see `crossings.wgsl`: so many that an edge, of which a block has at
/// most as many steps as it has directions times levels, has below 2¹¹ pieces, and all of a
/// workgroup's pairs below 2²¹.
pub(super) fn steps_of_piece(n_ranks: u32) -> u32 {
    STEPS_OF_PIECE.max(n_ranks / 64).next_power_of_two()
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
