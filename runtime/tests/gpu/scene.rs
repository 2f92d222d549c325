use glam::camera::rh::{proj, view};
use glam::{DMat4, DVec3, DVec4, Mat4, Quat, Vec3};

/// The image size. Rows of 32-bit texels must be a multiple of 256 bytes to be read back.
pub const SIZE: [u32; 2] = [128, 96];

/// A surface that receives shadows.
#[derive(Clone, Copy)]
pub struct Surface {
    pub shape: Shape,
    pub object_id: u32,
    pub layers: u32,
}

#[derive(Clone, Copy)]
pub enum Shape {
    Plane { point: Vec3, normal: Vec3 },
    Ball { center: Vec3, radius: f32 },
}

/// The visible surface of every pixel. Positions are NaN where there is none.
pub struct GBuffer {
    pub positions: Vec<[f32; 4]>,
    pub normals: Vec<[f32; 4]>,
    pub receivers: Vec<[u32; 2]>,
    pub depths: Vec<f32>,
}

/// Returns a camera above the floor that looks at the origin.
pub fn perspective() -> Mat4 {
    let view = view::look_at_mat4(Vec3::new(3.0, 2.5, 4.0), Vec3::ZERO, Vec3::Y);
    proj::directx::perspective(0.9, SIZE[0] as f32 / SIZE[1] as f32, 0.1, 50.0) * view
}

/// Returns [`perspective`] with depth reversed: 1 at the near plane.
pub fn reversed() -> Mat4 {
    let swap = Mat4::from_cols_array_2d(&[
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0, 1.0],
    ]);
    swap * perspective()
}

pub fn orthographic() -> Mat4 {
    let view = view::look_at_mat4(Vec3::new(3.0, 2.5, 4.0), Vec3::ZERO, Vec3::Y);
    proj::directx::orthographic(-3.2, 3.2, -2.4, 2.4, 0.1, 50.0) * view
}

/// Returns a floor (object 1, layer 1), a wall (object 2, layer 2) and a ball (object 3, both).
pub fn surfaces() -> Vec<Surface> {
    let plane = |point, normal| Shape::Plane { point, normal };
    vec![
        Surface {
            shape: plane(Vec3::new(0.0, -0.6, 0.0), Vec3::Y),
            object_id: 1,
            layers: 1,
        },
        Surface {
            shape: plane(Vec3::new(0.0, 0.0, -1.5), Vec3::Z),
            object_id: 2,
            layers: 2,
        },
        Surface {
            shape: Shape::Ball {
                center: Vec3::ZERO,
                radius: crate::grids::RADIUS,
            },
            object_id: 3,
            layers: 3,
        },
    ]
}

/// Returns three transforms for a ball: at the origin; rotated, larger and mirrored; small, on the
/// floor.
pub fn transforms() -> [Mat4; 3] {
    let rotation = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.0, -0.4);
    [
        Mat4::IDENTITY,
        Mat4::from_scale_rotation_translation(
            Vec3::new(1.3, -1.3, 1.3),
            rotation,
            Vec3::new(1.2, 0.3, -0.6),
        ),
        Mat4::from_scale_rotation_translation(
            Vec3::splat(0.6),
            rotation,
            Vec3::new(-1.1, -0.3, 0.4),
        ),
    ]
}

/// Ray traces what each pixel shows. Depth grows from 0 at the near plane, except in [`reversed`],
/// whose pixels are those of [`perspective`].
pub fn gbuffer(clip_from_world: Mat4, surfaces: &[Surface]) -> GBuffer {
    gbuffer_of(SIZE, clip_from_world, surfaces)
}

/// Ray traces a G-buffer with a size of its own.
pub fn gbuffer_of(size: [u32; 2], clip_from_world: Mat4, surfaces: &[Surface]) -> GBuffer {
    let forward = match clip_from_world == reversed() {
        true => perspective(),
        false => clip_from_world,
    };
    let world_from_clip = forward.as_dmat4().inverse();
    let mut buffer = GBuffer {
        positions: Vec::new(),
        normals: Vec::new(),
        receivers: Vec::new(),
        depths: Vec::new(),
    };
    for pixel in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y])) {
        let ray = ray(world_from_clip, pixel, size);
        let hits = surfaces.iter().filter_map(|s| hit(s, ray).map(|h| (s, h)));
        let first = hits.min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0));
        let (position, normal, receiver) = match first {
            Some((surface, (_, p, n))) => (p, n, [surface.object_id, surface.layers]),
            None => (Vec3::NAN, Vec3::Y, [0, 0]),
        };
        let clip = clip_from_world.as_dmat4() * position.as_dvec3().extend(1.0);
        buffer.positions.push(position.extend(1.0).to_array());
        buffer.normals.push(normal.extend(0.0).to_array());
        buffer.receivers.push(receiver);
        buffer.depths.push((clip.z / clip.w) as f32);
    }
    buffer
}

/// Returns the origin of a pixel's ray on the near plane, and its direction to the far plane.
fn ray(world_from_clip: DMat4, [x, y]: [u32; 2], size: [u32; 2]) -> [DVec3; 2] {
    let ndc = [
        (f64::from(x) + 0.5) / f64::from(size[0]) * 2.0 - 1.0,
        1.0 - (f64::from(y) + 0.5) / f64::from(size[1]) * 2.0,
    ];
    let at = |depth| (world_from_clip * DVec4::new(ndc[0], ndc[1], depth, 1.0)).project();
    let ends = [at(0.0), at(1.0)];
    [ends[0], ends[1] - ends[0]]
}

/// Returns the ray parameter of the hit, its position, and the normal towards the viewer.
fn hit(surface: &Surface, [from, direction]: [DVec3; 2]) -> Option<(f64, Vec3, Vec3)> {
    let (t, normal) = match surface.shape {
        Shape::Plane { point, normal } => {
            let n = normal.as_dvec3();
            let t = n.dot(point.as_dvec3() - from) / n.dot(direction);
            (t, normal)
        }
        Shape::Ball { center, radius } => {
            let offset = from - center.as_dvec3();
            let (a, b) = (direction.dot(direction), direction.dot(offset));
            let c = offset.dot(offset) - f64::from(radius).powi(2);
            let root = (b * b - a * c).sqrt();
            let t = (-b - root) / a;
            let p = from + direction * t;
            (t, ((p - center.as_dvec3()) / f64::from(radius)).as_vec3())
        }
    };
    // A miss is NaN, which fails both comparisons.
    (t > 0.0 && t < 1.0).then(|| (t, (from + direction * t).as_vec3(), normal))
}
