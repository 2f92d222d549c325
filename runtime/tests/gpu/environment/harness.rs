use std::sync::LazyLock;

use aogrid_gpu_support::Gpu;
use aogrid_runtime::{
    AogridEnvironment, EnvironmentMap, EnvironmentTexture, LatLongCube, Up, wgsl,
};
use glam::Vec3;

use crate::kernel;

/// The arguments of a function, and the bindings that its body may use.
const DECLARATIONS: &str = "
alias Input = array<vec4f, 4>;
@group(0) @binding(2) var<uniform> environment: AogridEnvironment;
@group(0) @binding(3) var radiance: texture_2d<f32>;
@group(0) @binding(4) var radiance_sampler: sampler;
@group(0) @binding(5) var coordinates: texture_cube<f32>;
@group(0) @binding(6) var coordinates_sampler: sampler;
";

/// The four vector arguments of a call.
pub(super) type Input = [[f32; 4]; 4];

/// A device and an environment, to evaluate single functions of the library with.
pub(super) struct Harness<'a> {
    pub gpu: &'a Gpu,
    pub map: EnvironmentMap,
    pub environment: AogridEnvironment,
    pub cube: LatLongCube,
}

/// Returns [`bright_patch`], prefiltered once for all tests.
pub(super) fn sky() -> EnvironmentMap {
    static SKY: LazyLock<EnvironmentMap> = LazyLock::new(bright_patch);
    SKY.clone()
}

/// Returns a sky with a bright patch, over colored ground.
fn bright_patch() -> EnvironmentMap {
    const SKY: [usize; 2] = [64, 32];
    let texel = |idx: usize| {
        let (x, y) = (idx % SKY[0], idx / SKY[0]);
        let across = (x as f32 / SKY[0] as f32 * std::f32::consts::TAU).sin();
        match (x, y) {
            (40..44, 8..10) => [20.0, 18.0, 14.0],
            (_, 0..16) => [0.4 + 0.2 * across, 0.6, 1.0 - 0.03 * y as f32],
            _ => [0.3, 0.25 + 0.1 * across, 0.1],
        }
    };
    let texels: Vec<_> = (0..SKY[0] * SKY[1]).map(texel).collect();
    EnvironmentMap::new(SKY, &texels).unwrap()
}

impl<'a> Harness<'a> {
    pub fn new(gpu: &'a Gpu) -> Self {
        Self {
            gpu,
            map: sky(),
            environment: AogridEnvironment::new(Up::Z, 0.7).scaled([1.0, 0.8, 1.5]),
            cube: LatLongCube::new(64),
        }
    }

    /// Returns the values of a function of the vectors p, q, r and s with this body.
    fn run(&self, body: &str, inputs: &[Input]) -> Vec<[f32; 4]> {
        let Gpu { device, queue, .. } = self.gpu;
        let function = format!(
            "fn value(i: Input) -> vec4f {{
                 let p = i[0]; let q = i[1]; let r = i[2]; let s = i[3]; {body}
             }}"
        );
        let source = [
            wgsl::SHADING,
            wgsl::ENVIRONMENT,
            wgsl::SURFACE,
            DECLARATIONS,
            &function,
        ]
        .concat();
        let texture = EnvironmentTexture::new(device, queue, &self.map, "test");
        let uniform = self.gpu.storage(bytemuck::bytes_of(&self.environment));
        let view = wgpu::BindingResource::TextureView(texture.view());
        let sampler = wgpu::BindingResource::Sampler(texture.sampler());
        let cube = self.upload_cube();
        let nearest = device.create_sampler(&wgpu::SamplerDescriptor::default());
        let all = [
            (2, "environment,", uniform.as_entire_binding()),
            (3, "radiance,", view),
            (4, "radiance_sampler", sampler),
            (5, "coordinates,", wgpu::BindingResource::TextureView(&cube)),
            (
                6,
                "coordinates_sampler",
                wgpu::BindingResource::Sampler(&nearest),
            ),
        ];
        // The pipeline's automatic layout has only the bindings that the body uses.
        let used = all.into_iter().filter(|(_, name, _)| body.contains(name));
        let resources = used.map(|(binding, _, resource)| (binding, resource));
        kernel::evaluate(self.gpu, &source, resources.collect(), inputs)
    }

    /// Returns the cube map of coordinates as a texture.
    fn upload_cube(&self) -> wgpu::TextureView {
        let Gpu { device, queue, .. } = self.gpu;
        let side = self.cube.size() as u32;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("coordinates"),
            size: wgpu::Extent3d {
                width: side,
                height: side,
                depth_or_array_layers: 6,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rg32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(8 * side),
            rows_per_image: Some(side),
        };
        let image = texture.as_image_copy();
        queue.write_texture(image, self.cube.texels(), layout, texture.size());
        texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::Cube),
            ..Default::default()
        })
    }

    /// Returns the largest difference from the CPU twin.
    pub fn max_difference(
        &self,
        body: &str,
        inputs: &[Input],
        twin: impl Fn(&Input) -> [f32; 4],
    ) -> f32 {
        let found = self.run(body, inputs);
        let worst = kernel::max_difference(body, &found, |idx| twin(&inputs[idx]));
        worst.into_iter().fold(0.0, f32::max)
    }

    /// Returns the error that a filter weight's error causes between the steepest texels: level 0
    /// rises to the patch, 20, within a cone's 10°, fourteen texels; scaled by up to 1.5; on two
    /// levels.
    pub fn filter_error(&self) -> f32 {
        2.0 * self.gpu.weight_error(false) * 20.0 / 14.0 * 1.5
    }
}

/// Returns the sphere's axes, then directions all over it.
fn direction(idx: usize) -> [f32; 3] {
    const AXES: [Vec3; 6] = [
        Vec3::X,
        Vec3::NEG_X,
        Vec3::Y,
        Vec3::NEG_Y,
        Vec3::Z,
        Vec3::NEG_Z,
    ];
    if let Some(axis) = AXES.get(idx) {
        return axis.to_array();
    }
    let z = 1.0 - 2.0 * (idx as f32 * 0.754_877_7).fract();
    let (sin, cos) = (idx as f32 * 2.399_963_2).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    [r * cos, r * sin, z]
}

/// Returns inputs of a normal, an occluded cone above its horizon, a mirrored direction and a
/// lobe's fraction.
pub(super) fn receivers() -> Vec<Input> {
    let receiver = |idx: usize| {
        let normal = Vec3::from(direction(idx));
        let above = |salt: usize| {
            let d = Vec3::from(direction((idx * 31 + salt) % 4099 + 6));
            (d + 1.01 * normal).normalize()
        };
        let occlusion = match idx % 16 {
            0 => 0.0,
            1 => 1.0,
            _ => (idx as f32 * 0.618_034).fract(),
        };
        // The sum of occluders on one side, or on several.
        let sum = 0.5 * occlusion * above(1) * [1.0, 0.8, 0.3][idx % 3];
        let lobe = 0.5 * 4.0_f32.powf(-4.0 * (idx as f32 * 0.381_966).fract());
        [
            normal.extend(0.0).to_array(),
            sum.extend(1.0 - occlusion).to_array(),
            above(2).extend(0.0).to_array(),
            [lobe, 0.0, 0.0, 0.0],
        ]
    };
    (0..4096).map(receiver).collect()
}

pub(super) fn xyz([x, y, z, _]: [f32; 4]) -> [f32; 3] {
    [x, y, z]
}

pub(super) fn with([x, y, z]: [f32; 3], w: f32) -> [f32; 4] {
    [x, y, z, w]
}

/// The rounding of numbers up to 2, in another order or fused, and of a few sines.
pub(super) const ROUNDING: f32 = 4e-6;

/// The error that WGSL allows atan2: 4096 units in the last place of an angle up to π. Devices are
/// more accurate.
pub(super) const ARC_TANGENT_ERROR: f32 = 4096.0 * 2.4e-7;
