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

mod bake;
mod gpu_data;
mod kernels;
mod mesh;
mod pass;
mod piercings;
mod plan;
mod view;

use std::sync::OnceLock;

use aogrid_bake_core::{FaceBits, Observer, PreparedMesh, RawGrid};
use aogrid_grid_format::FACE_SIZES;

use crate::pace::Pace;
use crate::store::Store;
use crate::work::Work;
use crate::{BakeError, Context};
use bake::Bake;
use kernels::Kernels;
pub(crate) use kernels::shaders;
use mesh::Mesh;

/// Bakes faces by the direction sweep, again and again with the same buffers.
pub struct Sweeper {
    context: Context,
    kernels: AllKernels,
    store: Store,
    pace: Pace,
}

/// Compiled when they are first needed: for counters that are bytes or words, without directions
/// or with them.
type AllKernels = [[OnceLock<Kernels>; 2]; 2];

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
        // What a bake that ended early has left in the counters must not be seen again.
        let store = std::mem::take(&mut self.store);
        let cells = mesh.mesh.spec().cell_count();
        let work = Work::new(&self.context, &mut self.pace, observer, cells);
        let mut bake = Bake::new(&self.kernels, store, work, mesh, request);
        bake.run()?;
        let (found, store) = bake.finish();
        self.store = store;
        Ok(found)
    }
}
