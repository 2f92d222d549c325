use std::f32::consts::FRAC_PI_2;
use std::sync::LazyLock;

use aogrid_runtime::environment::*;
use aogrid_runtime::{
    AogridCone, AogridEnvironment, EnvironmentFrame, EnvironmentFrameError, EnvironmentMap,
    EnvironmentPass, EnvironmentPassDescriptor, EnvironmentPassError, EnvironmentTexture, Normals,
    Positions, Reflection, Up, wgsl,
};
use glam::{Mat4, Vec3};

use crate::gpu::{Gpu, gpu};
use crate::scene::{GBuffer, SIZE, gbuffer, orthographic, perspective, reversed, surfaces};

/// What the library's functions are called by, one input a thread.
const KERNEL: &str = "
@group(0) @binding(0) var<uniform> place: AogridEnvironment;
@group(0) @binding(1) var radiance: texture_2d<f32>;
@group(0) @binding(2) var radiance_sampler: sampler;
@group(0) @binding(3) var<storage, read> inputs: array<array<vec4f, 4>>;
@group(0) @binding(4) var<storage, read_write> outputs: array<vec4f>;

@compute @workgroup_size(64)
fn evaluate(@builtin(global_invocation_id) id: vec3u) {
    // Whatever the body needs, everything is bound.
    let bound = place.scale + textureSampleLevel(radiance, radiance_sampler, vec2f(), 0.0);
    if id.x < arrayLength(&inputs) && bound.x >= 0.0 {
        let i = inputs[id.x];
        outputs[id.x] = value(i[0], i[1], i[2], i[3]);
    }
}
";

/// Four arguments of four numbers.
type Input = [[f32; 4]; 4];

struct Bench<'a> {
    gpu: &'a Gpu,
    map: EnvironmentMap,
    place: AogridEnvironment,
}

/// Prefiltered once.
fn sky() -> EnvironmentMap {
    static SKY: LazyLock<EnvironmentMap> = LazyLock::new(bright_patch);
    SKY.clone()
}

/// A sky with a bright patch, over a coloured ground.
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

impl<'a> Bench<'a> {
    fn new(gpu: &'a Gpu) -> Self {
        Self {
            gpu,
            map: sky(),
            place: AogridEnvironment::new(Up::Z, 0.7).scaled([1.0, 0.8, 1.5]),
        }
    }

    /// The values of `fn value(p: vec4f, q: vec4f, r: vec4f, s: vec4f) -> vec4f` with this body.
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
        let place = self.gpu.storage(bytemuck::bytes_of(&self.place));
        let input_buffer = self.gpu.storage(bytemuck::cast_slice(inputs));
        let outputs = self.gpu.storage(&vec![0; inputs.len() * 16]);
        let resources = [
            place.as_entire_binding(),
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

    /// The largest difference from the twin's.
    fn worst(&self, body: &str, inputs: &[Input], twin: impl Fn(&Input) -> [f32; 4]) -> f32 {
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

    /// What a weight's error makes of the steepest texels: level 0 climbs the patch, 20, within a
    /// cone's 10°, fourteen texels; scaled by up to 1.5; on two levels.
    fn filter_error(&self) -> f32 {
        2.0 * self.gpu.weight_error(false) * 20.0 / 14.0 * 1.5
    }
}

/// Directions all over the sphere, and its axes.
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

/// A normal, an occluded cone above its horizon, a direction to mirror to, a lobe.
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
        // Of occluders on one side, or on several.
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

/// Rounding of numbers up to 2 in another order or fused, and of a few sines.
const ROUNDING: f32 = 4e-6;

/// What WGSL asks of atan2, 4096 units in the last place, of an angle up to π; devices do better.
const ARC_TANGENT: f32 = 4096.0 * 2.4e-7;

#[test]
fn coordinates_levels_and_directions_are_the_twin_s() {
    let Some(gpu) = gpu() else { return };
    let bench = Bench::new(&gpu);
    let worst = bench.worst(
        "let d = aogrid_map_direction(place, p.xyz);
         return vec4f(aogrid_environment_coordinate(d), aogrid_environment_level(s.x), d.y);",
        &receivers(),
        |[p, _, _, s]| {
            let d = aogrid_map_direction(&bench.place, xyz(*p));
            let [u, v] = aogrid_environment_coordinate(d);
            [u, v, aogrid_environment_level(s[0]), d[1]]
        },
    );
    assert!(worst <= ARC_TANGENT, "{worst}");
    let mirrored = bench.worst(
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
fn cones_are_the_twin_s() {
    let Some(gpu) = gpu() else { return };
    let bench = Bench::new(&gpu);
    let occluded = bench.worst(
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
    // √(1 − AO/cos β) near 0: the root of a rounding, by half; and the density, twice that.
    assert!(
        occluded <= 1.5 * (2.0_f32 * ROUNDING).sqrt() + ARC_TANGENT,
        "{occluded}"
    );
    let shared = bench.worst(
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
    // Angles of arc tangents, of which the middle and the lens take half of a few.
    assert!(shared <= 2.0 * ARC_TANGENT, "{shared}");
}

#[test]
fn light_is_the_twin_s_diffuse_and_glossy() {
    let Some(gpu) = gpu() else { return };
    let bench = Bench::new(&gpu);
    let args = "place, radiance, radiance_sampler";
    let irradiance = bench.worst(
        &format!("return vec4f(aogrid_irradiance({args}, p.xyz), 0.0);"),
        &receivers(),
        |[p, ..]| with(aogrid_irradiance(&bench.place, &bench.map, xyz(*p)), 0.0),
    );
    // A coordinate off by an arc tangent's error, on a slope of 20 in 10° at most.
    let tolerance = bench.filter_error() + 1.5 * 20.0 / 0.17 * ARC_TANGENT / 100.0;
    assert!(irradiance <= tolerance, "{irradiance}");
    let lambertian = bench.worst(
        &format!("return vec4f(aogrid_lambertian({args}, q, p.xyz), 0.0);"),
        &receivers(),
        |[p, q, ..]| {
            with(
                aogrid_lambertian(&bench.place, &bench.map, *q, xyz(*p)),
                0.0,
            )
        },
    );
    assert!(lambertian <= 2.0 * tolerance, "{lambertian}");
    let glossy = bench.worst(
        &format!("return vec4f(aogrid_glossy({args}, q, p.xyz, r.xyz, s.x), 0.0);"),
        &receivers(),
        |[p, q, r, s]| {
            let light = aogrid_glossy(&bench.place, &bench.map, *q, xyz(*p), xyz(*r), s[0]);
            with(light, 0.0)
        },
    );
    assert!(glossy <= 2.0 * tolerance, "{glossy}");
}

#[test]
fn nothing_hidden_is_all_of_the_light_and_all_hidden_is_none() {
    let map = sky();
    let place = AogridEnvironment::new(Up::Y, 0.2);
    for [normal, _, mirrored, lobe] in receivers() {
        let (n, r) = (xyz(normal), xyz(mirrored));
        let open = aogrid_lambertian(&place, &map, [0.0, 0.0, 0.0, 1.0], n);
        assert_eq!(open, aogrid_irradiance(&place, &map, n));
        let overhead = with(n.map(|x| 0.5 * x), 0.0);
        let dark = aogrid_lambertian(&place, &map, overhead, n);
        assert!(dark.iter().all(|v| *v < NEARLY), "{dark:?}");
        let dark = aogrid_glossy(&place, &map, overhead, n, r, lobe[0]);
        assert!(dark.iter().all(|v| *v < NEARLY), "{dark:?}");
    }
}

/// The fraction of what hides all is ½ but for half a root of a rounding, 2e-4, and the level the
/// last but for as much; the next has radiances of some ones more or less, a lobe's too.
const NEARLY: f32 = 1e-3;

#[test]
fn occluders_on_several_sides_are_a_wide_and_thin_cone() {
    let n = [0.0, 0.0, 1.0];
    // Overhead AO is 4a(1 - a): a third of a hemisphere's fraction makes 5/9.
    let (occlusion, a) = (5.0 / 9.0, 1.0 / 6.0);
    for (together, wide) in [(1.0, a), (0.9, 0.25), (0.6, 0.5), (0.0, 0.5)] {
        let sum = 0.5 * occlusion * together;
        let cone = aogrid_occluded_cone([0.0, 0.0, sum, 1.0 - occlusion], n);
        assert!((cone.fraction - wide).abs() < ROUNDING, "{cone:?}");
        assert!((cone.density * wide - a).abs() < ROUNDING, "{cone:?}");
        // A narrow lobe in its middle finds it as dense as it is.
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
        positions: Positions::World,
        normals: Normals::Signed,
    }
}

/// What a pass and the twin are both given.
struct Scene {
    camera: Mat4,
    eye: [f32; 4],
    buffer: GBuffer,
    hidden: Vec<[f32; 4]>,
}

/// The cameras' place, `scene.rs`.
const EYE: Vec3 = Vec3::new(3.0, 2.5, 4.0);

const LOBE: f32 = 0.4;

impl Scene {
    fn new(camera: Mat4) -> Self {
        let mut surfaces = surfaces();
        // A floor and a wall of endless size fill the picture: every pixel shows something.
        surfaces[1].shape = crate::scene::Shape::Plane {
            point: Vec3::new(0.0, 0.0, -2.5),
            normal: Vec3::Z,
        };
        let buffer = gbuffer(camera, &surfaces);
        let hidden = |(idx, n): (usize, &[f32; 4])| {
            let [_, hidden, ..] = receivers()[idx % 512];
            let sum = Vec3::from(xyz(hidden));
            let n = Vec3::from(xyz(*n));
            let above = (sum + 0.6 * sum.length() * n).normalize_or_zero() * sum.length();
            let above = if above.dot(n) < 0.0 {
                above - 2.0 * above.dot(n) * n
            } else {
                above
            };
            above.extend(hidden[3]).to_array()
        };
        let hidden = buffer.normals.iter().enumerate().map(hidden).collect();
        let eye = match camera == orthographic() {
            true => EYE.extend(0.0),
            false => EYE.extend(1.0),
        };
        Self {
            camera,
            eye: eye.to_array(),
            buffer,
            hidden,
        }
    }

    fn draw(&self, bench: &Bench<'_>, descriptor: EnvironmentPassDescriptor) -> Vec<[f32; 4]> {
        let Gpu { device, queue, .. } = bench.gpu;
        let target = bench.gpu.target(SIZE, descriptor.target);
        let mut pass = EnvironmentPass::new(device, descriptor.clone()).unwrap();
        let floats = |texels: &[[f32; 4]]| {
            let format = wgpu::TextureFormat::Rgba32Float;
            bench
                .gpu
                .texture(SIZE, format, bytemuck::cast_slice(texels))
        };
        let positions = match descriptor.positions {
            Positions::World => floats(&self.buffer.positions),
            Positions::Depth => bench.gpu.texture(
                SIZE,
                wgpu::TextureFormat::R32Float,
                bytemuck::cast_slice(&self.buffer.depths),
            ),
        };
        let normals = self
            .buffer
            .normals
            .iter()
            .map(|n| match descriptor.normals {
                Normals::Signed => *n,
                Normals::Unsigned => n.map(|x| 0.5 * x + 0.5),
            });
        let normals = floats(&normals.collect::<Vec<_>>());
        let occlusion = floats(&self.hidden);
        let map = EnvironmentTexture::new(device, queue, &bench.map, "sky");
        let frame = EnvironmentFrame {
            clip_from_world: self.camera.to_cols_array_2d(),
            eye: self.eye,
            lobe_half_angle: LOBE,
            environment: bench.place,
            map: &map,
            occlusion: &occlusion,
            normals: &normals,
            positions: Some(&positions),
        };
        pass.prepare(device, queue, &frame).unwrap();
        let view = target.create_view(&Default::default());
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("test"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        pass.draw(&mut render_pass);
        drop(render_pass);
        queue.submit([encoder.finish()]);
        bytemuck::pod_collect_to_vec(&bench.gpu.read_texture(&target))
    }

    fn twin(&self, bench: &Bench<'_>, reflection: Reflection, pixel: usize) -> [f32; 3] {
        let (n, hidden) = (xyz(self.buffer.normals[pixel]), self.hidden[pixel]);
        match reflection {
            Reflection::Lambertian => aogrid_lambertian(&bench.place, &bench.map, hidden, n),
            Reflection::Glossy => {
                let p = xyz(self.buffer.positions[pixel]);
                let mirrored = aogrid_mirrored(self.eye, p, n);
                let lobe = 0.5 * (1.0 - LOBE.cos());
                aogrid_glossy(&bench.place, &bench.map, hidden, n, mirrored, lobe)
            }
        }
    }

    /// The largest difference between the pass's pixels and the twin's.
    fn worst(&self, bench: &Bench<'_>, descriptor: EnvironmentPassDescriptor) -> f32 {
        let found = self.draw(bench, descriptor.clone());
        let (mut worst, mut lit, mut seen) = (0.0_f32, 0, 0);
        for (pixel, found) in found.iter().enumerate() {
            if self.buffer.receivers[pixel] == [0, 0] {
                continue;
            }
            let expected = self.twin(bench, descriptor.reflection, pixel);
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
fn the_pass_draws_the_twin_s_pictures() {
    let Some(gpu) = gpu() else { return };
    let bench = Bench::new(&gpu);
    // As for the functions one by one; on positions of a few units.
    let tolerance = 2.0 * (bench.filter_error() + 1.5 * 20.0 / 0.17 * ARC_TANGENT / 100.0);
    for camera in [perspective(), reversed(), orthographic()] {
        let scene = Scene::new(camera);
        for reflection in [Reflection::Lambertian, Reflection::Glossy] {
            let worst = scene.worst(&bench, descriptor(reflection));
            assert!(worst <= tolerance, "{reflection:?}: {worst}");
        }
        let from_depth = EnvironmentPassDescriptor {
            positions: Positions::Depth,
            normals: Normals::Unsigned,
            ..descriptor(Reflection::Glossy)
        };
        // Depths are worth 2e-5 of a unit there, of which a viewer four units away makes nothing.
        let worst = scene.worst(&bench, from_depth);
        assert!(worst <= 2.0 * tolerance, "{worst}");
    }
}

#[test]
fn what_does_not_fit_the_pass_is_refused() {
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
    let view = gpu.texture(SIZE, wgpu::TextureFormat::Rgba32Float, &[0; 128 * 96 * 16]);
    let map = EnvironmentTexture::new(device, queue, &sky(), "sky");
    let frame = EnvironmentFrame {
        clip_from_world: [[0.0; 4]; 4],
        eye: [0.0, 1.0, 0.0, 1.0],
        lobe_half_angle: 0.3,
        environment: AogridEnvironment::new(Up::Y, 0.0),
        map: &map,
        occlusion: &view,
        normals: &view,
        positions: None,
    };
    // A diffuse surface asks for none of it.
    let mut diffuse = EnvironmentPass::new(device, descriptor(Reflection::Lambertian)).unwrap();
    diffuse.prepare(device, queue, &frame).unwrap();
    let from_depth = EnvironmentPassDescriptor {
        positions: Positions::Depth,
        ..descriptor(Reflection::Glossy)
    };
    let mut pass = EnvironmentPass::new(device, from_depth).unwrap();
    let mut prepare = |frame| pass.prepare(device, queue, &frame).unwrap_err();
    assert_eq!(prepare(frame), EnvironmentFrameError::Missing("positions"));
    let whole = EnvironmentFrame {
        positions: Some(&view),
        ..frame
    };
    assert_eq!(prepare(whole), EnvironmentFrameError::Camera);
    for lobe_half_angle in [0.0, -1.0, FRAC_PI_2 + 1e-3, f32::NAN] {
        let refusal = prepare(EnvironmentFrame {
            lobe_half_angle,
            ..whole
        });
        assert!(matches!(refusal, EnvironmentFrameError::Lobe(_)));
    }
}
