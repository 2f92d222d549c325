//! Rays from points on surfaces, in directions that all points share.

use aogrid_bake_core::surface::{
    Accumulator, Directions, SurfaceOptions, SurfacePoint, SurfaceRecord, shared_directions,
};
use aogrid_bake_core::{Observer, TriangleMesh};
use wgpu::{Buffer, BufferUsages};

use super::gpu_data::Scene;
use super::shaders::{TEXELS_PER_WORKGROUP, compile_points};
use super::tree::{self, Bvh};
use super::{Caster, RAY_UNITS, UNLIMITED};
use crate::BakeError;
use crate::work::{Extent, Submitter};

/// The largest number of points that are read back together.
const MAX_BATCH_POINTS: usize = 1 << 16;

/// The records of a surface bake on the GPU.
#[derive(Clone, Debug)]
pub struct PointBake {
    /// A record for each point, in their order.
    pub records: Vec<SurfaceRecord>,
    /// The number of rays that counted, of all points.
    pub rays: u64,
}

/// All that does not depend on the batch.
struct Job {
    scene: Scene,
    scale: f64,
    center: [f64; 3],
    nodes: Buffer,
    corners: Buffer,
    directions: Buffer,
    n_words: usize,
}

impl Caster {
    /// Bakes the records of `points`, whose positions are relative to the mesh's origin, with the mesh as
    /// the occluder, in shared directions. They differ from the CPU's where a ray passes an edge within
    /// the rounding of single floats.
    ///
    /// # Errors
    ///
    /// An option is out of range or not for the GPU, the tree does not fit, the observer cancels, or the
    /// device fails.
    pub async fn bake_points(
        &mut self,
        mesh: &TriangleMesh,
        points: &[SurfacePoint],
        options: &SurfaceOptions,
        observer: Observer<'_>,
    ) -> Result<PointBake, BakeError> {
        check(options)?;
        let directions = shared_directions(options.rays);
        let (bvh, place) = Bvh::of_points(mesh, points);
        self.check_size(&bvh)?;
        let Self {
            context,
            points: kernel,
            pacer,
            ..
        } = self;
        let mut submitter = Submitter::new(context, pacer, observer, points.len());
        let kernel = &*kernel.get_or_insert_with(|| compile_points(&context.device));
        let job = Job::new(&submitter, &bvh, place, &directions, options);
        let mut bake = PointBake {
            records: Vec::with_capacity(points.len()),
            rays: 0,
        };
        let limit = context.device.limits().max_storage_buffer_binding_size as usize;
        let batch = MAX_BATCH_POINTS.min(limit / (4 * job.n_words).max(32));
        for (idx, of_batch) in points.chunks(batch).enumerate() {
            let buffers = job.buffers(&submitter, of_batch);
            let [samples, axes, scene, bits] = &buffers;
            let bound = [
                scene,
                &job.nodes,
                &job.corners,
                samples,
                axes,
                &job.directions,
                bits,
            ];
            let bindings = submitter.bind(kernel, &bound);
            let extent = Extent {
                n: of_batch.len() as u32,
                y: options.rays.div_ceil(TEXELS_PER_WORKGROUP),
                z: 1,
                units: f64::from(options.rays) * RAY_UNITS,
            };
            submitter.dispatch(kernel, &bindings, extent).await?;
            submitter.set_done(idx * batch + of_batch.len());
            let bytes = (of_batch.len() * job.n_words * 4) as u64;
            let read = submitter.read(&[(bits, bytes)]).await?;
            let words: Vec<u32> = bytemuck::pod_collect_to_vec(&read[0]);
            bake.add(of_batch, &words, &directions, options);
        }
        submitter.flush().await?;
        Ok(bake)
    }
}

fn check(options: &SurfaceOptions) -> Result<(), BakeError> {
    let refused = |why: &str| Err(BakeError::Refused(why.to_owned()));
    if let Err(error) = options.check() {
        return refused(&error.to_string());
    }
    if options.directions != Directions::Shared {
        return refused("on a GPU all points share their directions: bake on the CPU");
    }
    match options.ignore_backfaces {
        true => refused("on a GPU faces occlude from both sides: bake on the CPU"),
        false => Ok(()),
    }
}

impl Job {
    fn new(
        submitter: &Submitter<'_>,
        bvh: &Bvh,
        (center, scale): ([f64; 3], f64),
        directions: &[[f64; 3]],
        options: &SurfaceOptions,
    ) -> Self {
        let single = |d: &[f64; 3]| [d[0], d[1], d[2], 0.0].map(|v| v as f32);
        let singles: Vec<[f32; 4]> = directions.iter().map(single).collect();
        let storage = |label, bytes: &[u8]| submitter.upload(label, BufferUsages::STORAGE, bytes);
        Self {
            scene: Scene {
                n_directions: directions.len() as u32,
                n_nodes: bvh.nodes.len() as u32,
                max_distance: ((options.reach() * scale) as f32).min(UNLIMITED),
                n_triangles: bvh.corners.len() as u32,
                ..Scene::default()
            },
            scale,
            center,
            nodes: storage("nodes", bytemuck::cast_slice(&bvh.nodes)),
            corners: storage("corners", bytemuck::cast_slice(&bvh.corners)),
            directions: storage("directions", bytemuck::cast_slice(&singles)),
            n_words: directions.len().div_ceil(32),
        }
    }

    /// Returns the buffers of a batch: positions, axes, uniforms and bits.
    fn buffers(&self, submitter: &Submitter<'_>, points: &[SurfacePoint]) -> [Buffer; 4] {
        let position = |p: &SurfacePoint| tree::quantized(p.position, self.center, self.scale);
        let positions: Vec<[i32; 3]> = points.iter().map(position).collect();
        let single = |[x, y, z]: [f64; 3]| [x as f32, y as f32, z as f32, 0.0];
        let axes = points.iter().flat_map(|p| [single(p.axis), single(p.face)]);
        let axes: Vec<[f32; 4]> = axes.collect();
        let scene = Scene {
            n_cells: points.len() as u32,
            ..self.scene
        };
        let storage = |label, bytes: &[u8]| submitter.upload(label, BufferUsages::STORAGE, bytes);
        // Buffers begin as zeros.
        let bits = submitter
            .context()
            .device
            .create_buffer(&wgpu::BufferDescriptor {
                label: Some("bits"),
                size: ((points.len() * self.n_words * 4) as u64).max(16),
                usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
        [
            storage("points", bytemuck::cast_slice(&positions)),
            storage("axes", bytemuck::cast_slice(&axes)),
            submitter.upload("scene", BufferUsages::UNIFORM, bytemuck::bytes_of(&scene)),
            bits,
        ]
    }
}

impl PointBake {
    /// Adds the records of a batch from its bits, in the order of the directions, as the CPU does.
    fn add(
        &mut self,
        points: &[SurfacePoint],
        words: &[u32],
        directions: &[[f64; 3]],
        options: &SurfaceOptions,
    ) {
        let per_point = directions.len().div_ceil(32);
        for (point, words) in points.iter().zip(words.chunks(per_point)) {
            let mut sum = Accumulator::default();
            for (idx, &direction) in directions.iter().enumerate() {
                let upward = direction.map(|v| v * f64::from(point.side(direction)));
                let is_occluded = words[idx / 32] >> (idx % 32) & 1 != 0
                    || options.ground_occludes(point, upward);
                sum.add(point, direction, options.weights, is_occluded);
            }
            self.rays += u64::from(sum.rays());
            self.records.push(sum.finish(point.axis, options.weights));
        }
    }
}
