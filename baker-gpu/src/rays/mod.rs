//! Visibility by ray casting over a BVH on the GPU: for a maximum distance, for Monte Carlo
//! directions, for meshes that the sweep does not support, and to verify the sweep.
//!
//! The BVH is traversed without a stack: its nodes are stored in depth-first order, and each has a
//! link to the node that follows if its box is missed. An invocation then needs no array of its
//! own, and an any-hit query may visit the nodes in any order. Single floats are too coarse for
//! coordinates, so sample positions and triangles lie on a common integer lattice, and a ray uses
//! differences on it, rounded once. Its result then differs from double precision only where it
//! passes an edge within some 10⁻⁷ of its distance.

mod gpu_data;
mod job;
mod points;
mod shaders;
mod tree;

use aogrid_bake_core::{BakeOptions, FaceBits, Observer, PlanError, RawGrid, TriangleMesh};
use aogrid_grid_format::{GridSpec, Sampling};
use wgpu::{Buffer, BufferUsages};

use crate::kernel::Kernel;
use crate::pace::SubmissionPacer;
use crate::work::Submitter;
use crate::{BakeError, Context};
use job::{RayBatch, scene, tables};
pub use points::PointBake;
use shaders::compile;
pub(crate) use shaders::shaders;
use tree::Bvh;

/// The largest number of Monte Carlo rays per cell on a software rasterizer, which stops long
/// loops (see [`shaders::TEXELS_PER_WORKGROUP`]).
const MAX_SOFTWARE_RAYS: u32 = 1 << 14;

/// The approximate cost of a ray in visited nodes, see [`SubmissionPacer`].
const RAY_UNITS: f64 = 100.0;

/// The maximum distance, in lattice steps, where there is none: farther than anything on the lattice, and
/// small enough that products of it stay finite.
const UNLIMITED: f32 = (1_u64 << 33) as f32;

/// Bakes by ray casting, and keeps its pipelines between bakes.
pub struct Caster {
    context: Context,
    kernels: [[Option<Kernel>; 2]; 4],
    /// The kernel of points on surfaces.
    points: Option<Kernel>,
    pacer: SubmissionPacer,
}

/// The BVH of a mesh and the sample positions of a grid, in the device's memory.
pub struct UploadedTree {
    spec: GridSpec,
    nodes: Buffer,
    corners: Buffer,
    samples: Buffer,
    n_nodes: u32,
    n_triangles: u32,
    scale: f64,
}

/// The variants of the kernels, by the directions and results of a cell.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Variant {
    Faces,
    FacesWithBits,
    MonteCarlo,
    Naive,
}

impl Caster {
    /// Creates a caster. Pipelines are created on first use.
    pub fn new(context: &Context) -> Self {
        Self {
            context: context.clone(),
            kernels: Default::default(),
            points: None,
            pacer: SubmissionPacer::default(),
        }
    }

    /// Builds the BVH and copies it to the device.
    ///
    /// # Errors
    ///
    /// The BVH does not fit, or the device fails.
    pub async fn upload(
        &mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        sample_offset: [f32; 3],
    ) -> Result<UploadedTree, BakeError> {
        let bvh = Bvh::new(mesh, &spec, sample_offset);
        self.check_size(&bvh)?;
        let unobserved = aogrid_bake_core::UNOBSERVED;
        let mut submitter = Submitter::new(&self.context, &mut self.pacer, unobserved, 0);
        let storage = |label, bytes: &[u8]| submitter.upload(label, BufferUsages::STORAGE, bytes);
        let uploaded = UploadedTree {
            spec,
            nodes: storage("nodes", bytemuck::cast_slice(&bvh.nodes)),
            corners: storage("corners", bytemuck::cast_slice(&bvh.corners)),
            samples: storage("samples", bytemuck::cast_slice(&bvh.samples)),
            n_nodes: bvh.nodes.len() as u32,
            n_triangles: bvh.corners.len() as u32,
            scale: bvh.scale,
        };
        submitter.check().await?;
        Ok(uploaded)
    }

    /// Bakes the moments of every cell. The same input gives the same bits on one device.
    /// Without `directions` every moment 1 is zero: the papers' occlusion-only variant.
    ///
    /// # Errors
    ///
    /// An option is out of range, the observer cancels, or the device fails.
    pub async fn bake(
        &mut self,
        mesh: &UploadedTree,
        options: &BakeOptions,
        directions: bool,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        let variant = match options.sampling {
            Sampling::CubeFaces { .. } => Variant::Faces,
            Sampling::MonteCarlo { .. } => Variant::MonteCarlo,
        };
        Ok(self
            .run(mesh, options, variant, directions, observer)
            .await?
            .0)
    }

    /// Bakes as [`Caster::bake`] with cube faces, and also returns the faces.
    ///
    /// # Errors
    ///
    /// The errors of [`Caster::bake`].
    ///
    /// # Panics
    ///
    /// Panics unless the sampling is cube faces: Monte Carlo directions form no image.
    pub async fn bake_with_bits(
        &mut self,
        mesh: &UploadedTree,
        options: &BakeOptions,
        observer: Observer<'_>,
    ) -> Result<(RawGrid, FaceBits), BakeError> {
        assert!(matches!(options.sampling, Sampling::CubeFaces { .. }));
        self.run(mesh, options, Variant::FacesWithBits, true, observer)
            .await
    }

    /// Bakes cube faces by brute force, without a BVH and with an invocation per cell: a simple
    /// reference for the other kernels, for tiny meshes. On a software rasterizer the product of
    /// texels and triangles is limited to 65,535.
    ///
    /// # Errors
    ///
    /// The errors of [`Caster::bake`].
    ///
    /// # Panics
    ///
    /// Panics unless the sampling is cube faces.
    pub async fn bake_naively(
        &mut self,
        mesh: &UploadedTree,
        options: &BakeOptions,
    ) -> Result<RawGrid, BakeError> {
        assert!(matches!(options.sampling, Sampling::CubeFaces { .. }));
        let unobserved = aogrid_bake_core::UNOBSERVED;
        Ok(self
            .run(mesh, options, Variant::Naive, true, unobserved)
            .await?
            .0)
    }

    /// Checks that a BVH fits the device's buffers.
    fn check_size(&self, bvh: &Bvh) -> Result<(), BakeError> {
        let limit = self.context.device.limits().max_storage_buffer_binding_size;
        let nodes: &[u8] = bytemuck::cast_slice(&bvh.nodes);
        let corners: &[u8] = bytemuck::cast_slice(&bvh.corners);
        for (what, bytes) in [("the BVH's nodes", nodes), ("the BVH's triangles", corners)] {
            let bytes = bytes.len() as u64;
            if bytes > limit {
                return Err(BakeError::TooLarge { what, bytes, limit });
            }
        }
        Ok(())
    }

    fn check_ray_count(&self, sampling: Sampling) -> Result<(), BakeError> {
        let is_software = self.context.adapter().device_type == wgpu::DeviceType::Cpu;
        match sampling {
            Sampling::MonteCarlo { count, .. } if is_software && count > MAX_SOFTWARE_RAYS => {
                Err(BakeError::Refused(format!(
                    "{count} rays per cell are more than {MAX_SOFTWARE_RAYS}, the maximum of a \
                     software rasterizer: bake on the CPU"
                )))
            }
            Sampling::MonteCarlo { .. } | Sampling::CubeFaces { .. } => Ok(()),
        }
    }

    async fn run(
        &mut self,
        mesh: &UploadedTree,
        options: &BakeOptions,
        variant: Variant,
        directions: bool,
        observer: Observer<'_>,
    ) -> Result<(RawGrid, FaceBits), BakeError> {
        options.validate().map_err(PlanError::from)?;
        self.check_ray_count(options.sampling)?;
        let Self {
            context,
            kernels,
            pacer,
            ..
        } = self;
        let total = mesh.spec.cell_count();
        let mut submitter = Submitter::new(context, pacer, observer, total);
        let kernel = &mut kernels[variant as usize][usize::from(directions)];
        let kernel = &*kernel.get_or_insert_with(|| compile(&context.device, variant, directions));
        let mut batch = RayBatch {
            variant,
            directions,
            scene: scene(mesh, options),
            spec: &mesh.spec,
            tables: tables(&submitter, options.sampling),
        };
        let mut raw = RawGrid {
            spec: mesh.spec,
            moments: Vec::with_capacity(total),
            counts: Vec::with_capacity(total),
            directions: options.sampling.directions(),
            layers: None,
        };
        let (cells, size) = match (variant, options.sampling) {
            (Variant::FacesWithBits, Sampling::CubeFaces { size }) => (total, size),
            _ => (0, 1),
        };
        let mut bits = FaceBits::new(cells, size);
        for first in (0..total).step_by(batch.max_cells(context)) {
            let n = batch.max_cells(context).min(total - first);
            batch.scene.first_cell = first as u32;
            batch.scene.n_cells = n as u32;
            let results = batch.cast(&mut submitter, kernel, mesh).await?;
            submitter.set_done(first + n);
            batch.append_moments(&results[0], &mut raw);
            if let Some(words) = results.get(1) {
                batch.store_bits(words, first, &mut bits);
            }
        }
        submitter.flush().await?;
        Ok((raw, bits))
    }
}
