//! Ray-traced ambient occlusion of a view, one ray a pixel and pass: the truth that grids approximate.
//!
//! As with grids, objects occlude and receivers do not: the planes of the room hide nothing from each
//! other. The rays of a pixel follow a low-discrepancy sequence with a random start, and their
//! directions are distributed as the cosine, so that AO is the occluded share of rays.

use glam::{DMat4, DVec3};

use crate::model::Model;

/// A camera in perspective and the size of its image.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Pixels along x and y.
    pub size: [usize; 2],
    /// The position of the camera.
    pub eye: DVec3,
    /// The map from clip space, y up, to world space.
    pub world_from_clip: DMat4,
}

/// A receiver that is a parallelogram.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// Its center.
    pub center: DVec3,
    /// The vectors from the center to the middles of two edges; their cross product is the normal.
    pub half_edges: [DVec3; 2],
}

/// An object in the scene.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// The index of its model.
    pub model: usize,
    /// The map from object space, relative to the mesh's origin, to world space.
    pub world_from_object: DMat4,
}

/// An instance with the inverse of its transform.
struct Placed<'a> {
    model: &'a Model,
    world_from_object: DMat4,
    object_from_world: DMat4,
}

/// A point that a pixel shows.
#[derive(Clone, Copy)]
struct Receiver {
    position: DVec3,
    normal: DVec3,
}

/// The accumulated rays of a view.
pub struct Truth {
    instances: Vec<Instance>,
    receivers: Vec<Option<Receiver>>,
    occluded: Vec<u32>,
    passes: u32,
}

impl Truth {
    /// Finds what each pixel shows. `models` have their [rays prepared](Model::prepare_rays).
    pub fn new(view: &View, planes: &[Plane], instances: &[Instance], models: &[Model]) -> Self {
        let instances: Vec<_> = instances.to_vec();
        let placed = place(&instances, models);
        let [width, height] = view.size;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        let receivers: Vec<_> = pixels
            .map(|pixel| receiver(view.eye, view.direction(pixel), planes, &placed))
            .collect();
        Self {
            occluded: vec![0; receivers.len()],
            passes: 0,
            receivers,
            instances,
        }
    }

    /// Traces one more ray for each pixel.
    pub fn trace(&mut self, models: &[Model]) {
        let placed = place(&self.instances, models);
        for (idx, receiver) in self.receivers.iter().enumerate() {
            let Some(receiver) = receiver else { continue };
            let direction = cosine_direction(receiver.normal, sample(idx as u32, self.passes));
            // Receivers on an object start outside it despite the rounding of their positions.
            let scale = receiver.position.abs().max_element().max(1e-3);
            let origin = receiver.position + receiver.normal * (1e-5 * scale);
            let is_occluded = placed.iter().any(|instance| {
                let origin = instance.object_from_world.transform_point3(origin);
                let direction = instance.object_from_world.transform_vector3(direction);
                instance.is_occluded(origin, direction)
            });
            self.occluded[idx] += u32::from(is_occluded);
        }
        self.passes += 1;
    }

    /// Returns 1 − AO of each pixel, rows from top to bottom; 1 where nothing is seen.
    pub fn transmittance(&self) -> Vec<f32> {
        let per_ray = 1.0 / self.passes.max(1) as f32;
        let of = |&occluded: &u32| 1.0 - occluded as f32 * per_ray;
        self.occluded.iter().map(of).collect()
    }
}

impl View {
    /// Returns the direction from the eye through the center of a pixel.
    fn direction(&self, [x, y]: [usize; 2]) -> DVec3 {
        let ndc = |idx: usize, n: usize| (2 * idx + 1) as f64 / n as f64 - 1.0;
        let [width, height] = self.size;
        let clip = DVec3::new(ndc(x, width), -ndc(y, height), 1.0);
        (self.world_from_clip.project_point3(clip) - self.eye).normalize()
    }
}

impl Plane {
    /// Returns the distance at which a ray hits the plane from its front.
    fn hit(&self, origin: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
        let [u, v] = self.half_edges;
        let normal = u.cross(v).normalize();
        let along = direction.dot(normal);
        let distance = (self.center - origin).dot(normal) / along;
        let off_center = origin + direction * distance - self.center;
        let is_inside = [u, v]
            .iter()
            .all(|edge| off_center.dot(*edge).abs() <= edge.length_squared());
        (along < 0.0 && distance > 0.0 && is_inside).then_some((distance, normal))
    }
}

impl Placed<'_> {
    fn origin(&self) -> DVec3 {
        DVec3::from(self.model.loaded.mesh.origin())
    }

    fn is_occluded(&self, origin: DVec3, direction: DVec3) -> bool {
        let origin = (origin + self.origin()).to_array();
        let rays = self.model.rays();
        rays.is_some_and(|rays| rays.is_occluded(origin, direction.to_array(), f64::INFINITY))
    }

    /// Returns the distance, relative to the direction's length, and the normal where a ray in world
    /// space hits the object, towards the ray's origin.
    fn hit(&self, origin: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
        let local_origin = self.object_from_world.transform_point3(origin);
        let local = self.object_from_world.transform_vector3(direction);
        let absolute = (local_origin + self.origin()).to_array();
        let hit = self.model.rays()?.closest_hit(absolute, local.to_array())?;
        let distance = hit.distance / local.length();
        let normal = self.normal(hit.triangle as usize, local_origin + local * distance);
        // Normals go with the inverse transpose.
        let world = self.object_from_world.transpose().transform_vector3(normal);
        let world = world.normalize();
        let faces_away = world.dot(direction) > 0.0;
        Some((distance, if faces_away { -world } else { world }))
    }

    /// Returns the interpolated normal of a triangle at a point on it.
    fn normal(&self, triangle: usize, point: DVec3) -> DVec3 {
        let corners = &self.model.corners[3 * triangle..][..3];
        let at = |idx: usize| DVec3::from(corners[idx].position.map(f64::from));
        let normal = |idx: usize| DVec3::from(corners[idx].normal.map(f64::from));
        let (a, b, c) = (at(0), at(1), at(2));
        let face = (b - a).cross(c - a);
        let per_area = 1.0 / face.length_squared();
        let weight_b = (point - a).cross(c - a).dot(face) * per_area;
        let weight_c = (b - a).cross(point - a).dot(face) * per_area;
        let weight_a = 1.0 - weight_b - weight_c;
        normal(0) * weight_a + normal(1) * weight_b + normal(2) * weight_c
    }
}

fn place<'a>(instances: &[Instance], models: &'a [Model]) -> Vec<Placed<'a>> {
    let placed = |instance: &Instance| Placed {
        model: &models[instance.model],
        world_from_object: instance.world_from_object,
        object_from_world: instance.world_from_object.inverse(),
    };
    let all = instances.iter().map(placed);
    all.filter(|placed| placed.world_from_object.determinant() != 0.0)
        .collect()
}

/// Returns what a ray from the eye sees first.
fn receiver(
    eye: DVec3,
    direction: DVec3,
    planes: &[Plane],
    placed: &[Placed<'_>],
) -> Option<Receiver> {
    let on_planes = planes.iter().filter_map(|plane| plane.hit(eye, direction));
    let on_objects = placed
        .iter()
        .filter_map(|object| object.hit(eye, direction));
    let closest = on_planes
        .chain(on_objects)
        .min_by(|a, b| a.0.total_cmp(&b.0));
    closest.map(|(distance, normal)| Receiver {
        position: eye + direction * distance,
        normal,
    })
}

/// Returns the point of pass `pass` in the unit square for a pixel: an additive sequence of the plastic
/// number, which fills the square evenly, from a start that is random for each pixel.
fn sample(pixel: u32, pass: u32) -> [f64; 2] {
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let starts = [hash(pixel), hash(pixel ^ 0x9E37_79B9)];
    [0, 1].map(|x| (f64::from(starts[x]) / 4_294_967_296.0 + STEPS[x] * f64::from(pass)).fract())
}

/// Returns a well mixed number.
fn hash(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7FEB_352D);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846C_A68B);
    x ^ (x >> 16)
}

/// Returns a direction around the normal that is distributed as the cosine.
fn cosine_direction(normal: DVec3, [u, v]: [f64; 2]) -> DVec3 {
    let (sin, cos) = (v * std::f64::consts::TAU).sin_cos();
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let radius = u.sqrt();
    tangent * (radius * cos) + bitangent * (radius * sin) + normal * (1.0 - u).sqrt()
}
