use aogrid_gpu_support::{Gpu, attachment, gpu, gpu_with, read_only_depth};
use aogrid_runtime::volumes::aogrid_volume_occlusion;
use aogrid_runtime::{
    AOGRID_NO_OBJECT, AogridVolume, DepthTest, GBufferFormat, GBufferViews, Normals, Positions,
    Receivers, VolumeFrame, VolumeFrameError, VolumeObject, VolumePass, VolumePassDescriptor,
    VolumePassError, VolumeResolution, VolumeWeight, wgsl,
};
use glam::{Mat4, Vec3};

use crate::kernel::evaluate;
use crate::scene::{
    GBuffer, SIZE, gbuffer, orthographic, perspective, reversed, surfaces, transforms,
};

/// The largest difference between a triangle's occlusion on the device and by the twin: some ten
/// roundings of numbers up to 1.
pub(crate) const PER_TRIANGLE: f32 = 1e-6;

/// The triangles of a unit cube around the origin, counter-clockwise from outside.
fn cube() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let corner = |i: u32| [0, 1, 2].map(|axis| 0.5 - (i >> axis & 1) as f32);
    let sides = [
        [0, 2, 6, 4],
        [1, 5, 7, 3],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 1, 3, 2],
        [4, 6, 7, 5],
    ];
    let triangles = sides
        .into_iter()
        .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    ((0..8).map(corner).collect(), triangles.collect())
}

/// A frame: cubes at transforms, over the surfaces of the other tests.
pub(crate) struct Cubes {
    pub(crate) camera: Mat4,
    pub(crate) buffer: GBuffer,
    pub(crate) resolution: VolumeResolution,
    pub(crate) depth: Option<DepthTest>,
    pub(crate) volume: AogridVolume,
    pub(crate) vertices: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) transforms: Vec<Mat4>,
    pub(crate) excluded: u32,
}

impl Cubes {
    pub(crate) fn new(camera: Mat4, volume: AogridVolume) -> Self {
        let (vertices, triangles) = cube();
        Self {
            camera,
            buffer: gbuffer(camera, &surfaces()),
            resolution: VolumeResolution::Full,
            depth: None,
            volume,
            vertices,
            triangles,
            transforms: transforms().to_vec(),
            excluded: AOGRID_NO_OBJECT,
        }
    }

    fn object<'a>(&self, buffers: &'a [wgpu::Buffer; 2], transform: &Mat4) -> VolumeObject<'a> {
        VolumeObject {
            positions: &buffers[0],
            stride: 3,
            indices: &buffers[1],
            triangles: self.triangles.len() as u32,
            world_from_object: transform.to_cols_array_2d(),
            volume: self.volume,
            strength: 0.9,
            layers: 3,
            excluded: [
                self.excluded,
                AOGRID_NO_OBJECT,
                AOGRID_NO_OBJECT,
                AOGRID_NO_OBJECT,
            ],
        }
    }

    fn buffers(&self, gpu: &Gpu) -> [wgpu::Buffer; 2] {
        [
            gpu.storage(bytemuck::cast_slice(&self.vertices)),
            gpu.storage(bytemuck::cast_slice(&self.triangles)),
        ]
    }

    /// Returns the sums that the pass draws.
    pub(crate) fn draw(&self, gpu: &Gpu) -> Vec<f32> {
        let Gpu { device, queue, .. } = gpu;
        let format = VolumePass::target_format(device);
        assert_eq!(format, wgpu::TextureFormat::R32Float);
        let descriptor = VolumePassDescriptor {
            label: "test".into(),
            target: format,
            resolution: self.resolution,
            gbuffer: GBufferFormat {
                positions: Positions::World,
                normals: Normals::Signed,
                receivers: Receivers::IdsAndLayers,
                depth: self.depth,
            },
            front_face: wgpu::FrontFace::Ccw,
        };
        let mut pass = VolumePass::new(device, &descriptor).unwrap();
        let floats = wgpu::TextureFormat::Rgba32Float;
        let positions = gpu.upload(SIZE, floats, bytemuck::cast_slice(&self.buffer.positions));
        let normals = gpu.upload(SIZE, floats, bytemuck::cast_slice(&self.buffer.normals));
        let ids = wgpu::TextureFormat::Rg32Uint;
        let receivers = gpu.upload(SIZE, ids, bytemuck::cast_slice(&self.buffer.receivers));
        let buffers = self.buffers(gpu);
        let objects = self.transforms.iter();
        let objects: Vec<_> = objects.map(|m| self.object(&buffers, m)).collect();
        let frame = VolumeFrame {
            gbuffer: GBufferViews {
                clip_from_world: self.camera.to_cols_array_2d(),
                positions: &positions,
                normals: Some(&normals),
                receivers: Some(&receivers),
            },
            objects: &objects,
        };
        pass.prepare(device, queue, &frame).unwrap();
        let target = gpu.target(self.resolution.target_size(SIZE), format);
        let view = target.create_view(&Default::default());
        let depth = self.depth.map(|_| self.depth_view(gpu));
        let mut encoder = device.create_command_encoder(&Default::default());
        let clear = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("test"),
            color_attachments: &[attachment(&view, clear)],
            depth_stencil_attachment: depth.as_ref().map(read_only_depth),
            ..Default::default()
        });
        pass.draw(&mut render_pass);
        drop(render_pass);
        queue.submit([encoder.finish()]);
        bytemuck::pod_collect_to_vec(&gpu.read_texture(&target))
    }

    fn depth_view(&self, gpu: &Gpu) -> wgpu::TextureView {
        let target = gpu.target_depth(SIZE, wgpu::TextureFormat::Depth32Float);
        let depths = self.buffer.depths.iter();
        let depths: Vec<f32> = depths.map(|d| if d.is_nan() { 0.5 } else { *d }).collect();
        gpu.fill_depth(&target, &depths, SIZE);
        target.create_view(&Default::default())
    }

    /// Returns the twin's sums, triangle by triangle at every pixel.
    pub(crate) fn twin(&self) -> Vec<f32> {
        let triangles: Vec<[Vec3; 3]> = self
            .transforms
            .iter()
            .flat_map(|m| self.placed(m))
            .collect();
        let pixels = self.buffer.positions.iter().zip(&self.buffer.normals);
        let sum = |((p, n), id): ((&[f32; 4], &[f32; 4]), u32)| {
            let [p, n] = [p, n].map(|v| Vec3::new(v[0], v[1], v[2]));
            // The sky has no object and no position.
            if id == 0 || id == self.excluded {
                return 0.0;
            }
            let of = |triangle: &[Vec3; 3]| {
                let corners = triangle.map(|corner| (corner - p).to_array());
                0.9 * aogrid_volume_occlusion(self.volume, corners, n.to_array())
            };
            triangles.iter().map(of).sum()
        };
        let ids = self.buffer.receivers.iter().map(|[id, _]| *id);
        pixels.zip(ids).map(sum).collect()
    }

    /// Returns the triangles in world space, their fronts outside.
    pub(crate) fn placed(&self, transform: &Mat4) -> Vec<[Vec3; 3]> {
        let at = |i: u32| transform.transform_point3(Vec3::from(self.vertices[i as usize]));
        let mirrored = transform.determinant() < 0.0;
        let triangle = |&[a, b, c]: &[u32; 3]| match mirrored {
            true => [a, c, b].map(at),
            false => [a, b, c].map(at),
        };
        self.triangles.iter().map(triangle).collect()
    }

    fn max_difference(&self, gpu: &Gpu) -> f32 {
        let (found, expected) = (self.draw(gpu), self.twin());
        let shaded = expected.iter().filter(|sum| **sum > 0.01).count();
        assert!(shaded > 500, "{shaded} pixels are too few");
        let differences = found.iter().zip(&expected).map(|(a, b)| (a - b).abs());
        differences.fold(0.0, f32::max)
    }
}

pub(crate) fn linear(extent: f32) -> AogridVolume {
    AogridVolume::new(extent, VolumeWeight::Linear { exponent: 1.0 }, false).unwrap()
}

pub(crate) fn device() -> Option<Gpu> {
    gpu_with(wgpu::Features::FLOAT32_BLENDABLE)
}

#[test]
fn the_term_is_that_of_the_twin() {
    const INPUTS: &str = "
struct Input { a: vec4f, b: vec4f, c: vec4f, n: vec4f }
fn value(input: Input) -> vec4f {
    let a = input.a.xyz;
    let b = input.b.xyz;
    let c = input.c.xyz;
    let kinds = array(AOGRID_WEIGHT_NONE, AOGRID_WEIGHT_LINEAR, AOGRID_WEIGHT_EDGES);
    var values = vec4f();
    for (var i = 0u; i < 3u; i++) {
        let volume = AogridVolume(2.5, 1.5, kinds[i], 1u);
        values[i] = aogrid_volume_occlusion(volume, a, b, c, input.n.xyz);
    }
    return values;
}";
    let Some(gpu) = gpu() else { return };
    let source = [wgsl::SHADING, wgsl::VOLUMES, INPUTS].concat();
    let mut state = 1_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 8_388_608.0 - 1.0
    };
    let mut vector = || Vec3::new(random(), random(), random());
    let inputs: Vec<[[f32; 4]; 4]> = (0..4000)
        .map(|_| {
            let center = 1.5 * vector();
            let [a, b, c] = [(); 3].map(|()| center + vector());
            [a, b, c, vector().normalize()].map(|v| v.extend(0.0).to_array())
        })
        .collect();
    let found = evaluate(&gpu, &source, vec![], &inputs);
    let kinds = [
        VolumeWeight::None,
        VolumeWeight::Linear { exponent: 1.5 },
        VolumeWeight::Edges { exponent: 1.5 },
    ];
    let (mut worst, mut seen) = ([0.0_f32; 3], 0);
    for (input, found) in inputs.iter().zip(&found) {
        let [a, b, c, n] = input.map(|[x, y, z, _]| [x, y, z]);
        for (i, kind) in kinds.into_iter().enumerate() {
            let volume = AogridVolume::new(2.5, kind, true).unwrap();
            let expected = aogrid_volume_occlusion(volume, [a, b, c], n);
            worst[i] = worst[i].max((found[i] - expected).abs());
            seen += usize::from(expected > 0.01);
        }
    }
    println!("none, linear, edges: off by at most {worst:?}, {seen} above 0.01");
    assert!(seen > 2000, "{seen}");
    assert!(worst.iter().all(|w| *w <= PER_TRIANGLE), "{worst:?}");
}

#[test]
fn every_projection_draws_the_sums_of_the_twin() {
    let Some(gpu) = device() else { return };
    // The smaller volumes end within the picture. The larger hold the camera, cross the near plane and
    // cover the screen.
    for extent in [0.4, 6.0] {
        for camera in [perspective(), orthographic()] {
            let worst = Cubes::new(camera, linear(extent)).max_difference(&gpu);
            println!("extent {extent}: off by at most {worst}");
            assert!(worst <= 36.0 * PER_TRIANGLE, "{extent}: {worst}");
        }
    }
}

#[test]
fn a_depth_test_changes_nothing() {
    let Some(gpu) = device() else { return };
    let compares = [
        (perspective(), wgpu::CompareFunction::GreaterEqual),
        (reversed(), wgpu::CompareFunction::LessEqual),
    ];
    for (camera, compare) in compares {
        let plain = Cubes::new(camera, linear(0.4));
        let tested = Cubes {
            depth: Some(DepthTest {
                format: wgpu::TextureFormat::Depth32Float,
                compare,
            }),
            ..Cubes::new(camera, linear(0.4))
        };
        let (without, with) = (plain.draw(&gpu), tested.draw(&gpu));
        let seen = plain.buffer.receivers.iter().map(|[id, _]| *id != 0);
        let same = without.iter().zip(&with).zip(seen);
        let different = same.filter(|((a, b), seen)| *seen && a != b).count();
        assert_eq!(different, 0);
        // The same bits again.
        assert_eq!(with, tested.draw(&gpu));
    }
}

#[test]
fn excluded_receivers_and_both_sides_are_those_of_the_twin() {
    let Some(gpu) = device() else { return };
    let kind = VolumeWeight::Linear { exponent: 2.0 };
    let both = AogridVolume::new(0.4, kind, true).unwrap();
    let cubes = Cubes {
        excluded: 1,
        ..Cubes::new(perspective(), both)
    };
    let worst = cubes.max_difference(&gpu);
    assert!(worst <= 36.0 * PER_TRIANGLE, "{worst}");
}

#[test]
fn broken_triangles_draw_nothing() {
    let Some(gpu) = device() else { return };
    let whole = Cubes::new(perspective(), linear(0.4));
    let mut broken = Cubes::new(perspective(), linear(0.4));
    broken.vertices.push([f32::NAN, 0.0, 0.0]);
    broken.vertices.push([f32::INFINITY, 0.0, 0.0]);
    broken.triangles.extend([
        [0, 1, 8],
        [0, 1, 9],
        [0, 1, 10],
        [0, 1, u32::MAX],
        [2, 2, 3],
        [4, 4, 4],
    ]);
    assert_eq!(whole.draw(&gpu), broken.draw(&gpu));
}

#[test]
fn frames_that_cannot_be_drawn_are_refused() {
    let Some(gpu) = device() else { return };
    let Gpu { device, queue, .. } = &gpu;
    let cubes = Cubes::new(perspective(), linear(0.4));
    let descriptor = |target| VolumePassDescriptor {
        label: "test".into(),
        target,
        resolution: VolumeResolution::Full,
        gbuffer: GBufferFormat {
            positions: Positions::World,
            normals: Normals::Signed,
            receivers: Receivers::None,
            depth: None,
        },
        front_face: wgpu::FrontFace::Ccw,
    };
    let bytes = wgpu::TextureFormat::Rgba8Unorm;
    let refused = VolumePass::new(device, &descriptor(bytes)).unwrap_err();
    assert_eq!(refused, VolumePassError::Target(bytes));
    let mut pass = VolumePass::new(device, &descriptor(wgpu::TextureFormat::R32Float)).unwrap();
    let buffers = cubes.buffers(&gpu);
    let good = cubes.object(&buffers, &Mat4::IDENTITY);
    let texels = bytemuck::cast_slice(&cubes.buffer.positions);
    let view = gpu.upload(SIZE, wgpu::TextureFormat::Rgba32Float, texels);
    let mut refusal = |object: VolumeObject<'_>| {
        let frame = VolumeFrame {
            gbuffer: GBufferViews {
                clip_from_world: perspective().to_cols_array_2d(),
                positions: &view,
                normals: Some(&view),
                receivers: None,
            },
            objects: &[good, object],
        };
        pass.prepare(device, queue, &frame).unwrap_err()
    };
    let object = 1;
    let stride = refusal(VolumeObject { stride: 2, ..good });
    assert_eq!(stride, VolumeFrameError::Stride { object, stride: 2 });
    let triangles = 13;
    let indices = refusal(VolumeObject { triangles, ..good });
    assert_eq!(indices, VolumeFrameError::Indices { object, triangles });
    let flat = Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0)).to_cols_array_2d();
    let singular = refusal(VolumeObject {
        world_from_object: flat,
        ..good
    });
    assert!(matches!(
        singular,
        VolumeFrameError::Object { object: 1, .. }
    ));
}
