//! Batches of cells whose rays are cast together: dispatched, read back, and turned into moments.

use aogrid_bake_core::cube_face::texels;
use aogrid_bake_core::{BakeOptions, FaceBits, FaceSums, Moments, RawGrid, fixed_texels};
use aogrid_grid_format::{GridSpec, Sampling};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use wgpu::{Buffer, BufferUsages};

use super::gpu_data::Scene;
use super::shaders::{FACE_SUMS, MONTE_CARLO_SUMS, TEXELS_PER_WORKGROUP};
use super::{RAY_UNITS, UNLIMITED, UploadedTree, Variant};
use crate::kernel::Kernel;
use crate::shaders::WORKGROUP;
use crate::work::{Extent, Submitter};
use crate::{BakeError, Context};

/// The largest number of cells that are read back together.
const MAX_BATCH_CELLS: usize = 1 << 20;

/// The fixed-point representation of 1 in the components of Monte Carlo directions.
const FIXED_POINT_ONE: f64 = (1_u32 << 30) as f64;

/// A batch of cells to cast rays for.
pub(super) struct RayBatch<'a> {
    pub variant: Variant,
    pub directions: bool,
    pub scene: Scene,
    pub spec: &'a GridSpec,
    /// The buffers that are bound between the sample positions and the sums.
    pub tables: Vec<Buffer>,
}

impl RayBatch<'_> {
    fn numbers_per_cell(&self) -> usize {
        match self.variant {
            Variant::MonteCarlo => MONTE_CARLO_SUMS,
            Variant::Faces | Variant::FacesWithBits | Variant::Naive => FACE_SUMS,
        }
    }

    fn bit_words_per_cell(&self) -> usize {
        match self.variant {
            Variant::FacesWithBits => self.scene.n_directions.div_ceil(u32::BITS) as usize,
            Variant::Faces | Variant::MonteCarlo | Variant::Naive => 0,
        }
    }

    /// Returns the largest number of cells in a batch whose results fit a buffer binding.
    pub(super) fn max_cells(&self, context: &Context) -> usize {
        let limit = context.device.limits().max_storage_buffer_binding_size as usize;
        MAX_BATCH_CELLS.min(limit / (4 * self.bit_words_per_cell().max(self.numbers_per_cell())))
    }

    /// Casts the rays and returns the sums of the cells, and their bits if the variant has them.
    pub(super) async fn cast(
        &self,
        submitter: &mut Submitter<'_>,
        kernel: &Kernel,
        mesh: &UploadedTree,
    ) -> Result<Vec<Vec<u32>>, BakeError> {
        let n = self.scene.n_cells as usize;
        let bytes = bytemuck::bytes_of(&self.scene);
        let scene = submitter.upload("scene", BufferUsages::UNIFORM, bytes);
        let result_bytes = [
            n * self.numbers_per_cell() * 4,
            n * self.bit_words_per_cell() * 4,
        ];
        let buffers = result_bytes.map(|bytes| {
            let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
            submitter
                .context()
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
        let bindings = submitter.bind(kernel, &bindings);
        submitter
            .dispatch(kernel, &bindings, self.extent(mesh))
            .await?;
        let used: Vec<_> = buffers
            .iter()
            .zip(result_bytes)
            .filter(|(_, bytes)| *bytes > 0)
            .map(|(buffer, bytes)| (buffer, bytes as u64))
            .collect();
        let read = submitter.read(&used).await?;
        Ok(read
            .iter()
            .map(|b| bytemuck::pod_collect_to_vec(b))
            .collect())
    }

    /// Returns the workgroups of the variant.
    fn extent(&self, mesh: &UploadedTree) -> Extent {
        let rays = f64::from(self.scene.n_directions);
        // The naive kernel has an invocation per cell, the others at least a workgroup.
        let (n, units) = match self.variant {
            Variant::Naive => {
                let cells = f64::from(WORKGROUP);
                let n = self.scene.n_cells.div_ceil(WORKGROUP);
                (n, cells * rays * f64::from(mesh.n_triangles))
            }
            _ => (self.scene.n_cells, rays * RAY_UNITS),
        };
        let y = match self.variant {
            Variant::Faces | Variant::FacesWithBits => {
                self.scene.n_directions.div_ceil(TEXELS_PER_WORKGROUP)
            }
            Variant::MonteCarlo | Variant::Naive => 1,
        };
        Extent { n, y, z: 1, units }
    }

    /// Appends the counts and moments of this batch's cells to a grid.
    pub(super) fn append_moments(&self, sums: &[u32], raw: &mut RawGrid) {
        let n = self.scene.n_cells as usize;
        for cell in 0..n {
            let number = |plane: usize| sums[plane * n + cell];
            raw.counts.push(number(0));
            raw.moments.push(match self.variant {
                Variant::MonteCarlo => self.monte_carlo_moments(number),
                _ => FaceSums {
                    count: number(0),
                    a: number(1).cast_signed(),
                    m: [2, 3, 4].map(|plane| number(plane).cast_signed()),
                }
                .moments(self.scene.n_directions),
            });
        }
    }

    /// Returns the moments of a cell; `number` gives the cell's number in each plane of the sums.
    fn monte_carlo_moments(&self, number: impl Fn(usize) -> u32) -> Moments {
        let (count, rays) = (f64::from(number(0)), f64::from(self.scene.n_directions));
        let mean = |plane: usize| {
            let sum =
                f64::from(number(plane + 3)) * (u32::MAX as f64 + 1.0) + f64::from(number(plane));
            // The shader adds 1 to each summand to keep it positive.
            ((sum / FIXED_POINT_ONE - count) / rays) as f32
        };
        let is_full = number(0) == self.scene.n_directions;
        Moments {
            a: (count / rays) as f32,
            // If every direction is occluded, the exact moment 1 is zero: that of the full sphere.
            m: match is_full || !self.directions {
                true => [0.0; 3],
                false => [1, 2, 3].map(mean),
            },
        }
    }

    /// Stores the bits of this batch's cells, the first of which is cell `first` of the grid.
    pub(super) fn store_bits(&self, words: &[u32], first: usize, bits: &mut FaceBits) {
        for (idx, &word) in words.iter().enumerate() {
            let (cell, word_idx) = (
                idx / self.bit_words_per_cell(),
                idx % self.bit_words_per_cell(),
            );
            debug_assert!(first + cell < self.spec.cell_count());
            for bit in (0..u32::BITS as usize).filter(|bit| word >> bit & 1 != 0) {
                bits.set(first + cell, word_idx * u32::BITS as usize + bit);
            }
        }
    }
}

/// Returns the uniforms of a bake, without the range of cells of a batch.
pub(super) fn scene(mesh: &UploadedTree, options: &BakeOptions) -> Scene {
    let seed = match options.sampling {
        Sampling::MonteCarlo { seed, .. } => seed,
        Sampling::CubeFaces { .. } => 0,
    };
    let key = ChaCha8Rng::seed_from_u64(seed).get_seed();
    Scene {
        cells: mesh.spec.resolution(),
        n_directions: options.sampling.directions(),
        first_cell: 0,
        n_cells: 0,
        n_nodes: mesh.n_nodes,
        max_distance: options
            .max_distance
            .map_or(UNLIMITED, |d| (f64::from(d) * mesh.scale) as f32)
            .min(UNLIMITED),
        key: std::array::from_fn(|i| {
            u32::from_le_bytes(std::array::from_fn(|byte| key[4 * i + byte]))
        }),
        n_triangles: mesh.n_triangles,
        padding: [0; 3],
    }
}

/// Returns the tables of the directions and moments of texels; Monte Carlo sampling needs none.
pub(super) fn tables(submitter: &Submitter<'_>, sampling: Sampling) -> Vec<Buffer> {
    let Sampling::CubeFaces { size } = sampling else {
        return Vec::new();
    };
    let directions: Vec<[f32; 4]> = texels(size)
        .iter()
        .map(|texel| {
            let [x, y, z] = texel.direction;
            [x, y, z, (x * x + y * y + z * z).sqrt()].map(|v| v as f32)
        })
        .collect();
    let moments: Vec<[i32; 4]> = fixed_texels(size)
        .iter()
        .map(|texel| [texel.m[0], texel.m[1], texel.m[2], texel.a])
        .collect();
    let storage = |label, bytes: &[u8]| submitter.upload(label, BufferUsages::STORAGE, bytes);
    vec![
        storage("directions", bytemuck::cast_slice(&directions)),
        storage("texel moments", bytemuck::cast_slice(&moments)),
    ]
}
