use std::f32::consts::FRAC_PI_2;
use std::sync::LazyLock;

use aogrid_runtime::environment::*;
use aogrid_runtime::{
    AogridCone, AogridEnvironment, EnvironmentFrame, EnvironmentFrameError, EnvironmentMap,
    EnvironmentPass, EnvironmentPassDescriptor, EnvironmentPassError, EnvironmentTexture,
    GBufferError, GBufferFormat, GBufferViews, Normals, Positions, Reflection, Up, wgsl,
};
use glam::{Mat4, Vec3};

use crate::raster::world_and_signed;
use crate::scene::{GBuffer, SIZE, gbuffer, orthographic, perspective, reversed, surfaces};
use aogrid_gpu_support::{Gpu, attachment, gpu};

/// The kernel that calls the library's functions, one input per thread.
const KERNEL: &str = "
@group(0) @binding(0) var<uniform> environment: AogridEnvironment;
@group(0) @binding(1) var radiance: texture_2d<f32>;
@group(0) @binding(2) var radiance_sampler: sampler;
@group(0) @binding(3) var<storage, read> inputs: array<array<vec4f, 4>>;
@group(0) @binding(4) var<storage, read_write> outputs: array<vec4f>;

@compute @workgroup_size(64)
fn evaluate(@builtin(global_invocation_id) id: vec3u) {
    // Every binding is used, so that the layout is the same for all bodies.
    let used = environment.scale + textureSampleLevel(radiance, radiance_sampler, vec2f(), 0.0);
    if id.x < arrayLength(&inputs) && used.x >= 0.0 {
        let i = inputs[id.x];
        outputs[id.x] = value(i[0], i[1], i[2], i[3]);
    }
}
";

/// The four vector arguments of a call.
type Input = [[f32; 4]; 4];

/// A device and an environment, to evaluate single functions of the library with.
struct Harness<'a> {
    gpu: &'a Gpu,
    map: EnvironmentMap,
    environment: AogridEnvironment,
}

/// Returns [`bright_patch`], prefiltered once for all tests.
fn sky() -> EnvironmentMap {
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
    fn new(gpu: &'a Gpu) -> Self {
        Self {
            gpu,
            map: sky(),
            environment: AogridEnvironment::new(Up::Z, 0.7).scaled([1.0, 0.8, 1.5]),
        }
    }

    /// Returns the values of `fn value(p: vec4f, q: vec4f, r: vec4f, s: vec4f) -> vec4f` with this
    /// body.
    fn run(&self, body: &str, inputs: &[Input]) -> Vec<[f32; 4]> {
        let Gpu { device, queue, .. } = self.gpu;
        let function =
            format!("fn value(p: vec4f, q: vec4f, r: vec4f, s: vec4f) -> vec4f {{ {body} }}");
        let source = [wgsl::SHADING, wgsl::ENVIRONMENT, KERNEL, &function].concat();
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("test"),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("test"),
            layout: None,
            module: &module,
            entry_point: Some("evaluate"),
            compilation_options: Default::default(),
            cache: None,
        });
        let texture = EnvironmentTexture::new(device, queue, &self.map, "test");
        let uniform = self.gpu.storage(bytemuck::bytes_of(&self.environment));
        let input_buffer = self.gpu.storage(bytemuck::cast_slice(inputs));
        let outputs = self.gpu.storage(&vec![0; inputs.len() * 16]);
        let resources = [
            uniform.as_entire_binding(),
            wgpu::BindingResource::TextureView(texture.view()),
            wgpu::BindingResource::Sampler(texture.sampler()),
            input_buffer.as_entire_binding(),
            outputs.as_entire_binding(),
        ];
        let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
        let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
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

    /// Returns the largest difference from the CPU twin.
    fn max_difference(
        &self,
        body: &str,
        inputs: &[Input],
        twin: impl Fn(&Input) -> [f32; 4],
    ) -> f32 {
        let found = self.run(body, inputs);
        assert!(found.iter().any(|v| *v != found[0]), "nothing was compared");
        let mut worst = 0.0_f32;
        for (input, found) in inputs.iter().zip(found) {
            let expected = twin(input);
            for c in 0..4 {
                let difference = (found[c] - expected[c]).abs();
                assert!(!difference.is_nan(), "{input:?}: {found:?}");
                worst = worst.max(difference);
            }
        }
        println!("{body}: off by at most {worst}");
        worst
    }

    /// Returns the error that a filter weight's error causes between the steepest texels: level 0
    /// rises to the patch, 20, within a cone's 10°, fourteen texels; scaled by up to 1.5; on two
    /// levels.
    fn filter_error(&self) -> f32 {
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
fn receivers() -> Vec<Input> {
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

fn xyz([x, y, z, _]: [f32; 4]) -> [f32; 3] {
    [x, y, z]
}

fn with([x, y, z]: [f32; 3], w: f32) -> [f32; 4] {
    [x, y, z, w]
}

/// The rounding of numbers up to 2, in another order or fused, and of a few sines.
const ROUNDING: f32 = 4e-6;

/// The error that WGSL allows atan2: 4096 units in the last place of an angle up to π. Devices are
/// more accurate.
const ARC_TANGENT_ERROR: f32 = 4096.0 * 2.4e-7;

#[test]
fn coordinates_levels_and_directions_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu);
    let worst = harness.max_difference(
        "let d = aogrid_map_direction(environment, p.xyz);
         return vec4f(aogrid_environment_coordinate(d), aogrid_environment_level(s.x), d.y);",
        &receivers(),
        |[p, _, _, s]| {
            let d = aogrid_map_direction(&harness.environment, xyz(*p));
            let [u, v] = aogrid_environment_coordinate(d);
            [u, v, aogrid_environment_level(s[0]), d[1]]
        },
    );
    assert!(worst <= ARC_TANGENT_ERROR, "{worst}");
    let mirrored = harness.max_difference(
        "return vec4f(aogrid_mirrored(vec4f(r.xyz * 3.0, s.x), q.xyz, p.xyz), 0.0);",
        &receivers(),
        |[p, q, r, s]| {
            let eye = with(xyz(*r).map(|x| x * 3.0), s[0]);
            with(aogrid_mirrored(eye, xyz(*q), xyz(*p)), 0.0)
        },
    );
    assert!(mirrored <= ROUNDING, "{mirrored}");
}

#[test]
fn cones_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu);
    let occluded = harness.max_difference(
        "let c = aogrid_occluded_cone(q, p.xyz);
         let w = aogrid_cosine_weighted_cone(c, p.xyz);
         return vec4f(w.axis, c.fraction + w.density + aogrid_half_angle(s.x));",
        &receivers(),
        |[p, q, _, s]| {
            let cone = aogrid_occluded_cone(*q, xyz(*p));
            let weighted = aogrid_cosine_weighted_cone(&cone, xyz(*p));
            let sum = cone.fraction + weighted.density + aogrid_half_angle(s[0]);
            with(weighted.axis, sum)
        },
    );
    // √(1 − AO/cos β) near 0 is the root of a rounding; the fraction has half of that error, and
    // the density twice the fraction's.
    assert!(
        occluded <= 1.5 * (2.0_f32 * ROUNDING).sqrt() + ARC_TANGENT_ERROR,
        "{occluded}"
    );
    let shared = harness.max_difference(
        "let both = aogrid_shared_cone(AogridCone(r.xyz, s.x, 0.5), AogridCone(p.xyz, 0.5, 1.0));
         let third = aogrid_shared_cone(both, AogridCone(r.zxy, 0.1, 0.7));
         return vec4f(both.axis, both.fraction + third.fraction * third.density);",
        &receivers(),
        |[p, _, r, s]| {
            let cone = |axis, fraction, density| AogridCone {
                axis,
                fraction,
                density,
            };
            let both = aogrid_shared_cone(&cone(xyz(*r), s[0], 0.5), &cone(xyz(*p), 0.5, 1.0));
            let turned = cone([r[2], r[0], r[1]], 0.1, 0.7);
            let third = aogrid_shared_cone(&both, &turned);
            with(both.axis, both.fraction + third.fraction * third.density)
        },
    );
    // The angles come from arc tangents; the mean axis and the lens take half of a few of them.
    assert!(shared <= 2.0 * ARC_TANGENT_ERROR, "{shared}");
}

#[test]
fn diffuse_and_glossy_light_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu);
    let args = "environment, radiance, radiance_sampler";
    let irradiance = harness.max_difference(
        &format!("return vec4f(aogrid_irradiance({args}, p.xyz), 0.0);"),
        &receivers(),
        |[p, ..]| {
            with(
                aogrid_irradiance(&harness.environment, &harness.map, xyz(*p)),
                0.0,
            )
        },
    );
    // A coordinate has the error of an arc tangent, on a slope of at most 20 in 10°.
    let tolerance = harness.filter_error() + 1.5 * 20.0 / 0.17 * ARC_TANGENT_ERROR / 100.0;
    assert!(irradiance <= tolerance, "{irradiance}");
    let lambertian = harness.max_difference(
        &format!("return vec4f(aogrid_lambertian({args}, q, p.xyz), 0.0);"),
        &receivers(),
        |[p, q, ..]| {
            with(
                aogrid_lambertian(&harness.environment, &harness.map, *q, xyz(*p)),
                0.0,
            )
        },
    );
    assert!(lambertian <= 2.0 * tolerance, "{lambertian}");
    let glossy = harness.max_difference(
        &format!("return vec4f(aogrid_glossy({args}, q, p.xyz, r.xyz, s.x), 0.0);"),
        &receivers(),
        |[p, q, r, s]| {
            let light = aogrid_glossy(
                &harness.environment,
                &harness.map,
                *q,
                xyz(*p),
                xyz(*r),
                s[0],
            );
            with(light, 0.0)
        },
    );
    assert!(glossy <= 2.0 * tolerance, "{glossy}");
}

#[test]
fn no_occlusion_keeps_all_light_and_full_occlusion_keeps_none() {
    let map = sky();
    let environment = AogridEnvironment::new(Up::Y, 0.2);
    for [normal, _, mirrored, lobe] in receivers() {
        let (n, r) = (xyz(normal), xyz(mirrored));
        let open = aogrid_lambertian(&environment, &map, [0.0, 0.0, 0.0, 1.0], n);
        assert_eq!(open, aogrid_irradiance(&environment, &map, n));
        let overhead = with(n.map(|x| 0.5 * x), 0.0);
        let dark = aogrid_lambertian(&environment, &map, overhead, n);
        assert!(dark.iter().all(|v| *v < DARKNESS_TOLERANCE), "{dark:?}");
        let dark = aogrid_glossy(&environment, &map, overhead, n, r, lobe[0]);
        assert!(dark.iter().all(|v| *v < DARKNESS_TOLERANCE), "{dark:?}");
    }
}

/// The tolerance for full occlusion. The occluded fraction is ½ up to half the root of a rounding,
/// 2e-4, and the level is the last one up to as much; the radiances of the next level, and of a
/// lobe, differ by a few units.
const DARKNESS_TOLERANCE: f32 = 1e-3;

#[test]
fn occluders_on_several_sides_become_a_wide_cone_of_low_density() {
    let n = [0.0, 0.0, 1.0];
    // For a cone around the normal AO = 4a(1 - a): 5/9 for a = 1/6, a third of the hemisphere's
    // fraction.
    let (occlusion, a) = (5.0 / 9.0, 1.0 / 6.0);
    for (together, wide) in [(1.0, a), (0.9, 0.25), (0.6, 0.5), (0.0, 0.5)] {
        let sum = 0.5 * occlusion * together;
        let cone = aogrid_occluded_cone([0.0, 0.0, sum, 1.0 - occlusion], n);
        assert!((cone.fraction - wide).abs() < ROUNDING, "{cone:?}");
        assert!((cone.density * wide - a).abs() < ROUNDING, "{cone:?}");
        // A narrow lobe in the middle of the cone finds the cone's own density.
        let lobe = aogrid_shared_cone(&AogridCone::new(n, 0.002), &cone);
        assert!((lobe.fraction - 0.002).abs() < ROUNDING && lobe.density == cone.density);
    }
}

fn descriptor(reflection: Reflection) -> EnvironmentPassDescriptor {
    EnvironmentPassDescriptor {
        label: "test".into(),
        reflection,
        target: wgpu::TextureFormat::Rgba32Float,
        blend: None,
        depth_stencil: None,
        gbuffer: world_and_signed(),
    }
}

/// The inputs of both the pass and the CPU twin.
struct Scene {
    camera: Mat4,
    eye: [f32; 4],
    buffer: GBuffer,
    combined: Vec<[f32; 4]>,
}

/// The position of the cameras of `scene.rs`.
const EYE: Vec3 = Vec3::new(3.0, 2.5, 4.0);

const LOBE_HALF_ANGLE: f32 = 0.4;

impl Scene {
    fn new(camera: Mat4) -> Self {
        let mut surfaces = surfaces();
        // An infinite floor and wall fill the image: every pixel shows a surface.
        surfaces[1].shape = crate::scene::Shape::Plane {
            point: Vec3::new(0.0, 0.0, -2.5),
            normal: Vec3::Z,
        };
        let buffer = gbuffer(camera, &surfaces);
        let combined = |(idx, n): (usize, &[f32; 4])| {
            let [_, combined, ..] = receivers()[idx % 512];
            let sum = Vec3::from(xyz(combined));
            let n = Vec3::from(xyz(*n));
            let above = (sum + 0.6 * sum.length() * n).normalize_or_zero() * sum.length();
            // Mirror the axis to the side of the normal.
            let above = if above.dot(n) < 0.0 {
                above - 2.0 * above.dot(n) * n
            } else {
                above
            };
            above.extend(combined[3]).to_array()
        };
        let combined = buffer.normals.iter().enumerate().map(combined).collect();
        let eye = match camera == orthographic() {
            true => EYE.extend(0.0),
            false => EYE.extend(1.0),
        };
        Self {
            camera,
            eye: eye.to_array(),
            buffer,
            combined,
        }
    }

    fn draw(&self, harness: &Harness<'_>, descriptor: EnvironmentPassDescriptor) -> Vec<[f32; 4]> {
        let Gpu { device, queue, .. } = harness.gpu;
        let target = harness.gpu.target(SIZE, descriptor.target);
        let mut pass = EnvironmentPass::new(device, descriptor.clone()).unwrap();
        let floats = |texels: &[[f32; 4]]| {
            let format = wgpu::TextureFormat::Rgba32Float;
            harness
                .gpu
                .upload(SIZE, format, bytemuck::cast_slice(texels))
        };
        let positions = match descriptor.gbuffer.positions {
            Positions::World => floats(&self.buffer.positions),
            Positions::Depth => harness.gpu.upload(
                SIZE,
                wgpu::TextureFormat::R32Float,
                bytemuck::cast_slice(&self.buffer.depths),
            ),
        };
        let normals = self
            .buffer
            .normals
            .iter()
            .map(|n| match descriptor.gbuffer.normals {
                Normals::Signed => *n,
                // The format of normals without signed texels.
                Normals::Unsigned => n.map(|x| 0.5 * x + 0.5),
            });
        let normals = floats(&normals.collect::<Vec<_>>());
        let occlusion = floats(&self.combined);
        let map = EnvironmentTexture::new(device, queue, &harness.map, "sky");
        let frame = EnvironmentFrame {
            gbuffer: GBufferViews {
                clip_from_world: self.camera.to_cols_array_2d(),
                positions: &positions,
                normals: Some(&normals),
                receivers: None,
            },
            eye: self.eye,
            lobe_half_angle: LOBE_HALF_ANGLE,
            environment: harness.environment,
            map: &map,
            occlusion: &occlusion,
        };
        pass.prepare(device, queue, &frame).unwrap();
        let view = target.create_view(&Default::default());
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("test"),
            color_attachments: &[attachment(&view, wgpu::LoadOp::Clear(wgpu::Color::BLACK))],
            ..Default::default()
        });
        pass.draw(&mut render_pass);
        drop(render_pass);
        queue.submit([encoder.finish()]);
        bytemuck::pod_collect_to_vec(&harness.gpu.read_texture(&target))
    }

    fn twin_pixel(&self, harness: &Harness<'_>, reflection: Reflection, pixel: usize) -> [f32; 3] {
        let (n, combined) = (xyz(self.buffer.normals[pixel]), self.combined[pixel]);
        match reflection {
            Reflection::Lambertian => {
                aogrid_lambertian(&harness.environment, &harness.map, combined, n)
            }
            Reflection::Glossy => {
                let p = xyz(self.buffer.positions[pixel]);
                let mirrored = aogrid_mirrored(self.eye, p, n);
                let lobe = 0.5 * (1.0 - LOBE_HALF_ANGLE.cos());
                aogrid_glossy(
                    &harness.environment,
                    &harness.map,
                    combined,
                    n,
                    mirrored,
                    lobe,
                )
            }
        }
    }

    /// Returns the largest difference between the pass's pixels and the CPU twin's.
    fn max_difference(&self, harness: &Harness<'_>, descriptor: EnvironmentPassDescriptor) -> f32 {
        let found = self.draw(harness, descriptor.clone());
        let (mut worst, mut lit, mut seen) = (0.0_f32, 0, 0);
        for (pixel, found) in found.iter().enumerate() {
            if self.buffer.receivers[pixel] == [0, 0] {
                continue;
            }
            let expected = self.twin_pixel(harness, descriptor.reflection, pixel);
            for c in 0..3 {
                let difference = (found[c] - expected[c]).abs();
                assert!(!difference.is_nan(), "{pixel}: {found:?}");
                worst = worst.max(difference);
            }
            assert_eq!(found[3], 1.0);
            seen += 1;
            lit += u32::from(expected[0] > 0.1);
        }
        println!("off by at most {worst}, {lit} of {seen} pixels are lit");
        assert!(
            lit > 5000 && seen > lit,
            "only {lit} of {seen} pixels are lit"
        );
        worst
    }
}

#[test]
fn images_of_the_pass_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu);
    // The tolerance is that of the single functions; positions are a few units large.
    let tolerance = 2.0 * (harness.filter_error() + 1.5 * 20.0 / 0.17 * ARC_TANGENT_ERROR / 100.0);
    for camera in [perspective(), reversed(), orthographic()] {
        let scene = Scene::new(camera);
        for reflection in [Reflection::Lambertian, Reflection::Glossy] {
            let worst = scene.max_difference(&harness, descriptor(reflection));
            assert!(worst <= tolerance, "{reflection:?}: {worst}");
        }
        let from_depth = EnvironmentPassDescriptor {
            gbuffer: GBufferFormat {
                positions: Positions::Depth,
                normals: Normals::Unsigned,
                ..world_and_signed()
            },
            ..descriptor(Reflection::Glossy)
        };
        // A depth step is 2e-5 of a unit here, negligible for a viewer four units away.
        let worst = scene.max_difference(&harness, from_depth);
        assert!(worst <= 2.0 * tolerance, "{worst}");
    }
}

#[test]
fn unsuitable_descriptors_and_frames_are_rejected() {
    let Some(gpu) = gpu() else { return };
    let Gpu { device, queue, .. } = &gpu;
    for (target, blend) in [
        (wgpu::TextureFormat::R32Uint, None),
        (wgpu::TextureFormat::Rgba8Snorm, None),
        (
            wgpu::TextureFormat::Rgba16Sint,
            Some(wgpu::BlendState::ALPHA_BLENDING),
        ),
    ] {
        let descriptor = EnvironmentPassDescriptor {
            target,
            blend,
            ..descriptor(Reflection::Lambertian)
        };
        let refusal = EnvironmentPass::new(device, descriptor).unwrap_err();
        assert!(matches!(refusal, EnvironmentPassError::Target { .. }));
    }
    let view = gpu.upload(SIZE, wgpu::TextureFormat::Rgba32Float, &[0; 128 * 96 * 16]);
    let map = EnvironmentTexture::new(device, queue, &sky(), "sky");
    let frame = EnvironmentFrame {
        gbuffer: GBufferViews {
            clip_from_world: [[0.0; 4]; 4],
            positions: &view,
            normals: Some(&view),
            receivers: None,
        },
        eye: [0.0, 1.0, 0.0, 1.0],
        lobe_half_angle: 0.3,
        environment: AogridEnvironment::new(Up::Y, 0.0),
        map: &map,
        occlusion: &view,
    };
    // Diffuse reflection needs no camera.
    let mut diffuse = EnvironmentPass::new(device, descriptor(Reflection::Lambertian)).unwrap();
    diffuse.prepare(device, queue, &frame).unwrap();
    let from_depth = EnvironmentPassDescriptor {
        gbuffer: GBufferFormat {
            positions: Positions::Depth,
            ..world_and_signed()
        },
        ..descriptor(Reflection::Glossy)
    };
    let mut pass = EnvironmentPass::new(device, from_depth).unwrap();
    let mut prepare = |frame| pass.prepare(device, queue, &frame).unwrap_err();
    assert_eq!(prepare(frame), GBufferError::Camera.into());
    let no_normals = EnvironmentFrame {
        gbuffer: GBufferViews {
            normals: None,
            ..frame.gbuffer
        },
        ..frame
    };
    let missing = GBufferError::Missing("normals");
    assert_eq!(prepare(no_normals), missing.into());
    for lobe_half_angle in [0.0, -1.0, FRAC_PI_2 + 1e-3, f32::NAN] {
        let refusal = prepare(EnvironmentFrame {
            lobe_half_angle,
            ..frame
        });
        assert!(matches!(refusal, EnvironmentFrameError::Lobe(_)));
    }
}
