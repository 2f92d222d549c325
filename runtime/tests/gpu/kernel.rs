use aogrid_gpu_support::Gpu;

/// The kernel that calls a function `value` of the source before it, one input per thread. An input
/// is an `Input` of the source, and every binding is in group 0.
const KERNEL: &str = "
@group(0) @binding(0) var<storage, read> inputs: array<Input>;
@group(0) @binding(1) var<storage, read_write> outputs: array<vec4f>;

@compute @workgroup_size(64)
fn evaluate(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&inputs) {
        outputs[id.x] = value(inputs[id.x]);
    }
}
";

/// Returns the values of the source's function `value` for all inputs. `resources` are those of the
/// bindings that it uses, from binding 2 on.
pub fn evaluate<T: bytemuck::NoUninit>(
    gpu: &Gpu,
    source: &str,
    resources: Vec<(u32, wgpu::BindingResource<'_>)>,
    inputs: &[T],
) -> Vec<[f32; 4]> {
    let Gpu { device, queue, .. } = gpu;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("test"),
        source: wgpu::ShaderSource::Wgsl([source, KERNEL].concat().into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("test"),
        layout: None,
        module: &module,
        entry_point: Some("evaluate"),
        compilation_options: Default::default(),
        cache: None,
    });
    let input_buffer = gpu.storage(bytemuck::cast_slice(inputs));
    let outputs = gpu.storage(&vec![0; inputs.len() * 16]);
    let buffers = [
        (0, input_buffer.as_entire_binding()),
        (1, outputs.as_entire_binding()),
    ];
    let entries: Vec<_> = resources
        .into_iter()
        .chain(buffers)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("test"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(inputs.len().div_ceil(64) as u32, 1, 1);
    drop(pass);
    queue.submit([encoder.finish()]);
    bytemuck::pod_collect_to_vec(&gpu.read_buffer(&outputs))
}

/// Returns the largest difference of each component between values found and expected.
pub fn max_difference(
    body: &str,
    found: &[[f32; 4]],
    expected: impl Fn(usize) -> [f32; 4],
) -> [f32; 4] {
    assert!(found.iter().any(|v| *v != found[0]), "nothing was compared");
    let mut worst = [0.0_f32; 4];
    for (idx, found) in found.iter().enumerate() {
        let expected = expected(idx);
        for c in 0..4 {
            let difference = (found[c] - expected[c]).abs();
            assert!(!difference.is_nan(), "{idx}: {found:?}");
            worst[c] = worst[c].max(difference);
        }
    }
    println!("{body}: off by at most {worst:?}");
    worst
}
