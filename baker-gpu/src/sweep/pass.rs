//! One pass of the sweep: its kernels, their bindings, and their workgroups.

use aogrid_bake_core::FixedTexel;
use wgpu::{Buffer, BufferUsages};

use super::UploadedMesh;
use super::buffers::Buffers;
use super::gpu_data::{self, Frame, TABLE_LEN};
use super::kernels::Kernels;
use super::levels::{Levels, padded_bounds};
use super::plan::{Brick, LANES, Pass};
use super::subset_sums::subset_sums;
use crate::BakeError;
use crate::shaders::WORKGROUP;
use crate::work::{Extent, Submitter};

/// The number of invocations that should run at least. If there are too few edges for it, the
/// levels of each edge are distributed over several workgroups.
const MIN_INVOCATIONS: u32 = 1 << 15;

/// The number of invocations that should search edges at least, if there are enough rows. More
/// workgroups for fewer rows each fill the device, and those that run at the same time write to
/// nearby memory; but each of them reads its edges again.
const MIN_SEARCH_INVOCATIONS: u32 = 1 << 18;

/// The largest number of workgroups that share the same edges only to fill the device.
const MAX_PARTS: u32 = 32;

/// The largest number of deltas that an invocation should count: Mesa's software rasterizer
/// silently stops a loop after 65,535 iterations.
const MAX_DELTAS: f64 = (1 << 14) as f64;

/// The number of deltas per piece, except where that would make too many pieces. Smaller pieces
/// balance the load better, but each has a startup cost.
const PIECE_DELTAS: u32 = 32;

/// WebGPU's limit on workgroups along an axis of a dispatch.
const MAX_WORKGROUPS: u32 = 65_535;

/// The inputs of a pass over a brick.
pub(super) struct PassInputs<'a> {
    pub mesh: &'a UploadedMesh,
    /// Texels along a face's side.
    pub size: u32,
    pub pass: &'a Pass,
    pub brick: &'a Brick,
    pub buffers: &'a Buffers,
    /// Whether counters are words instead of bytes.
    pub wide: bool,
}

/// A pass with its kernels and the buffers that they bind.
pub(super) struct PassBindings<'a> {
    inputs: &'a PassInputs<'a>,
    kernels: &'a Kernels,
    data: Frame,
    frame: Buffer,
    levels: Buffer,
    buckets: Buffer,
    subset_sums: Buffer,
    /// The mean number of levels that an edge crosses.
    edge_levels: f64,
}

impl<'a> PassBindings<'a> {
    pub(super) fn new(
        submitter: &Submitter<'_>,
        inputs: &'a PassInputs<'a>,
        texels: &[FixedTexel],
        kernels: &'a Kernels,
    ) -> Self {
        let UploadedMesh {
            prepared: mesh,
            buffers: mesh_buffers,
        } = inputs.mesh;
        let axis_frame = inputs.brick.frame(mesh.spec(), inputs.pass.w, inputs.size);
        let table = Levels::new(&axis_frame, inputs.pass);
        // The tables are padded to the size that the shaders declare.
        let uniform = |label, bytes: &[u8], size: usize| {
            let mut padded = bytes.to_vec();
            padded.resize(size, 0);
            submitter.upload(label, BufferUsages::UNIFORM, &padded)
        };
        let [_, v, w] = axis_frame.axes;
        let edge = mesh_buffers.edge_cells;
        let edge_levels =
            (edge[v] + axis_frame.shear[1] * edge[w]) * f64::from(axis_frame.cells[2]);
        let [mesh_low, mesh_high] = padded_bounds(&axis_frame, mesh_buffers.bounds);
        let data = Frame {
            piece_bits: deltas_per_piece(table.n_ranks).ilog2(),
            mesh_low,
            mesh_high,
            n_vertices: mesh.vertices().len() as u32,
            n_triangles: mesh.triangles().len() as u32,
            n_interior_edges: mesh_buffers.n_interior_edges,
            n_edges: mesh_buffers.n_edges,
            n_parts: n_parts(mesh_buffers.n_edges, inputs.pass, edge_levels),
            rows_per_workgroup: rows_per_workgroup(mesh_buffers.n_edges, inputs.pass),
            ..table.uniforms(&axis_frame, inputs.pass, mesh.lattice().bits())
        };
        let table_bytes = TABLE_LEN * 16;
        Self {
            inputs,
            kernels,
            frame: uniform("frame", bytemuck::bytes_of(&data), size_of::<Frame>()),
            levels: uniform("levels", bytemuck::cast_slice(&table.levels), table_bytes),
            buckets: uniform("buckets", bytemuck::cast_slice(&table.buckets), table_bytes),
            subset_sums: uniform(
                "subset sums",
                bytemuck::cast_slice(&subset_sums(texels, inputs.size, inputs.pass)),
                table_bytes,
            ),
            edge_levels,
            data,
        }
    }

    /// Returns the axis of the pass.
    pub(super) fn w(&self) -> usize {
        self.inputs.pass.w
    }

    /// Dispatches the stages up to the crossings.
    pub(super) async fn dispatch_crossings(
        &self,
        submitter: &mut Submitter<'_>,
    ) -> Result<(), BakeError> {
        let data = &self.data;
        let (mesh, buffers) = (&self.inputs.mesh.buffers, self.inputs.buffers);
        // Work units of a workgroup that handles each of its items once per row.
        let row_units = f64::from(WORKGROUP * data.n_rows);

        let kernel = &self.kernels.silhouettes;
        let extent = linear_extent(data.n_triangles, row_units);
        let bindings = [&self.frame, &mesh.normals, &buffers.facing_intervals];
        submitter
            .dispatch(kernel, &submitter.bind(kernel, &bindings), extent)
            .await?;

        let kernel = &self.kernels.levels;
        let extent = linear_extent(data.n_vertices, 2.0 * row_units);
        let bindings = [
            &self.frame,
            &self.levels,
            &self.buckets,
            &mesh.positions,
            &buffers.ranks,
        ];
        submitter
            .dispatch(kernel, &submitter.bind(kernel, &bindings), extent)
            .await?;

        let kernel = &self.kernels.crossings;
        let n_parts = f64::from(data.n_parts);
        let units = row_units * (n_parts + 4.0 * self.edge_levels);
        let mut extent = linear_extent(data.n_edges, units);
        extent.y = data.n_rows.div_ceil(data.rows_per_workgroup);
        extent.z = data.n_parts;
        let bindings = [
            &self.frame,
            &buffers.counters,
            &buffers.overflowed,
            &self.levels,
            &mesh.positions,
            &mesh.edges,
            &buffers.facing_intervals,
            &buffers.ranks,
        ];
        submitter
            .dispatch(kernel, &submitter.bind(kernel, &bindings), extent)
            .await
    }

    /// Dispatches the test of candidates for row hits.
    pub(super) async fn dispatch_row_hits(
        &self,
        submitter: &mut Submitter<'_>,
        candidates: &[gpu_data::RowHitCandidate],
    ) -> Result<(), BakeError> {
        if candidates.is_empty() {
            return Ok(());
        }
        let Self {
            inputs,
            data,
            kernels,
            ..
        } = self;
        let frame = Frame {
            n_candidates: candidates.len() as u32,
            ..*data
        };
        let bytes = bytemuck::bytes_of(&frame);
        let frame = submitter.upload("frame", BufferUsages::UNIFORM, bytes);
        let bytes = bytemuck::cast_slice(candidates);
        let buffer = submitter.upload("row hit candidates", BufferUsages::STORAGE, bytes);
        let kernel = &kernels.row_hits;
        let bindings = submitter.bind(
            kernel,
            &[
                &frame,
                &inputs.buffers.counters,
                &inputs.buffers.overflowed,
                &self.levels,
                &inputs.buffers.facing_intervals,
                &inputs.buffers.ranks,
                &buffer,
            ],
        );
        let lanes = data.n_blocks * LANES;
        let mut extent = linear_extent(
            candidates.len() as u32,
            f64::from(WORKGROUP * data.n_rows * lanes),
        );
        extent.y = data.n_rows;
        submitter.dispatch(kernel, &bindings, extent).await
    }

    /// Dispatches the stages after the row hits: summation and moments.
    pub(super) async fn dispatch_summation(
        &self,
        submitter: &mut Submitter<'_>,
    ) -> Result<(), BakeError> {
        let Self {
            inputs,
            data,
            kernels,
            ..
        } = self;
        let buffers = inputs.buffers;
        let batches = inputs.pass.n_batches();
        let [n_u, n_v, n_w] = data.cells;

        // The summation only writes the columns within the mesh's bounds.
        submitter.encoder().clear_buffer(&buffers.masks, 0, None);
        let kernel = &kernels.summation;
        let bindings = submitter.bind(kernel, &[&self.frame, &buffers.counters, &buffers.masks]);
        let counter = if inputs.wide { 4 } else { 1 };
        let units = f64::from(WORKGROUP * n_u * 8 * counter * batches);
        let mut extent = linear_extent(n_v * n_w, units);
        extent.y = batches;
        submitter.dispatch(kernel, &bindings, extent).await?;

        let kernel = &kernels.moments;
        let bindings = submitter.bind(
            kernel,
            &[
                &self.frame,
                &buffers.masks,
                &self.subset_sums,
                &buffers.sums,
            ],
        );
        let units = f64::from(WORKGROUP * 32 * batches);
        submitter
            .dispatch(kernel, &bindings, linear_extent(n_u * n_v * n_w, units))
            .await
    }
}

/// Returns the workgroups along x for this many invocations.
fn linear_extent(invocations: u32, units: f64) -> Extent {
    Extent {
        n: invocations.div_ceil(WORKGROUP),
        y: 1,
        z: 1,
        units,
    }
}

/// Returns the number of rows of texels for which one workgroup searches its edges.
fn rows_per_workgroup(n_edges: u32, pass: &Pass) -> u32 {
    let groups = (MIN_SEARCH_INVOCATIONS / n_edges.max(1)).clamp(1, pass.n_rows);
    pass.n_rows.div_ceil(groups)
}

/// Returns the maximum number of deltas of a piece, see `crossings.wgsl`. An edge has in a block
/// at most directions × levels deltas, so that it has fewer than 2¹¹ pieces, and all pairs of a
/// workgroup fewer than 2²¹.
pub(super) fn deltas_per_piece(n_ranks: u32) -> u32 {
    PIECE_DELTAS.max(n_ranks / 64).next_power_of_two()
}

/// Returns the number of workgroups over which the pieces of the same edges are distributed: so
/// many that there are enough invocations, and that none of them loops for too long.
fn n_parts(n_edges: u32, pass: &Pass, edge_levels: f64) -> u32 {
    let to_fill_device = MIN_INVOCATIONS / (n_edges * pass.n_rows).max(1);
    // In the worst case each invocation's edge is a silhouette in every direction of every block.
    let deltas = edge_levels * f64::from(pass.n_rows * pass.n_blocks * LANES);
    let to_limit_loops = (deltas / MAX_DELTAS).ceil() as u32;
    to_fill_device
        .min(MAX_PARTS)
        .max(to_limit_loops)
        .clamp(1, MAX_WORKGROUPS)
}
