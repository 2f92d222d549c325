//! Measures the cost of many occluders by raster and in tiles, and shows that it depends neither on
//! the occluders' triangle counts nor on the scene's (RR-5779, figure 14), and what far fields add.
//! Prints three tables.
//!
//! ```sh
//! cargo bench -p aogrid-runtime --bench many_occluders
//! ```
//!
//! The methods alternate within each round, and medians are compared, so that other load on the
//! machine slows all of them alike.

use std::error::Error;
use std::time::Instant;

use aogrid_bake_core::mesh::Part;
use aogrid_bake_core::models::Model;
use aogrid_bake_core::{Preset, TriangleMesh, UNOBSERVED};
use aogrid_baker_cpu::RayScene;
use aogrid_gpu_support::{Gpu, attachment};
use aogrid_grid_format::{Grid, Source};
use aogrid_runtime::{
    Combine, Frame, GBufferFormat, GBufferViews, GridAtlas, GridTexture, Instance, MergePass,
    MergePassDescriptor, Mode, Normals, OcclusionPass, OcclusionPassDescriptor, Output, Positions,
    Receivers, TiledFrame, TiledPass, TiledPassDescriptor,
};
use glam::camera::rh::{proj::directx, view};
use glam::{Mat4, Vec3, Vec4};

const SIZE: [u32; 2] = [512, 384];

/// Half the side length of the floor.
const FLOOR: f32 = 4.0;

/// Measured rounds, after one that warms up; medians are reported.
const ROUNDS: usize = 9;

/// The same for a thousand far fields, which take seconds each.
const FAR_ROUNDS: usize = 3;

const OCCLUDER_COUNTS: [usize; 5] = [1, 10, 40, 200, 1000];

const FLOATS: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// The format of [`Views`].
const FORMAT: GBufferFormat = GBufferFormat {
    positions: Positions::World,
    normals: Normals::Signed,
    receivers: Receivers::None,
    depth: None,
};

fn main() -> Result<(), Box<dyn Error>> {
    let gpu = Gpu::new(wgpu::Features::FLOAT32_BLENDABLE)?;
    println!("{}, {} x {} pixels", gpu.adapter.name, SIZE[0], SIZE[1]);
    let grids = [
        grid(Preset::Default, &Model::Table.mesh(None)?)?,
        grid(Preset::Default, &Model::Torus.mesh(None)?)?,
    ];
    let flat = gbuffer(&gpu, &floor(1)?);
    println!("\nmilliseconds (median of {ROUNDS}), and the ratio of tiles to raster");
    println!(
        "{:>9} {:>8} {:>8} {:>6} {:>9} {:>8} {:>6}",
        "occluders", "multiply", "in tiles", "ratio", "merge", "in tiles", "ratio"
    );
    for count in OCCLUDER_COUNTS {
        let [multiply, tiled_multiply, merge, tiled_merge] = Workload {
            gpu: &gpu,
            views: &flat,
            grids: &grids,
            occluders: &crowd(count),
        }
        .measure()?;
        let (first, second) = (tiled_multiply / multiply, tiled_merge / merge);
        println!(
            "{count:>9} {multiply:>8.2} {tiled_multiply:>8.2} {first:>6.2} {merge:>9.2} \
             {tiled_merge:>8.2} {second:>6.2}"
        );
    }
    println!("\nten occluders: milliseconds by raster and in tiles, multiplied and merged");
    for triangles in [1_200, 20_000, 300_000] {
        let mesh = Model::Torus.mesh(Some(triangles))?;
        let grids = [grid(Preset::Default, &mesh)?];
        let name = format!("{} triangles an occluder", mesh.triangles().len());
        compare(&gpu, &name, &flat, &grids)?;
    }
    for cells in [1, 100, 500] {
        let mesh = floor(cells)?;
        let name = format!("{} triangles of scene", mesh.triangles().len());
        compare(&gpu, &name, &gbuffer(&gpu, &mesh), &grids)?;
    }
    far_fields(&gpu, &flat)
}

/// Compares the papers' boxes with far fields that end at several thresholds.
fn far_fields(gpu: &Gpu, views: &Views) -> Result<(), Box<dyn Error>> {
    println!("\nmilliseconds of 1000 occluders in tiles by far field, multiplied and merged");
    for (preset, threshold) in [
        (Preset::Paper, 0.0),
        (Preset::Default, 0.0),
        (Preset::Default, 0.1),
        (Preset::Default, 0.06),
        (Preset::Default, 0.035),
        (Preset::Default, 0.02),
    ] {
        let baked = |model: Model| grid(preset, &model.mesh(None)?);
        let mut occluders = crowd(1000);
        for (_, instance) in &mut occluders {
            instance.far_field = Some(threshold);
        }
        let workload = Workload {
            gpu,
            views,
            grids: &[baked(Model::Table)?, baked(Model::Torus)?],
            occluders: &occluders,
        };
        let tiles = |combine| {
            let pass = workload.tiled_pass(combine)?;
            let mut times = [(); FAR_ROUNDS].map(|()| time(gpu, |e| dispatch(e, &pass)));
            times.sort_by(f64::total_cmp);
            Ok::<_, Box<dyn Error>>(times[FAR_ROUNDS / 2])
        };
        let (name, multiplied) = (preset.name(), tiles(Combine::Multiply)?);
        let merged = tiles(Combine::Merge)?;
        println!("{name:>20} {threshold:>7} {multiplied:>8.2} {merged:>8.2}");
    }
    Ok(())
}

fn compare(gpu: &Gpu, name: &str, views: &Views, grids: &[Grid]) -> Result<(), Box<dyn Error>> {
    let mut occluders = crowd(10);
    occluders
        .iter_mut()
        .for_each(|(grid, _)| *grid %= grids.len());
    let workload = Workload {
        gpu,
        views,
        grids,
        occluders: &occluders,
    };
    let [multiply, tiled_multiply, merge, tiled_merge] = workload.measure()?;
    println!("{name:>28} {multiply:>8.2} {tiled_multiply:>8.2} {merge:>8.2} {tiled_merge:>8.2}");
    Ok(())
}

/// Returns the milliseconds that recording, submitting and waiting take.
fn time(gpu: &Gpu, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> f64 {
    let start = Instant::now();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    record(&mut encoder);
    gpu.queue.submit([encoder.finish()]);
    let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
    start.elapsed().as_secs_f64() * 1e3
}

/// The positions and normals of the visible surfaces.
struct Views {
    positions: wgpu::TextureView,
    normals: wgpu::TextureView,
}

impl Views {
    fn gbuffer(&self) -> GBufferViews<'_> {
        GBufferViews {
            clip_from_world: clip_from_world().to_cols_array_2d(),
            positions: &self.positions,
            normals: Some(&self.normals),
            receivers: None,
        }
    }
}

struct Workload<'a> {
    gpu: &'a Gpu,
    views: &'a Views,
    grids: &'a [Grid],
    occluders: &'a [(usize, Instance)],
}

impl Workload<'_> {
    /// Returns median milliseconds: multiplied by raster and in tiles, merged by raster and in
    /// tiles.
    fn measure(&self) -> Result<[f64; 4], Box<dyn Error>> {
        let multiply = self.occlusion_pass()?;
        let merge = self.merge_pass()?;
        let tiled = [
            self.tiled_pass(Combine::Multiply)?,
            self.tiled_pass(Combine::Merge)?,
        ];
        let target = self.gpu.target(SIZE, blended(self.gpu));
        let target = target.create_view(&Default::default());
        let mut times = [const { vec![] }; 4];
        for _ in 0..=ROUNDS {
            times[0].push(time(self.gpu, |encoder| draw(encoder, &multiply, &target)));
            times[1].push(time(self.gpu, |encoder| dispatch(encoder, &tiled[0])));
            times[2].push(time(self.gpu, |encoder| merge.record(encoder, None)));
            times[3].push(time(self.gpu, |encoder| dispatch(encoder, &tiled[1])));
        }
        Ok(times.map(|mut times| {
            let after_warm_up = &mut times[1..];
            after_warm_up.sort_by(f64::total_cmp);
            after_warm_up[ROUNDS / 2]
        }))
    }

    fn occlusion_pass(&self) -> Result<OcclusionPass, Box<dyn Error>> {
        let Gpu { device, queue, .. } = self.gpu;
        let descriptor = OcclusionPassDescriptor {
            label: "multiply".into(),
            mode: Mode::Cone,
            output: Output::Transmittance,
            target: blended(self.gpu),
            gbuffer: FORMAT,
            front_face: wgpu::FrontFace::Ccw,
        };
        let mut pass = OcclusionPass::new(device, queue, descriptor)?;
        self.with_frame(|frame| Ok(pass.prepare(device, queue, frame)?))?;
        Ok(pass)
    }

    fn merge_pass(&self) -> Result<MergePass, Box<dyn Error>> {
        let Gpu { device, queue, .. } = self.gpu;
        let descriptor = MergePassDescriptor {
            label: "merge".into(),
            format: FLOATS,
            mean: false,
            gbuffer: FORMAT,
            front_face: wgpu::FrontFace::Ccw,
        };
        let mut pass = MergePass::new(device, queue, descriptor)?;
        self.with_frame(|frame| Ok(pass.prepare(device, queue, frame)?))?;
        Ok(pass)
    }

    fn with_frame(
        &self,
        prepare: impl FnOnce(&Frame<'_>) -> Result<(), Box<dyn Error>>,
    ) -> Result<(), Box<dyn Error>> {
        let Gpu { device, queue, .. } = self.gpu;
        let textures = self
            .grids
            .iter()
            .map(|g| GridTexture::new(device, queue, g, "grid"));
        let textures = textures.collect::<Result<Vec<_>, _>>()?;
        let occluders = self
            .occluders
            .iter()
            .map(|(grid, i)| (&textures[*grid], *i));
        prepare(&Frame {
            gbuffer: self.views.gbuffer(),
            occluders: &occluders.collect::<Vec<_>>(),
        })
    }

    fn tiled_pass(&self, combine: Combine) -> Result<TiledPass, Box<dyn Error>> {
        let Gpu { device, queue, .. } = self.gpu;
        // The same texel size as the raster pass that it is compared with.
        let (output, target) = match combine {
            Combine::Multiply => (Output::Transmittance, wgpu::TextureFormat::R32Float),
            Combine::Merge | Combine::Mean => (Output::TransmittanceAndAxis, FLOATS),
        };
        let descriptor = TiledPassDescriptor {
            label: "tiled".into(),
            mode: Mode::Cone,
            combine,
            output,
            target,
            gbuffer: FORMAT,
        };
        let mut pass = TiledPass::new(device, queue, descriptor)?;
        let grids: Vec<_> = self.grids.iter().collect();
        let frame = TiledFrame {
            gbuffer: self.views.gbuffer(),
            atlas: &GridAtlas::new(device, queue, &grids, "grids")?,
            occluders: self.occluders,
            target: &self
                .gpu
                .storage_target(SIZE, target)
                .create_view(&Default::default()),
        };
        pass.prepare(device, queue, &frame)?;
        Ok(pass)
    }
}

/// Returns the widest format that the device can blend.
fn blended(gpu: &Gpu) -> wgpu::TextureFormat {
    match gpu
        .device
        .features()
        .contains(wgpu::Features::FLOAT32_BLENDABLE)
    {
        true => wgpu::TextureFormat::R32Float,
        false => wgpu::TextureFormat::R16Float,
    }
}

fn draw(encoder: &mut wgpu::CommandEncoder, pass: &OcclusionPass, view: &wgpu::TextureView) {
    let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[attachment(view, wgpu::LoadOp::Clear(pass.clear_color()))],
        ..Default::default()
    });
    pass.draw(&mut render_pass);
}

fn dispatch(encoder: &mut wgpu::CommandEncoder, pass: &TiledPass) {
    pass.dispatch(&mut encoder.begin_compute_pass(&Default::default()));
}

fn clip_from_world() -> Mat4 {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    directx::perspective(0.8, aspect, 0.1, 50.0)
        * view::look_at_mat4(Vec3::new(0.0, 5.0, 7.0), Vec3::ZERO, Vec3::Y)
}

/// Ray traces the G-buffer: the closest hit of a ray through each pixel.
fn gbuffer(gpu: &Gpu, mesh: &TriangleMesh) -> Views {
    let scene = RayScene::new(mesh);
    let world_from_clip = clip_from_world().inverse();
    let corners: Vec<_> = mesh.corners().collect();
    let (mut positions, mut normals) = (vec![], vec![]);
    for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
        let ndc = [
            2.0 * (x as f32 + 0.5) / SIZE[0] as f32 - 1.0,
            1.0 - 2.0 * (y as f32 + 0.5) / SIZE[1] as f32,
        ];
        let at = |depth| (world_from_clip * Vec4::new(ndc[0], ndc[1], depth, 1.0)).project();
        let (near, far) = (at(0.0).as_dvec3(), at(1.0).as_dvec3());
        let direction = (far - near).normalize();
        let hit = scene.closest_hit(near.to_array(), direction.to_array());
        let (position, normal) = hit.map_or((Vec3::NAN, Vec3::Y), |hit| {
            let [a, b, c] = corners[hit.triangle as usize].map(Vec3::from);
            let normal = (b - a).cross(c - a).normalize();
            ((near + direction * hit.distance).as_vec3(), normal)
        });
        positions.push(position.extend(1.0).to_array());
        normals.push(normal.extend(0.0).to_array());
    }
    Views {
        positions: gpu.upload(SIZE, FLOATS, bytemuck::cast_slice(&positions)),
        normals: gpu.upload(SIZE, FLOATS, bytemuck::cast_slice(&normals)),
    }
}

/// Returns a slightly wavy floor with `cells` cells along each side.
fn floor(cells: u32) -> Result<TriangleMesh, Box<dyn Error>> {
    let n = cells + 1;
    let vertex = |i: u32| {
        let [x, z] = [i % n, i / n].map(|k| (2.0 * k as f32 / cells as f32 - 1.0) * FLOOR);
        let wave = if cells > 1 {
            0.05 * (3.0 * x).sin() * (3.0 * z).sin()
        } else {
            0.0
        };
        [x, wave, z]
    };
    let triangles = (0..cells * cells).flat_map(|cell| {
        let a = cell / cells * n + cell % cells;
        [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]]
    });
    let positions = (0..n * n).map(vertex).collect();
    let triangles: Vec<_> = triangles.collect();
    let part = Part {
        name: "floor".into(),
        triangles: 0..triangles.len(),
    };
    Ok(TriangleMesh::new(positions, triangles, vec![part])?)
}

fn grid(preset: Preset, mesh: &TriangleMesh) -> Result<Grid, Box<dyn Error>> {
    let (placement, options) = (preset.placement(), preset.options());
    let source = Source {
        name: "sample".into(),
        part: None,
        blake3: "0".repeat(64),
        triangles: mesh.triangles().len() as u64,
    };
    Ok(aogrid_baker_cpu::bake_grid(
        mesh, &placement, &options, source, UNOBSERVED,
    )?)
}

/// Returns `count` objects on the floor. Their size is fixed, so overlap grows with their number.
fn crowd(count: usize) -> Vec<(usize, Instance)> {
    let world_from_object = |i: usize| {
        // Multiples of incommensurable numbers spread evenly.
        let [x, z, rotation] =
            [0.754_877_7, 0.569_840_3, 0.618_034].map(|step| (i as f32 * step).fract());
        let at = Vec3::new(
            (2.0 * x - 1.0) * 0.9 * FLOOR,
            0.0,
            (2.0 * z - 1.0) * 0.9 * FLOOR,
        );
        Mat4::from_translation(at)
            * Mat4::from_rotation_y(rotation * std::f32::consts::TAU)
            * Mat4::from_scale(Vec3::splat(0.3))
    };
    (0..count)
        .map(|i| (i % 2, Instance::at(world_from_object(i).to_cols_array_2d())))
        .collect()
}
