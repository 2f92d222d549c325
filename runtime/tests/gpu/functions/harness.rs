use aogrid_gpu_support::Gpu;
use aogrid_grid_format::Grid;
use aogrid_runtime::{AogridOccluder, GridTexture, Instance, tables, wgsl};

use crate::kernel;

/// The arguments of a function, and the bindings that its body may use.
const DECLARATIONS: &str = "
struct Input { position: vec4f, normal: vec4f }
@group(0) @binding(2) var<uniform> occluder: AogridOccluder;
@group(0) @binding(3) var grid: texture_3d<f32>;
@group(0) @binding(4) var transmittance: texture_2d<f32>;
@group(0) @binding(5) var clip: texture_2d<f32>;
@group(0) @binding(6) var linear_clamp: sampler;
@group(0) @binding(7) var overlaps: texture_3d<f32>;
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
        let occluder = AogridOccluder::new(&grid, instance).unwrap();
        Self {
            gpu,
            grid,
            occluder,
        }
    }

    /// Returns the values of a function of the position p and the normal n with this body.
    pub fn run(&self, body: &str, inputs: &[Input]) -> Vec<[f32; 4]> {
        let Gpu { device, queue, .. } = self.gpu;
        let function = format!(
            "fn value(i: Input) -> vec4f {{ let p = i.position.xyz; let n = i.normal.xyz; {body} }}"
        );
        let source = [wgsl::SHADING, DECLARATIONS, &function].concat();
        let occluder = self.gpu.storage(bytemuck::bytes_of(&self.occluder));
        let grid = GridTexture::new(device, queue, &self.grid, "test").unwrap();
        let transmittance = tables::transmittance_table(device, queue);
        let clip = tables::clip_table(device, queue);
        let overlaps = tables::intersection_table(device, queue);
        let sampler = tables::linear_clamp_sampler(device);
        let view = wgpu::BindingResource::TextureView;
        let all = [
            (2, "occluder", occluder.as_entire_binding()),
            (3, "grid,", view(grid.view())),
            (4, "transmittance,", view(&transmittance)),
            (5, "clip,", view(&clip)),
            (6, "linear_clamp", wgpu::BindingResource::Sampler(&sampler)),
            (7, "overlaps", view(&overlaps)),
        ];
        // The pipeline's automatic layout has only the bindings that the body uses.
        let used = all.into_iter().filter(|(_, name, _)| body.contains(name));
        let resources = used.map(|(binding, _, resource)| (binding, resource));
        kernel::evaluate(self.gpu, &source, resources.collect(), inputs)
    }

    /// Returns the largest difference of each component from the CPU twin.
    pub fn max_difference(
        &self,
        body: &str,
        inputs: &[Input],
        twin: impl Fn([f32; 3], [f32; 3]) -> [f32; 4],
    ) -> [f32; 4] {
        kernel::max_difference(body, &self.run(body, inputs), |idx| {
            let [p, n] = inputs[idx].map(|[x, y, z, _]| [x, y, z]);
            twin(p, n)
        })
    }
}
