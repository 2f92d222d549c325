//! Visibility by rays over a tree, on the GPU: for a maximum distance, for random directions,
//! for what the sweep cannot take, and to check the sweep by.
//!
//! The tree is walked without a stack: its nodes lie in the order of a walk that visits all of
//! them, and each knows where that walk goes on if its box is missed. An invocation then needs
//! no array of its own, and any order will do for a ray that only asks whether there is a hit.
//! Single floats would not do for coordinates: samples and triangles lie on one integer
//! lattice, and a ray sees differences of those, rounded once. What it hits then differs from
//! double precision only where it passes an edge within some 10⁻⁷ of its distance.

mod gpu_data;
mod job;
mod shaders;
mod tree;

use aogrid_bake_core::{BakeOptions, FaceBits, Observer, RawGrid, TriangleMesh};
use aogrid_grid_format::{GridSpec, Method};
use wgpu::{Buffer, BufferUsages};

use crate::kernel::Kernel;
use crate::pace::Pace;
use crate::work::Work;
use crate::{BakeError, Context};
use job::{Job, scene, tables};
use shaders::compile;
pub(crate) use shaders::shaders;
use tree::Tree;

/// Random rays a cell, at most, on software: for the same reason.
const MOST_RAYS_ON_SOFTWARE: u32 = 1 << 14;

/// Bakes by rays; keeps what it has compiled.
pub struct Caster {
    context: Context,
    kernels: [[Option<Kernel>; 2]; 4],
    pace: Pace,
}

/// A tree over a mesh and the samples of a grid, in the device's memory.
pub struct UploadedTree {
    spec: GridSpec,
    nodes: Buffer,
    corners: Buffer,
    samples: Buffer,
    n_nodes: u32,
    n_triangles: u32,
    scale: f64,
}

/// What a cell's directions are.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Variant {
    Faces,
    FacesWithBits,
    Random,
    Naive,
}

impl Caster {
    /// Without pipelines yet.
    pub fn new(context: &Context) -> Self {
        Self {
            context: context.clone(),
            kernels: Default::default(),
            pace: Pace::default(),
        }
    }

    /// Builds the tree and copies it to the device.
    ///
    /// # Errors
    ///
    /// It does not fit, or the device fails.
    pub fn upload(
        &mut self,
        mesh: &TriangleMesh,
        spec: GridSpec,
        sample_offset: [f32; 3],
    ) -> Result<UploadedTree, BakeError> {
        let tree = Tree::new(mesh, &spec, sample_offset);
        let limit = self.context.device.limits().max_storage_buffer_binding_size;
        let nodes: &[u8] = bytemuck::cast_slice(&tree.nodes);
        let corners: &[u8] = bytemuck::cast_slice(&tree.corners);
        for (what, bytes) in [
            ("the tree's nodes", nodes),
            ("the tree's triangles", corners),
        ] {
            let bytes = bytes.len() as u64;
            if bytes > limit {
                return Err(BakeError::TooLarge { what, bytes, limit });
            }
        }
        let unobserved = aogrid_bake_core::UNOBSERVED;
        let mut work = Work::new(&self.context, &mut self.pace, unobserved, 0);
        let storage = |label, bytes: &[u8]| work.upload(label, BufferUsages::STORAGE, bytes);
        let uploaded = UploadedTree {
            spec,
            nodes: storage("nodes", nodes),
            corners: storage("corners", corners),
            samples: storage("samples", bytemuck::cast_slice(&tree.samples)),
            n_nodes: tree.nodes.len() as u32,
            n_triangles: tree.corners.len() as u32,
            scale: tree.scale,
        };
        work.check()?;
        Ok(uploaded)
    }

    /// Bakes the moments of every cell. The same input gives the same bits on one device.
    /// Without `directions` every moment 1 is zero: the papers' occlusion-only variant.
    ///
    /// # Errors
    ///
    /// An option out of its range, cancellation, or the device fails.
    pub fn bake(
        &mut self,
        mesh: &UploadedTree,
        options: &BakeOptions,
        directions: bool,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        let variant = match options.method {
            Method::Faces { .. } => Variant::Faces,
            Method::Rays { .. } => Variant::Random,
        };
        Ok(self.run(mesh, options, variant, directions, observer)?.0)
    }

    /// [`Caster::bake`] of six faces a cell, and the faces themselves.
    ///
    /// # Errors
    ///
    /// As [`Caster::bake`].
    ///
    /// # Panics
    ///
    /// If the method is not faces: random directions are no image.
    pub fn bake_with_bits(
        &mut self,
        mesh: &UploadedTree,
        options: &BakeOptions,
        observer: Observer<'_>,
    ) -> Result<(RawGrid, FaceBits), BakeError> {
        assert!(matches!(options.method, Method::Faces { .. }));
        self.run(mesh, options, Variant::FacesWithBits, true, observer)
    }

    /// [`Caster::bake`] of six faces a cell without a tree, an invocation a cell: for tiny
    /// meshes (on software of up to 65,535 texels times triangles), to read and to check the
    /// others by.
    ///
    /// # Errors
    ///
    /// As [`Caster::bake`].
    ///
    /// # Panics
    ///
    /// If the method is not faces.
    pub fn bake_naively(
        &mut self,
        mesh: &UploadedTree,
        options: &BakeOptions,
    ) -> Result<RawGrid, BakeError> {
        assert!(matches!(options.method, Method::Faces { .. }));
        let unobserved = aogrid_bake_core::UNOBSERVED;
        Ok(self.run(mesh, options, Variant::Naive, true, unobserved)?.0)
    }

    fn refuse_too_many(&self, method: Method) -> Result<(), BakeError> {
        let is_software = self.context.adapter().device_type == wgpu::DeviceType::Cpu;
        match method {
            Method::Rays { count, .. } if is_software && count > MOST_RAYS_ON_SOFTWARE => {
                Err(BakeError::Refused(format!(
                    "{count} rays a cell are more than {MOST_RAYS_ON_SOFTWARE}, which software \
                     that plays a GPU can take: bake on the CPU"
                )))
            }
            Method::Rays { .. } | Method::Faces { .. } => Ok(()),
        }
    }

    fn run(
        &mut self,
        mesh: &UploadedTree,
        options: &BakeOptions,
        variant: Variant,
        directions: bool,
        observer: Observer<'_>,
    ) -> Result<(RawGrid, FaceBits), BakeError> {
        options.validate()?;
        self.refuse_too_many(options.method)?;
        let Self {
            context,
            kernels,
            pace,
        } = self;
        let total = mesh.spec.cell_count();
        let mut work = Work::new(context, pace, observer, total);
        let kernel = &mut kernels[variant as usize][usize::from(directions)];
        let kernel = &*kernel.get_or_insert_with(|| compile(&context.device, variant, directions));
        let mut job = Job {
            variant,
            directions,
            scene: scene(mesh, options),
            spec: &mesh.spec,
            tables: tables(&work, options.method),
        };
        let mut raw = RawGrid {
            spec: mesh.spec,
            moments: Vec::with_capacity(total),
            counts: Vec::with_capacity(total),
            directions: options.method.directions(),
            layers: None,
        };
        let (cells, size) = match (variant, options.method) {
            (Variant::FacesWithBits, Method::Faces { size }) => (total, size),
            _ => (0, 1),
        };
        let mut bits = FaceBits::new(cells, size);
        for first in (0..total).step_by(job.cells_at_once(context)) {
            let n = job.cells_at_once(context).min(total - first);
            job.scene.first_cell = first as u32;
            job.scene.n_cells = n as u32;
            let found = job.cast(&mut work, kernel, mesh)?;
            work.set_done(first + n);
            job.take(&found[0], &mut raw);
            if let Some(words) = found.get(1) {
                job.take_bits(words, first, &mut bits);
            }
        }
        work.flush()?;
        Ok((raw, bits))
    }
}
