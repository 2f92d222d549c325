//! Cells whose rays are cast together: dispatched, read back, and made into moments.

use aogrid_bake_core::cube_face::texels;
use aogrid_bake_core::{BakeOptions, FaceBits, FaceSums, Moments, RawGrid, fixed_texels};
use aogrid_grid_format::{GridSpec, Method};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use wgpu::{Buffer, BufferUsages};

use super::gpu_data::Scene;
use super::shaders::{FACE_SUMS, RANDOM_SUMS, TEXELS};
use super::{UploadedTree, Variant};
use crate::kernel::Kernel;
use crate::shaders::WORKGROUP;
use crate::work::{Extent, Work};
use crate::{BakeError, Context};

/// Cells that are read back at a time, at most.
const MOST_CELLS: usize = 1 << 20;

/// What a ray costs, about, see [`Pace`](crate::pace::Pace): visits of nodes.
const VISITS: f64 = 100.0;

/// Steps in 1 of a random direction's component.
const STEPS: f64 = (1_u32 << 30) as f64;

/// One kind of cells, ready to be dispatched.
pub(super) struct Job<'a> {
    pub variant: Variant,
    pub directions: bool,
    pub scene: Scene,
    pub spec: &'a GridSpec,
    /// Between the samples and the sums.
    pub tables: Vec<Buffer>,
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

    pub(super) fn cells_at_once(&self, context: &Context) -> usize {
        let limit = context.device.limits().max_storage_buffer_binding_size as usize;
        MOST_CELLS.min(limit / (4 * self.words_of_bits().max(self.sums())))
    }

    /// The sums of the cells, and their bits where they are asked for.
    pub(super) fn cast(
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

    pub(super) fn take(&self, sums: &[u32], raw: &mut RawGrid) {
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

    pub(super) fn take_bits(&self, words: &[u32], first: usize, bits: &mut FaceBits) {
        for (idx, &word) in words.iter().enumerate() {
            let (cell, word_idx) = (idx / self.words_of_bits(), idx % self.words_of_bits());
            debug_assert!(first + cell < self.spec.cell_count());
            for bit in (0..u32::BITS as usize).filter(|bit| word >> bit & 1 != 0) {
                bits.set(first + cell, word_idx * u32::BITS as usize + bit);
            }
        }
    }
}

pub(super) fn scene(mesh: &UploadedTree, options: &BakeOptions) -> Scene {
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
pub(super) fn tables(work: &Work<'_>, method: Method) -> Vec<Buffer> {
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
