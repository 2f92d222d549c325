//! Visibility by rays over a tree, on the GPU: for a maximum distance, for random directions,
//! for what the sweep cannot take, and to check the sweep by.
//!
//! The tree is walked without a stack: its nodes lie in the order of a walk that visits all of
//! them, and each knows where that walk goes on if its box is missed. An invocation then needs
//! no array of its own, and any order will do for a ray that only asks whether there is a hit.
//! Single floats would not do for coordinates: samples and triangles lie on one integer
//! lattice, and a ray sees differences of those, rounded once. What it hits then differs from
//! double precision only where it passes an edge within some 10⁻⁷ of its distance.

mod tree;

use aogrid_bake_core::cube_face::texels;
use aogrid_bake_core::{
    BakeOptions, FaceBits, FaceSums, Moments, Observer, RawGrid, TriangleMesh, fixed_texels,
};
use aogrid_grid_format::{GridSpec, Method};
use bytemuck::{Pod, Zeroable};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use wgpu::{Buffer, BufferUsages};

use crate::kernel::{Binding, Kernel};
use crate::pace::Pace;
use crate::shaders::{Constants, Shader, WORKGROUP};
use crate::work::{Extent, Work};
use crate::{BakeError, Context};
use tree::Tree;

/// Cells that are read back at a time, at most.
const MOST_CELLS: usize = 1 << 20;

/// What a ray costs, about, see [`Pace`]: visits of nodes.
const VISITS: f64 = 100.0;

/// Texels of a workgroup: those of six faces of 16². Mesa's software stops the loops of an
/// invocation after 65,535 rounds, silently, and no texel's walk comes near a 24th of that.
const TEXELS: u32 = 1536;

/// Random rays a cell, at most, on software: for the same reason.
const MOST_RAYS_ON_SOFTWARE: u32 = 1 << 14;

/// Numbers a cell: count, a and the three of m; or count and three sums of two words.
const FACE_SUMS: usize = 5;
const RANDOM_SUMS: usize = 7;

/// Steps in 1 of a random direction's component.
const STEPS: f64 = (1_u32 << 30) as f64;

/// `Scene` of `any_hit.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Scene {
    cells: [u32; 3],
    n_directions: u32,
    first_cell: u32,
    n_cells: u32,
    n_nodes: u32,
    reach: f32,
    key: [u32; 8],
    n_triangles: u32,
    padding: [u32; 3],
}

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

/// One kind of cells, ready to be dispatched.
struct Job<'a> {
    variant: Variant,
    directions: bool,
    scene: Scene,
    spec: &'a GridSpec,
    /// Between the samples and the sums.
    tables: Vec<Buffer>,
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

impl Job<'_> {
    fn sums(&self) -> usize {
        match self.variant {
            Variant::Random => RANDOM_SUMS,
            Variant::Faces | Variant::FacesWithBits | Variant::Naive => FACE_SUMS,
        }
    }

    fn words_of_bits(&self) -> usize {
        match self.variant {
            Variant::FacesWithBits => self.scene.n_directions.div_ceil(u32::BITS) as usize,
            Variant::Faces | Variant::Random | Variant::Naive => 0,
        }
    }

    fn cells_at_once(&self, context: &Context) -> usize {
        let limit = context.device.limits().max_storage_buffer_binding_size as usize;
        MOST_CELLS.min(limit / (4 * self.words_of_bits().max(self.sums())))
    }

    /// The sums of the cells, and their bits where they are asked for.
    fn cast(
        &self,
        work: &mut Work<'_>,
        kernel: &Kernel,
        mesh: &UploadedTree,
    ) -> Result<Vec<Vec<u32>>, BakeError> {
        let n = self.scene.n_cells as usize;
        let frame = bytemuck::bytes_of(&self.scene);
        let scene = work.upload("scene", BufferUsages::UNIFORM, frame);
        let results = [n * self.sums() * 4, n * self.words_of_bits() * 4];
        let buffers = results.map(|bytes| {
            let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
            work.context()
                .device
                .create_buffer(&wgpu::BufferDescriptor {
                    label: Some("sums"),
                    size: bytes.max(16) as u64,
                    usage,
                    mapped_at_creation: false,
                })
        });
        let mut bindings = vec![&scene, &mesh.nodes, &mesh.corners, &mesh.samples];
        bindings.extend(&self.tables);
        bindings.push(&buffers[0]);
        if matches!(self.variant, Variant::Faces | Variant::FacesWithBits) {
            bindings.push(&buffers[1]);
        }
        let bound = work.bind(kernel, &bindings);
        let rays = f64::from(self.scene.n_directions);
        let (n, units) = match self.variant {
            Variant::Naive => {
                let cells = f64::from(WORKGROUP);
                let triangles = f64::from(mesh.n_triangles);
                (
                    self.scene.n_cells.div_ceil(WORKGROUP),
                    cells * rays * triangles,
                )
            }
            _ => (self.scene.n_cells, rays * VISITS),
        };
        let y = match self.variant {
            Variant::Faces | Variant::FacesWithBits => self.scene.n_directions.div_ceil(TEXELS),
            Variant::Random | Variant::Naive => 1,
        };
        work.dispatch(kernel, &bound, Extent { n, y, z: 1, units })?;
        let wanted: Vec<_> = buffers
            .iter()
            .zip(results)
            .filter(|(_, bytes)| *bytes > 0)
            .map(|(buffer, bytes)| (buffer, bytes as u64))
            .collect();
        let read = work.read(&wanted)?;
        Ok(read
            .iter()
            .map(|b| bytemuck::pod_collect_to_vec(b))
            .collect())
    }

    fn take(&self, sums: &[u32], raw: &mut RawGrid) {
        let n = self.scene.n_cells as usize;
        for cell in 0..n {
            let of = |plane: usize| sums[plane * n + cell];
            raw.counts.push(of(0));
            raw.moments.push(match self.variant {
                Variant::Random => self.random_moments(of),
                _ => FaceSums {
                    count: of(0),
                    a: of(1).cast_signed(),
                    m: [2, 3, 4].map(|plane| of(plane).cast_signed()),
                }
                .moments(self.scene.n_directions),
            });
        }
    }

    fn random_moments(&self, of: impl Fn(usize) -> u32) -> Moments {
        let (count, rays) = (f64::from(of(0)), f64::from(self.scene.n_directions));
        let mean = |plane: usize| {
            let sum = f64::from(of(plane + 3)) * (u32::MAX as f64 + 1.0) + f64::from(of(plane));
            // Each of the summands was one more.
            ((sum / STEPS - count) / rays) as f32
        };
        let is_full = of(0) == self.scene.n_directions;
        Moments {
            a: (count / rays) as f32,
            // Every direction hidden is the whole sphere, which points nowhere.
            m: match is_full || !self.directions {
                true => [0.0; 3],
                false => [1, 2, 3].map(mean),
            },
        }
    }

    fn take_bits(&self, words: &[u32], first: usize, bits: &mut FaceBits) {
        for (idx, &word) in words.iter().enumerate() {
            let (cell, word_idx) = (idx / self.words_of_bits(), idx % self.words_of_bits());
            debug_assert!(first + cell < self.spec.cell_count());
            for bit in (0..u32::BITS as usize).filter(|bit| word >> bit & 1 != 0) {
                bits.set(first + cell, word_idx * u32::BITS as usize + bit);
            }
        }
    }
}

fn scene(mesh: &UploadedTree, options: &BakeOptions) -> Scene {
    let seed = match options.method {
        Method::Rays { seed, .. } => seed,
        Method::Faces { .. } => 0,
    };
    let key = ChaCha8Rng::seed_from_u64(seed).get_seed();
    // Farther than anything on the lattice, and still a number after it is multiplied.
    let unlimited = (1_u64 << 33) as f32;
    Scene {
        cells: mesh.spec.resolution(),
        n_directions: options.method.directions(),
        first_cell: 0,
        n_cells: 0,
        n_nodes: mesh.n_nodes,
        reach: options
            .max_distance
            .map_or(unlimited, |d| (f64::from(d) * mesh.scale) as f32)
            .min(unlimited),
        key: std::array::from_fn(|i| {
            u32::from_le_bytes(std::array::from_fn(|byte| key[4 * i + byte]))
        }),
        n_triangles: mesh.n_triangles,
        padding: [0; 3],
    }
}

/// Directions and shares of texels; random directions need none.
fn tables(work: &Work<'_>, method: Method) -> Vec<Buffer> {
    let Method::Faces { size } = method else {
        return Vec::new();
    };
    let directions: Vec<[f32; 4]> = texels(size)
        .iter()
        .map(|texel| {
            let [x, y, z] = texel.direction;
            [x, y, z, (x * x + y * y + z * z).sqrt()].map(|v| v as f32)
        })
        .collect();
    let shares: Vec<[i32; 4]> = fixed_texels(size)
        .iter()
        .map(|texel| [texel.m[0], texel.m[1], texel.m[2], texel.a])
        .collect();
    let storage = |label, bytes: &[u8]| work.upload(label, BufferUsages::STORAGE, bytes);
    vec![
        storage("directions", bytemuck::cast_slice(&directions)),
        storage("shares", bytemuck::cast_slice(&shares)),
    ]
}

fn compile(device: &wgpu::Device, variant: Variant, directions: bool) -> Kernel {
    use Binding::{Read, Uniform, Write};
    let bindings: &[Binding] = match variant {
        Variant::Random => &[Uniform, Read, Read, Read, Write],
        Variant::Naive => &[Uniform, Read, Read, Read, Read, Read, Write],
        _ => &[Uniform, Read, Read, Read, Read, Read, Write, Write],
    };
    let shader = shader(variant, directions);
    Kernel::new(device, &shader, shader.entry_points[0], bindings)
}

/// All of them, in every variant.
pub(crate) fn shaders() -> Vec<Shader> {
    vec![
        shader(Variant::Faces, true),
        shader(Variant::Faces, false),
        shader(Variant::FacesWithBits, true),
        shader(Variant::Random, true),
        shader(Variant::Random, false),
        shader(Variant::Naive, true),
    ]
}

fn shader(variant: Variant, directions: bool) -> Shader {
    let constants = Constants::default()
        .unsigned("WORKGROUP", WORKGROUP)
        .boolean("DIRECTIONS", directions)
        .unsigned("INNER", tree::INNER)
        .unsigned("TRIANGLE_BITS", tree::TRIANGLE_BITS)
        .unsigned("FIRST_TRIANGLE", (1 << tree::TRIANGLE_BITS) - 1)
        // Less than this moves a ray by less than the boxes' padding, all the way.
        .float("LEAST_SLOPE", 1e-12)
        // Two products and a difference, half a step of 2⁻²³ each, and as much again.
        .float("BOX_SLACK", 1.0 + 1.0 / (1 << 20) as f32);
    let chunk = include_str!("../chunk.wgsl");
    let any_hit = include_str!("any_hit.wgsl");
    let name = match (variant, directions) {
        (Variant::Faces, true) => "rays: faces",
        (Variant::Faces, false) => "rays: faces without directions",
        (Variant::FacesWithBits, _) => "rays: faces with bits",
        (Variant::Random, true) => "rays: Monte Carlo",
        (Variant::Random, false) => "rays: Monte Carlo without directions",
        (Variant::Naive, _) => "naive",
    };
    if variant == Variant::Random {
        let parts = [
            chunk,
            any_hit,
            include_str!("../sweep/integers.wgsl"),
            include_str!("monte_carlo.wgsl"),
        ];
        let constants = constants
            .unsigned("SUMS", RANDOM_SUMS as u32)
            .float("PRODUCT_ROUNDING", 1.0);
        return Shader {
            name,
            source: constants.before(&parts),
            entry_points: vec!["monte_carlo"],
        };
    }
    if variant == Variant::Naive {
        return Shader {
            name,
            source: constants.before(&[chunk, any_hit, include_str!("naive.wgsl")]),
            entry_points: vec!["naive"],
        };
    }
    let constants = constants
        .boolean("BITS", variant == Variant::FacesWithBits)
        .unsigned("TEXELS", TEXELS);
    Shader {
        name,
        source: constants.before(&[chunk, any_hit, include_str!("faces.wgsl")]),
        entry_points: vec!["faces"],
    }
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use super::tree::Node;
    use super::*;
    use crate::layout_test::assert_layout;

    #[test]
    fn structures_are_laid_out_as_shaders_see_them() {
        let shader = shader(Variant::Random, true);
        let scene = [
            ("cells", offset_of!(Scene, cells)),
            ("n_directions", offset_of!(Scene, n_directions)),
            ("first_cell", offset_of!(Scene, first_cell)),
            ("n_cells", offset_of!(Scene, n_cells)),
            ("n_nodes", offset_of!(Scene, n_nodes)),
            ("reach", offset_of!(Scene, reach)),
            ("key", offset_of!(Scene, key)),
            ("n_triangles", offset_of!(Scene, n_triangles)),
        ];
        assert_layout(&shader, "Scene", size_of::<Scene>(), &scene);
        let node = [
            ("low", offset_of!(Node, low)),
            ("skip", offset_of!(Node, skip)),
            ("high", offset_of!(Node, high)),
            ("triangles", offset_of!(Node, triangles)),
        ];
        assert_layout(&shader, "Node", size_of::<Node>(), &node);
    }
}
