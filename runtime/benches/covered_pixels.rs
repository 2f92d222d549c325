//! Measures the cost of the raster pass per pixel that its boxes cover, and the savings of a depth
//! test; counts the pixels that far fields add; compares the costs of a look-up. Prints three tables.
//!
//! ```sh
//! cargo bench -p aogrid-runtime --bench covered_pixels
//! ```
//!
//! The methods alternate within each round, and medians are compared, so that other load on the
//! machine slows all of them alike.

use std::time::Instant;

use aogrid_gpu_support::{Gpu, attachment, gpu, read_only_depth};
use aogrid_grid_format::{Encoding, Grid, GridSpec, TexelFormat};
use aogrid_runtime::shading::{aogrid_grid_position, aogrid_lookup};
use aogrid_runtime::{
    AogridOccluder, DepthTest, Frame, GBufferFormat, GBufferViews, GridTexture, Instance, Mode,
    Normals, OcclusionPass, OcclusionPassDescriptor, Output, Positions, Receivers,
};
use glam::camera::rh::{proj::directx, view};
use glam::{Mat4, Quat, Vec3, Vec4};

#[path = "../tests/gpu/grids.rs"]
#[allow(dead_code, reason = "the tests need more of it")]
mod grids;

const SIZE: [u32; 2] = [512, 384];

const OCCLUDERS: usize = 16;

/// The objects' scales.
const SCALES: [f32; 4] = [0.2, 0.4, 0.8, 1.6];

/// Measured rounds, after one that warms up; medians are reported.
const ROUNDS: usize = 15;

const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::R16Float;

fn main() {
    let Some(gpu) = gpu() else { return };
    let grid = grids::faded_ball(TexelFormat::Unorm8);
    let buffer = floor();
    println!("{OCCLUDERS} occluders, {} x {} pixels", SIZE[0], SIZE[1]);
    println!("   scale  covered   inside      ms  ns a covered pixel   with depth test");
    for scale in SCALES {
        let instances = ring(OCCLUDERS, scale, 0.0);
        let [covered, inside] = cover(&grid, &instances, &buffer);
        let [plain, tested] = times(&gpu, &[(&grid, &instances)], &buffer)[0];
        println!(
            "{scale:>8} {covered:>8} {:>7.0}% {plain:>7.2} {:>19.1} {:>16.2}x",
            100.0 * inside as f64 / covered as f64,
            1e6 * plain / covered as f64,
            tested / plain
        );
    }
    far_fields(&gpu, &buffer);
}

/// Counts the pixels that far fields add to the papers' boxes, and compares the costs of a look-up.
fn far_fields(gpu: &Gpu, buffer: &Buffer) {
    // The papers' and the default preset's boxes, at epsilon 0.1 and 0.8.
    let spec = |epsilon: f32| {
        let half_extent = grids::RADIUS * (1.0 + (std::f32::consts::PI * epsilon).sqrt().recip());
        GridSpec::new([32; 3], [0.0; 3], [half_extent; 3]).expect("a box")
    };
    let format = TexelFormat::Unorm8;
    let paper = grids::faded_ball_in(spec(0.1), format);
    let default = grids::ball_in(spec(0.8), Encoding::Moment, format);
    println!("\npixels covered and reached, relative to the papers' boxes");
    println!("threshold    reach      1 object     16 objects    200 objects");
    for threshold in [0.0, 0.01, 0.02, 0.03, 0.035, 0.04, 0.06, 0.1] {
        let ratios = [(1, 0.5), (16, 0.5), (200, 0.2)].map(|(count, scale)| {
            let instances = ring(count, scale, threshold);
            let [covered, reached] = cover(&default, &instances, buffer);
            let [all, inside] = cover(&paper, &instances, buffer);
            [covered as f64 / all as f64, reached as f64 / inside as f64]
        });
        let occluder =
            AogridOccluder::new(&default, &ring(1, 1.0, threshold)[0]).expect("it stands");
        let cells = ratios.map(|[covered, reached]| format!("  {covered:>5.2} {reached:>5.2}"));
        println!(
            "{threshold:>9} {:>8.2}  {}",
            occluder.per_hull[0] / occluder.per_reach[0],
            cells.join("  ")
        );
    }
    // Boxes so large that every pixel looks them up.
    let wide = GridSpec::new([32; 3], [0.0; 3], [60.0; 3]).expect("a box");
    let narrow = GridSpec::new([32; 3], [0.0; 3], [0.6; 3]).expect("a box");
    let cone = grids::ball_in(wide, Encoding::Cone, format);
    let moment = grids::ball_in(wide, Encoding::Moment, format);
    let far = grids::ball_in(narrow, Encoding::Moment, format);
    let [boxed, distant] = [0.0, 1e-4].map(|threshold| ring(OCCLUDERS, 0.6, threshold));
    let kinds = [(&cone, &boxed), (&moment, &boxed), (&far, &distant)];
    let shares = kinds.map(|(grid, instances)| {
        let [covered, reached] = cover(grid, instances, buffer);
        100.0 * reached as f64 / covered as f64
    });
    let times = times(
        gpu,
        &kinds.map(|(grid, instances)| (grid, &instances[..])),
        buffer,
    );
    println!("\ntime of a look-up relative to hard cones, and the share of pixels that look up");
    for (idx, name) in ["hard cones", "soft cones", "far fields"]
        .iter()
        .enumerate()
    {
        println!(
            "{name:>12} {:>6.2} {:>6.0}%",
            times[idx][0] / times[0][0],
            shares[idx]
        );
    }
}

/// The G-buffer of an infinite floor, with the rays of its pixels.
struct Buffer {
    rays: Vec<[Vec3; 2]>,
    positions: Vec<[f32; 4]>,
    depths: Vec<f32>,
}

fn clip_from_world() -> Mat4 {
    let camera = view::look_at_mat4(Vec3::new(3.0, 2.5, 4.0), Vec3::ZERO, Vec3::Y);
    directx::perspective(0.9, SIZE[0] as f32 / SIZE[1] as f32, 0.1, 50.0) * camera
}

fn floor() -> Buffer {
    let clip_from_world = clip_from_world();
    let world_from_clip = clip_from_world.inverse();
    let mut buffer = Buffer {
        rays: vec![],
        positions: vec![],
        depths: vec![],
    };
    for (y, x) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (y, x))) {
        let u = (x as f32 + 0.5) / SIZE[0] as f32 * 2.0 - 1.0;
        let v = 1.0 - (y as f32 + 0.5) / SIZE[1] as f32 * 2.0;
        let at = |depth| world_from_clip.project_point3(Vec3::new(u, v, depth));
        let [from, direction] = [at(0.0), at(1.0) - at(0.0)];
        let t = -from.y / direction.y;
        let p = from + t * direction;
        let is_visible = t > 0.0 && t < 1.0;
        let clip = clip_from_world * p.extend(1.0);
        buffer.rays.push([from, direction]);
        buffer.positions.push(match is_visible {
            true => p.extend(1.0).to_array(),
            false => Vec4::NAN.to_array(),
        });
        buffer
            .depths
            .push(if is_visible { clip.z / clip.w } else { 1.0 });
    }
    buffer
}

/// Returns objects on the floor, each with another rotation, whose far fields end at a threshold.
fn ring(count: usize, scale: f32, threshold: f32) -> Vec<Instance> {
    let world_from_object = |idx: usize| {
        let angle = idx as f32 * 2.4;
        let distance = 0.45 * (idx as f32 + 0.5).sqrt();
        let position = Vec3::new(
            distance * angle.cos(),
            scale * grids::RADIUS,
            distance * angle.sin(),
        );
        let rotation = Quat::from_rotation_y(angle);
        let world_from_object =
            Mat4::from_scale_rotation_translation(Vec3::splat(scale), rotation, position);
        Instance {
            far_field: Some(threshold),
            ..Instance::at(world_from_object.to_cols_array_2d())
        }
    };
    (0..count).map(world_from_object).collect()
}

/// Returns the number of pixels that the back faces of the boxes cover, counted for each box, and
/// the number of those whose receiver is inside the box.
fn cover(grid: &Grid, instances: &[Instance], buffer: &Buffer) -> [usize; 2] {
    let mut count = [0; 2];
    for instance in instances {
        let occluder = AogridOccluder::new(grid, instance).expect("it stands");
        for ([from, direction], position) in buffer.rays.iter().zip(&buffer.positions) {
            let [x, y, z, _] = *position;
            let is_inside = aogrid_lookup(&occluder, [x, y, z]).is_reached;
            count[0] += usize::from(meets_box(&occluder, *from, *direction));
            count[1] += usize::from(is_inside);
        }
    }
    count
}

/// Whether a ray passes through the box in which the occluder has an effect.
fn meets_box(occluder: &AogridOccluder, from: Vec3, direction: Vec3) -> bool {
    let at = |p: Vec3| {
        let off_center = Vec3::from(aogrid_grid_position(occluder, p.to_array())) - 0.5;
        off_center * Vec3::from(occluder.per_reach)
    };
    let (start, end) = (at(from), at(from + direction));
    let inverse = (end - start).recip();
    let (a, b) = ((-1.0 - start) * inverse, (1.0 - start) * inverse);
    let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
    enter <= leave && leave > 0.0
}

/// Returns the median milliseconds without and with a depth test for each grid and its instances,
/// which take turns.
fn times(gpu: &Gpu, kinds: &[(&Grid, &[Instance])], buffer: &Buffer) -> Vec<[f64; 2]> {
    let floats = wgpu::TextureFormat::Rgba32Float;
    let up = vec![[0.0_f32, 1.0, 0.0, 0.0]; buffer.positions.len()];
    let positions = gpu.upload(SIZE, floats, bytemuck::cast_slice(&buffer.positions));
    let normals = gpu.upload(SIZE, floats, bytemuck::cast_slice(&up));
    let depth = gpu.target_depth(SIZE, DEPTH);
    gpu.fill_depth(&depth, &buffer.depths, SIZE);
    let depth = depth.create_view(&Default::default());
    let target = gpu.target(SIZE, TARGET);
    let target = target.create_view(&Default::default());
    let prepared = |(grid, instances): &(&Grid, &[Instance])| {
        let texture = GridTexture::new(&gpu.device, &gpu.queue, grid, "ball").expect("it fits");
        let occluders: Vec<_> = instances.iter().map(|i| (&texture, *i)).collect();
        let frame = Frame {
            gbuffer: GBufferViews {
                clip_from_world: clip_from_world().to_cols_array_2d(),
                positions: &positions,
                normals: Some(&normals),
                receivers: None,
            },
            occluders: &occluders,
        };
        [None, Some(DEPTH)].map(|format| {
            let mut pass = pass(gpu, format);
            let prepared = pass.prepare(&gpu.device, &gpu.queue, &frame);
            prepared.expect("the frame is whole");
            pass
        })
    };
    let passes: Vec<_> = kinds.iter().map(prepared).collect();
    let mut times = vec![[const { vec![] }; 2]; kinds.len()];
    for round in 0..=ROUNDS {
        for (passes, times) in passes.iter().zip(&mut times) {
            for (idx, pass) in passes.iter().enumerate() {
                let time = time(gpu, pass, &target, (idx == 1).then_some(&depth));
                if round > 0 {
                    times[idx].push(time);
                }
            }
        }
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[ROUNDS / 2]
    };
    times.into_iter().map(|both| both.map(median)).collect()
}

fn pass(gpu: &Gpu, depth: Option<wgpu::TextureFormat>) -> OcclusionPass {
    let descriptor = OcclusionPassDescriptor {
        label: "bench".into(),
        mode: Mode::Cone,
        output: Output::Transmittance,
        target: TARGET,
        gbuffer: GBufferFormat {
            positions: Positions::World,
            normals: Normals::Signed,
            receivers: Receivers::None,
            depth: depth.map(|format| DepthTest {
                format,
                compare: wgpu::CompareFunction::GreaterEqual,
            }),
        },
        front_face: wgpu::FrontFace::Ccw,
    };
    OcclusionPass::new(&gpu.device, &gpu.queue, descriptor).expect("its parts fit")
}

fn time(
    gpu: &Gpu,
    pass: &OcclusionPass,
    target: &wgpu::TextureView,
    depth: Option<&wgpu::TextureView>,
) -> f64 {
    let start = Instant::now();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("bench"),
        color_attachments: &[attachment(target, wgpu::LoadOp::Clear(pass.clear_color()))],
        depth_stencil_attachment: depth.map(read_only_depth),
        ..Default::default()
    });
    pass.draw(&mut render_pass);
    drop(render_pass);
    gpu.queue.submit([encoder.finish()]);
    let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
    start.elapsed().as_secs_f64() * 1e3
}
