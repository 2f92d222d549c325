//! The direction sweep as compute passes.
//!
//! # Theory
//!
//! For one direction d the rays of all cells are parallel, and the surface ahead of the cells of
//! a row changes only where one of the rays passes a silhouette of the mesh. A running sum along
//! the row of the layers that begin and end there gives the number of layers of surface ahead of
//! each cell; a cell is occluded if its sum is not zero. The documentation of the CPU baker's
//! sweep explains the idea in full, with a figure. Its stages are kernels here, each in a WGSL
//! file beside this one. They run in this order for every axis w, for some rows b and blocks of
//! directions (a, b, 1) and their opposites:
//!
//! 1. `silhouettes`: the directions of a row of texels that each triangle faces, as an interval
//!    in a byte.
//! 2. `levels`: the rank of each vertex among the planes V − b·W = j − k·b, each of which holds a
//!    row (j, k) of cells. An edge crosses exactly the levels between the ranks of its ends.
//! 3. `crossings`: for each pair of an edge and a row b where the edge is a silhouette and crosses
//!    a level, the crossing points, and for each direction the column from which on it counts.
//! 4. `piercings`: row hits. Where a row's own line passes through the mesh, a layer moves from
//!    above the row, where it is ahead in direction d, to below it, where it is ahead in −d.
//! 5. `summation`: running sums along the rows give 32 bits per cell and batch.
//! 6. `moments`: adds these bits up to integer sums per cell, the same as on the CPU.
//!
//! Decisions that depend on rounded numbers (facing intervals, ranks) are made once and stored.
//! `crossings` and `piercings` must agree on the side of a row on which an edge passes; both
//! evaluate the same expression in exact integers. Every layer that begins along a row therefore
//! also ends: rounding moves a delta by at most one cell and never leaves a streak.
//! [`row_hits`](mod@row_hits) has the argument.
//!
//! # Practice
//!
//! Counters are bytes, four directions to a word. If one overflows, its brick is baked again with
//! words. Invocations keep their data in vectors, not arrays, because dynamically indexed arrays
//! would live in memory. Only the sums (and the faces' bits, if requested) are read back.

mod bake;
mod buffers;
mod gpu_data;
mod kernels;
mod levels;
mod mesh;
mod pass;
mod plan;
mod row_hits;
mod subset_sums;

use std::sync::OnceLock;

use aogrid_bake_core::{FaceBits, Observer, OptionsError, PlanError, PreparedMesh, RawGrid};
use aogrid_grid_format::FACE_SIZES;

use crate::pace::SubmissionPacer;
use crate::store::BufferPool;
use crate::work::Submitter;
use crate::{BakeError, Context};
use bake::Bake;
use kernels::Kernels;
pub(crate) use kernels::shaders;
use mesh::MeshBuffers;

/// Bakes cube faces by the direction sweep, and keeps its pipelines and buffers between bakes.
pub struct Sweeper {
    context: Context,
    kernels: KernelCache,
    pool: BufferPool,
    pacer: SubmissionPacer,
}

/// The kernels by counter width (bytes, words) and by directions (without, with). They are
/// compiled on first use.
type KernelCache = [[OnceLock<Kernels>; 2]; 2];

/// A mesh in the device's memory, ready for the direction sweep.
pub struct UploadedMesh {
    prepared: PreparedMesh,
    buffers: MeshBuffers,
}

impl UploadedMesh {
    /// Returns the mesh.
    pub fn mesh(&self) -> &PreparedMesh {
        &self.prepared
    }
}

/// The options of one sweep.
#[derive(Clone, Copy)]
struct Request {
    size: u32,
    directions: bool,
    bits: bool,
}

impl Sweeper {
    /// Creates a sweeper. Buffers and pipelines are created on first use.
    pub fn new(context: &Context) -> Self {
        Self {
            context: context.clone(),
            kernels: Default::default(),
            pool: BufferPool::default(),
            pacer: SubmissionPacer::default(),
        }
    }

    /// Copies a mesh to the device.
    ///
    /// # Errors
    ///
    /// The mesh does not fit, or the device fails.
    pub async fn upload(&mut self, mesh: PreparedMesh) -> Result<UploadedMesh, BakeError> {
        let unobserved = aogrid_bake_core::UNOBSERVED;
        let mut submitter = Submitter::new(&self.context, &mut self.pacer, unobserved, 0);
        let buffers = MeshBuffers::new(&submitter, &mesh)?;
        submitter.check().await?;
        Ok(UploadedMesh {
            prepared: mesh,
            buffers,
        })
    }

    /// Bakes six faces of `size` × `size` texels around every cell of the mesh's grid. The same
    /// input gives the same bits, and the CPU's bits wherever the faces are the same. Without
    /// `directions` every moment 1 is zero: the papers' occlusion-only variant.
    ///
    /// # Errors
    ///
    /// The face size is out of range, the observer cancels, or the device fails.
    pub async fn bake(
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
        Ok(self.run(mesh, request, observer).await?.0)
    }

    /// Bakes as [`Sweeper::bake`] with directions, and also returns the faces: `size`² · 6 bits
    /// per cell.
    ///
    /// # Errors
    ///
    /// The errors of [`Sweeper::bake`].
    pub async fn bake_with_bits(
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
        self.run(mesh, request, observer).await
    }

    async fn run(
        &mut self,
        mesh: &UploadedMesh,
        request: Request,
        observer: Observer<'_>,
    ) -> Result<(RawGrid, FaceBits), BakeError> {
        let size = request.size;
        if !FACE_SIZES.contains(&size) {
            return Err(PlanError::from(OptionsError::FaceSize(size)).into());
        }
        // Take the buffers out, so that a bake that ends early drops them: its counters are not
        // zero.
        let pool = std::mem::take(&mut self.pool);
        let cells = mesh.prepared.spec().cell_count();
        let submitter = Submitter::new(&self.context, &mut self.pacer, observer, cells);
        let mut bake = Bake::new(&self.kernels, pool, submitter, mesh, request);
        bake.run().await?;
        let (result, pool) = bake.finish();
        self.pool = pool;
        Ok(result)
    }
}
