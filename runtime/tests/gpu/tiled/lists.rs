use aogrid_gpu_support::{Gpu, gpu};
use aogrid_runtime::{AOGRID_LIST_ALL_DEPTHS, AOGRID_LIST_OPAQUE, Combine, TiledPass, wgsl};
use glam::Vec3;

use super::{UNALIGNED_SIZE, crowd};
use crate::many::{ManyOccluders, max_difference, tiled_descriptor};
use crate::merge::ERROR_PER_MERGE;
use crate::scene::perspective;

/// A kernel that shades given points at given pixels with the tile lists.
const FORWARD: &str = "
struct Point { position: vec4f, normal: vec4f, pixel_and_object: vec4u }
@group(0) @binding(0) var<storage, read> points: array<Point>;
@group(0) @binding(1) var<storage, read_write> outputs: array<vec4f>;
override list: u32;
@compute @workgroup_size(64)
fn forward(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&points) {
        let at = points[id.x];
        let seen = at.pixel_and_object;
        outputs[2u * id.x] = aogrid_merge_listed(list, seen.xy, at.position.xyz, at.normal.xyz, seen.zw);
        outputs[2u * id.x + 1u] = aogrid_multiply_listed(list, seen.xy, at.position.xyz, at.normal.xyz, seen.zw);
    }
}
";

type Point = ([f32; 4], [f32; 4], [u32; 4]);

/// Returns the merged and the multiplied result of each point.
fn forward(gpu: &Gpu, pass: &TiledPass, list: u32, points: &[Point]) -> Vec<[[f32; 4]; 2]> {
    let Gpu { device, queue, .. } = gpu;
    let pipeline = forward_pipeline(device, pass, list);
    let words = |(p, n, seen): &Point| [p.map(f32::to_bits), n.map(f32::to_bits), *seen];
    let words: Vec<[u32; 4]> = points.iter().flat_map(words).collect();
    let input = gpu.storage(bytemuck::cast_slice(&words));
    let output = gpu.storage(&vec![0; 32 * points.len()]);
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("test"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[&input, &output].map(|buffer| wgpu::BindGroupEntry {
            binding: u32::from(buffer == &output),
            resource: buffer.as_entire_binding(),
        }),
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut compute = encoder.begin_compute_pass(&Default::default());
    compute.set_pipeline(&pipeline);
    compute.set_bind_group(0, &group, &[]);
    compute.set_bind_group(1, pass.lists().unwrap(), &[]);
    compute.dispatch_workgroups(points.len().div_ceil(64) as u32, 1, 1);
    drop(compute);
    queue.submit([encoder.finish()]);
    let outputs: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(&output));
    let pairs = outputs.chunks_exact(2);
    pairs.map(|both| [both[0], both[1]]).collect()
}

fn forward_pipeline(device: &wgpu::Device, pass: &TiledPass, list: u32) -> wgpu::ComputePipeline {
    let source = [wgsl::SHADING, &wgsl::tile_lists(1), FORWARD].concat();
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("test"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let storage = |read_only: bool| wgpu::BindGroupLayoutEntry {
        binding: u32::from(!read_only),
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let own = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("test"),
        entries: &[storage(true), storage(false)],
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("test"),
        bind_group_layouts: &[Some(&own), Some(pass.lists_layout())],
        immediate_size: 0,
    });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("test"),
        layout: Some(&layout),
        module: &module,
        entry_point: Some("forward"),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants: &[("list", f64::from(list))],
            ..Default::default()
        },
        cache: None,
    })
}

#[test]
fn tile_lists_shade_the_g_buffer_and_points_in_front_of_it() {
    let Some(gpu) = gpu() else { return };
    let kept = tiled_descriptor();
    let mut pass = TiledPass::new(&gpu.device, &gpu.queue, kept.clone()).unwrap();
    let mut many = ManyOccluders::new(UNALIGNED_SIZE, perspective());
    many.occluders = crowd(300);
    many.dispatch(&gpu, &kept, &mut pass);
    let twin = many.cpu_twin();
    let pixel = |idx: u32| [idx % UNALIGNED_SIZE[0], idx / UNALIGNED_SIZE[0]];
    let shown: Vec<Point> = (0..UNALIGNED_SIZE[0] * UNALIGNED_SIZE[1])
        .map(|idx| {
            let ([x, y], at) = (pixel(idx), idx as usize);
            let object = many.buffer.receivers[at];
            (
                many.buffer.positions[at],
                many.buffer.normals[at],
                [x, y, object[0], object[1]],
            )
        })
        .collect();
    // Move points between the camera and the visible surface, like smoke or glass.
    let eye = Vec3::new(3.0, 2.5, 4.0);
    let mut floating = shown.clone();
    for (idx, (position, normal, _)) in floating.iter_mut().enumerate() {
        let t = 0.2 + 0.7 * ((idx * 7919) % 1000) as f32 / 1000.0;
        let [x, y, z, _] = *position;
        *position = eye.lerp(Vec3::new(x, y, z), t).extend(1.0).to_array();
        *normal = Vec3::new(0.6, 0.0, 0.8).extend(0.0).to_array();
    }
    for (list, points) in [
        (AOGRID_LIST_OPAQUE, &shown),
        (AOGRID_LIST_ALL_DEPTHS, &shown),
        (AOGRID_LIST_ALL_DEPTHS, &floating),
    ] {
        let found = forward(&gpu, &pass, list, points);
        for (which, combine) in [(0, Combine::Merge), (1, Combine::Multiply)] {
            let expected = points.iter().map(|([x, y, z, _], [nx, ny, nz, _], seen)| {
                twin.shade([*x, *y, *z], [*nx, *ny, *nz], [seen[2], seen[3]], combine)
            });
            let found: Vec<_> = found.iter().map(|both| both[which]).collect();
            let expected: Vec<_> = expected.collect();
            assert!(max_difference(&found, &expected) <= 6.0 * ERROR_PER_MERGE);
        }
    }
    // The list of receivers is the shorter one: it lacks occluders of the floating points.
    let found = forward(&gpu, &pass, AOGRID_LIST_OPAQUE, &floating);
    let by_all = forward(&gpu, &pass, AOGRID_LIST_ALL_DEPTHS, &floating);
    assert!(
        found
            .iter()
            .zip(&by_all)
            .any(|(a, b)| a[0][3] > b[0][3] + 0.1)
    );
}
