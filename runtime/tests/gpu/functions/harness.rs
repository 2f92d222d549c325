use aogrid_gpu_support::Gpu;
use aogrid_grid_format::Grid;
use aogrid_runtime::{AogridOccluder, GridTexture, Instance, tables, wgsl};

/// The kernel that calls the library's functions, one input per thread: position and normal, or the
/// arguments of the function in x and y.
const KERNEL: &str = "
struct Input { position: vec4f, normal: vec4f }
@group(0) @binding(0) var<uniform> occluder: AogridOccluder;
@group(0) @binding(1) var grid: texture_3d<f32>;
@group(0) @binding(2) var transmittance: texture_2d<f32>;
@group(0) @binding(3) var clip: texture_2d<f32>;
@group(0) @binding(4) var linear_clamp: sampler;
@group(0) @binding(5) var<storage, read> inputs: array<Input>;
@group(0) @binding(6) var<storage, read_write> outputs: array<vec4f>;
@group(0) @binding(7) var overlaps: texture_3d<f32>;

@compute @workgroup_size(64)
fn evaluate(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&inputs) {
        outputs[id.x] = value(inputs[id.x].position.xyz, inputs[id.x].normal.xyz);
    }
}
";

/// A device and an occluder, to evaluate single functions of the library with.
pub(super) struct Harness<'a> {
    pub gpu: &'a Gpu,
    pub grid: Grid,
    pub occluder: AogridOccluder,
}

/// The position and the normal of a receiver, or the arguments of a function.
pub(super) type Input = [[f32; 4]; 2];

impl<'a> Harness<'a> {
    pub fn new(gpu: &'a Gpu, grid: Grid, instance: &Instance) -> Self {
        let occluder =
            AogridOccluder::new(grid.spec(), grid.encoding(), grid.format(), instance).unwrap();
        Self {
            gpu,
            grid,
            occluder,
        }
    }

    /// Returns the values of `fn value(p: vec3f, n: vec3f) -> vec4f` with the given body.
    pub fn run(&self, body: &str, inputs: &[Input]) -> Vec<[f32; 4]> {
        let Gpu { device, queue, .. } = self.gpu;
        let function = format!("fn value(p: vec3f, n: vec3f) -> vec4f {{ {body} }}");
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("test"),
            source: wgpu::ShaderSource::Wgsl([wgsl::SHADING, KERNEL, &function].concat().into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("test"),
            layout: None,
            module: &module,
            entry_point: Some("evaluate"),
            compilation_options: Default::default(),
            cache: None,
        });
        let occluder = self.gpu.storage(bytemuck::bytes_of(&self.occluder));
        let grid = GridTexture::new(device, queue, &self.grid, "test").unwrap();
        let transmittance = tables::transmittance_table(device, queue);
        let clip = tables::clip_table(device, queue);
        let overlaps = tables::intersection_table(device, queue);
        let sampler = tables::linear_clamp_sampler(device);
        let input_buffer = self.gpu.storage(bytemuck::cast_slice(inputs));
        let outputs = self.gpu.storage(&vec![0; inputs.len() * 16]);
        let view = wgpu::BindingResource::TextureView;
        let all = [
            (0, "occluder", occluder.as_entire_binding()),
            (1, "grid,", view(grid.view())),
            (2, "transmittance,", view(&transmittance)),
            (3, "clip,", view(&clip)),
            (4, "linear_clamp", wgpu::BindingResource::Sampler(&sampler)),
            (5, "", input_buffer.as_entire_binding()),
            (6, "", outputs.as_entire_binding()),
            (7, "overlaps", view(&overlaps)),
        ];
        // The pipeline's automatic layout has only the bindings that the body uses.
        let used = all.into_iter().filter(|(_, name, _)| body.contains(name));
        let entries: Vec<_> = used
            .map(|(binding, _, resource)| wgpu::BindGroupEntry { binding, resource })
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
        bytemuck::pod_collect_to_vec(&self.gpu.read_buffer(&outputs))
    }

    /// Returns the largest difference of each component from the CPU twin.
    pub fn max_difference(
        &self,
        body: &str,
        inputs: &[Input],
        twin: impl Fn([f32; 3], [f32; 3]) -> [f32; 4],
    ) -> [f32; 4] {
        let found = self.run(body, inputs);
        assert_eq!(found.len(), inputs.len());
        assert!(found.iter().any(|v| *v != found[0]), "nothing was compared");
        let mut worst = [0.0_f32; 4];
        for ([p, n], found) in inputs.iter().zip(found) {
            let expected = twin([p[0], p[1], p[2]], [n[0], n[1], n[2]]);
            for c in 0..4 {
                let difference = (found[c] - expected[c]).abs();
                assert!(!difference.is_nan(), "{p:?} {n:?}: {found:?}");
                worst[c] = worst[c].max(difference);
            }
        }
        println!("{body}: off by at most {worst:?}");
        worst
    }
}
