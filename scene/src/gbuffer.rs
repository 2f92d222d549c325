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
    /// Positions in world space; zero where nothing is seen.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals of the triangles, facing the camera; zero where nothing is seen.
    pub normals: Vec<[f32; 3]>,
    /// Ids of the instances; 0 where nothing is seen.
    pub ids: Vec<u32>,
    /// The distance from the surface, in world units, at which rays should start so that they do
    /// not hit it: an upper bound for the rounding of positions to single floats.
    pub lift: f64,
}

/// The lift as a fraction of the scene's largest half-extent. Positions are rounded by at most 2⁻²⁴
/// of their largest coordinate, which may be several times that half-extent if the scene is not
/// centered at the origin.
const LIFT_PER_EXTENT: f64 = 1e-5;

/// One entry of a G-buffer.
struct Pixel {
    position: [f32; 3],
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
        Ok(Self {
            size: camera.resolution,
            positions: pixels().map(|p| p.position).collect(),
            normals: pixels().map(|p| p.normal).collect(),
            ids: pixels().map(|p| p.id).collect(),
            lift: LIFT_PER_EXTENT * extent,
        })
    }

    /// Returns the pixels that see a surface: their index and the point to shade, lifted off the
    /// surface.
    pub fn receivers(&self) -> Vec<(usize, Receiver)> {
        let seen = (0..self.ids.len()).filter(|&idx| self.ids[idx] != 0);
        seen.map(|idx| {
            let normal = DVec3::from(self.normals[idx].map(f64::from)).normalize();
            let position = DVec3::from(self.positions[idx].map(f64::from)) + self.lift * normal;
            let receiver = Receiver {
                position: position.to_array(),
                normal: normal.to_array(),
            };
            (idx, receiver)
        })
        .collect()
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
            let position = self.positions.iter().map(|p| p[x]);
            channels.push(channel(&format!("P.{axis}"), position));
            let normal = self.normals.iter().map(|n| n[x]);
            channels.push(channel(&format!("N.{axis}"), normal));
        }
        exr(self.size, channels)
    }
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
                position: [0.0; 3],
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
            position: single(origin + hit.distance * direction),
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
