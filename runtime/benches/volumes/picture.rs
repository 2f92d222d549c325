//! The model on a floor, as a camera sees it.

use aogrid_bake_core::mesh::{AnimationTime, MeshFile};
use aogrid_baker_cpu::RayScene;
use aogrid_runtime::GBufferViews;
use glam::camera::rh::{proj::directx, view};
use glam::{DVec3, Mat4, Vec3};

use super::SIZE;

/// The model's triangles, and the G-buffer of a camera that sees it on a floor.
pub struct Picture {
    pub positions: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
    clip_from_world: Mat4,
    pub points: Vec<[f32; 4]>,
    pub normals: Vec<[f32; 4]>,
    pub depths: Vec<f32>,
    /// The ray to each pixel's point: its start, and the way to the point.
    rays: Vec<[Vec3; 2]>,
    /// Whether each pixel is of the floor.
    pub is_floor: Vec<bool>,
}

impl Picture {
    pub fn new(path: &std::path::Path) -> Self {
        let file = MeshFile::read(path).expect("the model is there");
        let pose = AnimationTime {
            animation: Some("Walk"),
            time: 0.3,
        };
        let mesh = file.parse_posed(&pose).expect("it has a walk").mesh;
        let eye = Vec3::new(150.0, 110.0, 190.0);
        let camera = view::look_at_mat4(eye, Vec3::new(0.0, 30.0, -10.0), Vec3::Y);
        let aspect = SIZE[0] as f32 / SIZE[1] as f32;
        let mut picture = Self {
            positions: mesh.positions().to_vec(),
            triangles: mesh.triangles().to_vec(),
            clip_from_world: directx::perspective(0.7, aspect, 1.0, 2000.0) * camera,
            points: vec![],
            normals: vec![],
            depths: vec![],
            rays: vec![],
            is_floor: vec![],
        };
        let scene = RayScene::new(&mesh);
        let world_from_clip = picture.clip_from_world.inverse();
        for (y, x) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (y, x))) {
            let u = (x as f32 + 0.5) / SIZE[0] as f32 * 2.0 - 1.0;
            let v = 1.0 - (y as f32 + 0.5) / SIZE[1] as f32 * 2.0;
            let direction = world_from_clip.project_point3(Vec3::new(u, v, 1.0)) - eye;
            picture.pixel(&scene, eye, direction.normalize());
        }
        picture
    }

    fn pixel(&mut self, scene: &RayScene, eye: Vec3, direction: Vec3) {
        let floor = -eye.y / direction.y;
        let ray = [eye, direction].map(|v| v.as_dvec3().to_array());
        let hit = scene.closest_hit(ray[0], ray[1]);
        let (t, normal) = match hit {
            Some(hit) if !(floor > 0.0 && f64::from(floor) < hit.distance) => {
                let [a, b, c] = self.triangles[hit.triangle as usize]
                    .map(|v| Vec3::from(self.positions[v as usize]));
                (hit.distance as f32, (b - a).cross(c - a).normalize())
            }
            _ => (floor, Vec3::Y),
        };
        let p = eye + t * direction + 1e-3 * normal;
        let clip = self.clip_from_world * p.extend(1.0);
        self.points.push(p.extend(0.0).to_array());
        self.normals.push(normal.extend(0.0).to_array());
        self.depths.push((clip.z / clip.w).clamp(0.0, 1.0));
        self.rays.push([eye, p - eye]);
        self.is_floor.push(t == floor);
    }

    /// Returns the number of prisms of each pixel: those whose back faces are behind its point.
    pub fn prisms(&self, extent: f32) -> Vec<u32> {
        let planes: Vec<_> = self
            .triangles
            .iter()
            .map(|t| self.planes(*t, extent))
            .collect();
        let count = |[from, along]: &[Vec3; 2]| {
            let meets = |planes: &&[(DVec3, f64); 8]| meets(*planes, *from, *along);
            planes.iter().filter(meets).count() as u32
        };
        self.rays.iter().map(count).collect()
    }

    /// Returns the planes of a triangle's prism, their normals outside: both ends, three sides, and
    /// three bevels.
    fn planes(&self, triangle: [u32; 3], extent: f32) -> [(DVec3, f64); 8] {
        let corners = triangle.map(|v| Vec3::from(self.positions[v as usize]).as_dvec3());
        let extent = f64::from(extent);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize();
        let side = |i: usize| {
            let along = (corners[(i + 1) % 3] - corners[i]).normalize();
            along.cross(normal)
        };
        let bevel = |i: usize| (side(i) + side((i + 2) % 3)).normalize();
        let at = |normal: DVec3, p: DVec3, distance: f64| (normal, normal.dot(p) + distance);
        [
            at(-normal, a, 0.0),
            at(normal, a, extent),
            at(side(0), a, extent),
            at(side(1), b, extent),
            at(side(2), c, extent),
            at(bevel(0), a, extent),
            at(bevel(1), b, extent),
            at(bevel(2), c, extent),
        ]
    }

    pub fn frame<'a>(&self, views: &'a [wgpu::TextureView; 2]) -> GBufferViews<'a> {
        GBufferViews {
            clip_from_world: self.clip_from_world.to_cols_array_2d(),
            positions: &views[0],
            normals: Some(&views[1]),
            receivers: None,
        }
    }
}

/// Whether a ray passes through a prism and leaves it behind its end.
fn meets(planes: &[(DVec3, f64); 8], from: Vec3, along: Vec3) -> bool {
    let (from, along) = (from.as_dvec3(), along.as_dvec3());
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for (normal, distance) in planes {
        let (height, slope) = (distance - normal.dot(from), normal.dot(along));
        match slope > 0.0 {
            true => leave = leave.min(height / slope),
            false => enter = enter.max(height / slope),
        }
    }
    enter < leave && leave >= 1.0
}
