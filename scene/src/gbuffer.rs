//! G-buffers: the position, normal and object id that the camera sees at each pixel.

use std::io::Cursor;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::error::{Context, bail};
use crate::reference::Receiver;
use aogrid_bake_core::{Observer, Progress, TriangleMesh};
use aogrid_baker_cpu::RayScene;
use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, SmallVec, WritableImage};
use glam::DVec3;
use rayon::prelude::*;

use super::{Camera, Scene};

/// A G-buffer with one entry a pixel, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct GBuffer {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The point in world space that positions are relative to: zero but for pictures far from zero.
    pub origin: [f64; 3],
    /// Positions in world space, relative to the origin; zero where nothing is seen.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals of the triangles, facing the camera; zero where nothing is seen.
    pub normals: Vec<[f32; 3]>,
    /// Ids of the instances; 0 where nothing is seen.
    pub ids: Vec<u32>,
    /// The largest half-extent of the scene, in world units.
    extent: f64,
}

/// The largest lift of a receiver off its surface, as a fraction of the scene's largest half-extent.
const LIFT_PER_EXTENT: f64 = 1e-5;

/// The lift as a fraction of a position's largest coordinate: a hundred times the rounding to single
/// floats, 2⁻²⁴, to be beyond it at grazing angles too.
const LIFT_PER_COORDINATE: f64 = 6e-6;

/// The least lift as a fraction of the extent: thousands of times the rounding of a ray's hit in double
/// precision.
const MIN_LIFT_PER_EXTENT: f64 = 1e-11;

/// The distance from zero, in median distances of what is seen from its middle, from which a picture is
/// relative to that middle: coordinates then round by a 10⁻⁵th of that distance.
const FAR: f64 = 256.0;

/// One entry of a G-buffer.
struct Pixel {
    position: DVec3,
    normal: [f32; 3],
    id: u32,
}

impl GBuffer {
    /// Casts a ray through the center of every pixel, on all threads.
    ///
    /// # Errors
    ///
    /// The scene has no camera or no instance, cannot be flattened, or the observer cancelled.
    pub fn trace(scene: &Scene, observer: Observer<'_>) -> crate::Result<Self> {
        let Some(camera) = &scene.camera else {
            bail!(
                "{}: camera: a picture needs one: add a [camera]",
                scene.path.display()
            );
        };
        let Some(mesh) = scene.flattened(|_| true)? else {
            bail!(
                "{}: instance: there is nothing to see: add an [[instance]]",
                scene.path.display()
            );
        };
        let ids: Vec<u32> = scene.instances.iter().map(|instance| instance.id).collect();
        let rays = CameraRays {
            scene: RayScene::new(&mesh),
            mesh: &mesh,
            ids: &ids,
            camera,
        };
        let [width, height] = camera.resolution;
        let done = AtomicUsize::new(0);
        let rows: Option<Vec<Vec<Pixel>>> = (0..height)
            .into_par_iter()
            .map(|y| {
                let row = (0..width).map(|x| rays.pixel([x, y])).collect();
                let done = 1 + done.fetch_add(1, Ordering::Relaxed);
                let total = height as usize;
                match observer(Progress { done, total }) {
                    ControlFlow::Continue(()) => Some(row),
                    ControlFlow::Break(()) => None,
                }
            })
            .collect();
        let Some(rows) = rows else {
            bail!("the rendering was cancelled");
        };
        let pixels = || rows.iter().flatten();
        let extent = mesh.bounds().half_extents().into_iter().fold(0.0, f64::max);
        let seen = pixels().filter(|pixel| pixel.id != 0);
        let origin = origin(&seen.map(|pixel| pixel.position).collect::<Vec<_>>());
        let relative = |pixel: &Pixel| match pixel.id {
            0 => [0.0; 3],
            _ => (pixel.position - origin).as_vec3().to_array(),
        };
        Ok(Self {
            size: camera.resolution,
            positions: pixels().map(relative).collect(),
            origin: origin.to_array(),
            normals: pixels().map(|p| p.normal).collect(),
            ids: pixels().map(|p| p.id).collect(),
            extent,
        })
    }

    /// Returns the pixels that see a surface: their index and the point to shade, lifted off the
    /// surface.
    pub fn receivers(&self) -> Vec<(usize, Receiver)> {
        let seen = (0..self.ids.len()).filter(|&idx| self.ids[idx] != 0);
        seen.map(|idx| {
            let normal = DVec3::from(self.normals[idx].map(f64::from)).normalize();
            let position = DVec3::from(self.positions[idx].map(f64::from));
            let lifted = DVec3::from(self.origin) + position + self.lift(position) * normal;
            let receiver = Receiver {
                position: lifted.to_array(),
                normal: normal.to_array(),
            };
            (idx, receiver)
        })
        .collect()
    }

    /// Returns the distance from the surface at which rays should start so that they do not hit it: beyond
    /// the rounding of a position relative to the origin to single floats, however large the scene is.
    fn lift(&self, position: DVec3) -> f64 {
        let rounded = LIFT_PER_COORDINATE * position.abs().max_element();
        rounded.clamp(
            MIN_LIFT_PER_EXTENT * self.extent,
            LIFT_PER_EXTENT * self.extent,
        )
    }

    /// Returns an EXR file with the channels `P.X` to `P.Z`, `N.X` to `N.Z` and `id`, all 32-bit
    /// floats.
    ///
    /// # Errors
    ///
    /// The picture cannot be encoded.
    pub fn to_exr(&self) -> crate::Result<Vec<u8>> {
        let mut channels = vec![channel("id", self.ids.iter().map(|&id| id as f32))];
        for (x, axis) in ["X", "Y", "Z"].into_iter().enumerate() {
            let world = |p: &[f32; 3]| (self.origin[x] + f64::from(p[x])) as f32;
            let position = self.positions.iter().map(world);
            channels.push(channel(&format!("P.{axis}"), position));
            let normal = self.normals.iter().map(|n| n[x]);
            channels.push(channel(&format!("N.{axis}"), normal));
        }
        exr(self.size, channels)
    }
}

/// Returns the point that these should be relative to, so that single floats hold them: their middle,
/// or zero if that is near enough. A horizon far away does not move it.
pub(crate) fn origin(points: &[DVec3]) -> DVec3 {
    if points.is_empty() {
        return DVec3::ZERO;
    }
    let center = DVec3::from_array(std::array::from_fn(|x| {
        median(points.iter().map(|p| p[x]).collect())
    }));
    let spread = median(
        points
            .iter()
            .map(|p| (p - center).abs().max_element())
            .collect(),
    );
    match center.abs().max_element() > FAR * spread && points.len() > 1 {
        true => center,
        false => DVec3::ZERO,
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Returns an EXR channel of 32-bit floats.
pub fn channel(name: &str, samples: impl Iterator<Item = f32>) -> AnyChannel<FlatSamples> {
    AnyChannel::new(name, FlatSamples::F32(samples.collect()))
}

/// Returns an EXR file with these channels.
pub fn exr(size: [u32; 2], channels: Vec<AnyChannel<FlatSamples>>) -> crate::Result<Vec<u8>> {
    let channels = AnyChannels::sort(SmallVec::from_vec(channels));
    let size = (size[0] as usize, size[1] as usize);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_channels(size, channels)
        .write()
        .to_buffered(&mut bytes)
        .context("cannot encode the EXR image")?;
    Ok(bytes.into_inner())
}

/// Casts the rays of a camera into the flattened scene.
struct CameraRays<'a> {
    scene: RayScene,
    mesh: &'a TriangleMesh,
    /// Instance id of each part of the mesh.
    ids: &'a [u32],
    camera: &'a Camera,
}

impl CameraRays<'_> {
    fn pixel(&self, at: [u32; 2]) -> Pixel {
        let [origin, direction] = self.camera.ray(at);
        let hit = self.scene.closest_hit(origin.into(), direction.into());
        let Some((hit, normal)) = hit.and_then(|hit| Some((hit, self.normal(hit.triangle)?)))
        else {
            return Pixel {
                position: DVec3::ZERO,
                normal: [0.0; 3],
                id: 0,
            };
        };
        let towards = match normal.dot(direction) > 0.0 {
            true => -normal,
            false => normal,
        };
        let single = |v: DVec3| v.to_array().map(|v| v as f32);
        let triangle = hit.triangle as usize;
        let parts = self.mesh.parts();
        let part = parts.partition_point(|part| part.triangles.end <= triangle);
        Pixel {
            position: origin + hit.distance * direction,
            normal: single(towards),
            id: self.ids[part],
        }
    }

    /// Returns the unit normal of a triangle; `None` if the triangle has no area.
    fn normal(&self, triangle: u32) -> Option<DVec3> {
        let corners = self.mesh.triangles()[triangle as usize];
        let [a, b, c] = corners.map(|v| {
            let position = self.mesh.positions()[v as usize];
            DVec3::from(position.map(f64::from))
        });
        (b - a).cross(c - a).try_normalize()
    }
}
