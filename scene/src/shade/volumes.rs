//! Mode `volumes`: the analytic occlusion of the occluders' triangles (McGuire 2010), by the runtime's
//! CPU twin or its pass.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};

use aogrid_bake_core::Progress;
use aogrid_runtime::AogridVolume;
use aogrid_runtime::volumes::aogrid_volume_occlusion;
use glam::DVec3;
use rayon::prelude::*;

use super::casters::any_mesh;
use super::light::with_light;
use super::raster::volume_occlusion;
use super::triangles::{Triangle, bounds, triangles};
use super::{Gpu, Mode, ShadeInput};
use crate::SceneMesh;
use crate::error::{Context, Result, bail};
use crate::reference::Receiver;

pub(super) static MODE: Mode = Mode {
    name: "volumes",
    summary: "The occluders' triangles near the receiver, analytically, without grids",
    needs_light: false,
    on_cpu: |input| with_light(input, occlusion(input, any_mesh)?),
    on_gpu: Some(|input, gpu| with_light(input, occlusion_on_gpu(input, gpu, any_mesh)?)),
};

/// Number of receivers between two checks for an interrupt.
const CHUNK: usize = 1024;

/// The extent of volumes without one in the scene, relative to the occluders' bounding box.
const EXTENT: f64 = 0.25;

/// The maximum number of boxes along an axis that triangles are sorted into.
const MAX_BOXES: f64 = 64.0;

/// The triangles by the boxes of a lattice that their volumes reach.
struct Boxes {
    low: DVec3,
    size: DVec3,
    counts: [usize; 3],
    /// The first entry of each box in `triangles`, and the end of the last.
    starts: Vec<usize>,
    triangles: Vec<u32>,
}

/// Returns the AO of the casters of chosen meshes for each receiver.
pub(super) fn occlusion(
    input: &ShadeInput<'_>,
    chosen: fn(&SceneMesh) -> bool,
) -> Result<Vec<f32>> {
    let triangles = triangles(input, chosen)?;
    match volume(input, &triangles)? {
        Some(volume) => {
            let boxes = Boxes::new(&triangles, f64::from(volume.extent));
            occlusions(input, &triangles, &boxes, volume)
        }
        None => Ok(unoccluded(input)),
    }
}

/// Returns the same, found on a GPU.
pub(super) fn occlusion_on_gpu(
    input: &ShadeInput<'_>,
    gpu: &Gpu<'_>,
    chosen: fn(&SceneMesh) -> bool,
) -> Result<Vec<f32>> {
    let triangles = triangles(input, chosen)?;
    match volume(input, &triangles)? {
        Some(volume) => volume_occlusion(input, gpu, &triangles, volume),
        None => Ok(unoccluded(input)),
    }
}

fn unoccluded(input: &ShadeInput<'_>) -> Vec<f32> {
    vec![0.0; input.target.receivers.len()]
}

/// Returns the volumes of the scene's settings; `None` without triangles.
fn volume(input: &ShadeInput<'_>, triangles: &[Triangle<'_>]) -> Result<Option<AogridVolume>> {
    if triangles.is_empty() {
        return Ok(None);
    }
    let settings = &input.scene.volumes;
    let [low, high] = bounds(triangles);
    let by_default = (EXTENT * (high - low).max_element()) as f32;
    let extent = settings.extent.unwrap_or(by_default);
    let volume = AogridVolume::new(extent, settings.weight, settings.two_sided)
        .with_context(|| input.scene.path.display().to_string())?;
    Ok(Some(volume))
}

/// Returns the AO of all triangles for each receiver.
fn occlusions(
    input: &ShadeInput<'_>,
    triangles: &[Triangle<'_>],
    boxes: &Boxes,
    volume: AogridVolume,
) -> Result<Vec<f32>> {
    let (target, instances) = (input.target, &input.instances);
    let stage = (input.stages)("volumes");
    let total = target.receivers.len();
    let done = AtomicUsize::new(0);
    let chunks = target.receivers.par_chunks(CHUNK);
    let shade = |(receivers, ids): (&[Receiver], &[u32])| {
        let done = done.fetch_add(receivers.len(), Ordering::Relaxed) + receivers.len();
        if let ControlFlow::Break(()) = stage(Progress { done, total }) {
            bail!("interrupted");
        }
        let occlusion = |(receiver, &id): (&Receiver, &u32)| {
            let layers = instances.layers(id);
            let near = boxes.around(DVec3::from(receiver.position));
            let casting = near
                .iter()
                .map(|&idx| &triangles[idx as usize])
                .filter(|triangle| triangle.instance.casts_on_receiver(id, layers));
            let sum: f32 = casting.map(|t| t.occlusion(receiver, volume)).sum();
            sum.min(1.0)
        };
        Ok(receivers.iter().zip(ids).map(occlusion).collect::<Vec<_>>())
    };
    let chunks = chunks.zip(target.ids.par_chunks(CHUNK));
    let shaded: Result<Vec<Vec<f32>>> = chunks.map(shade).collect();
    Ok(shaded?.concat())
}

impl Triangle<'_> {
    fn occlusion(&self, receiver: &Receiver, volume: AogridVolume) -> f32 {
        let p = DVec3::from(receiver.position);
        let corners = self.corners.map(|c| (c - p).as_vec3().to_array());
        let normal = receiver.normal.map(|x| x as f32);
        self.instance.strength * aogrid_volume_occlusion(volume, corners, normal)
    }
}

impl Boxes {
    /// Sorts triangles, each into the boxes that it reaches.
    fn new(triangles: &[Triangle<'_>], extent: f64) -> Self {
        let [low, high] = bounds(triangles);
        let (low, high) = (low - extent, high + extent);
        let counts = ((high - low) / extent)
            .ceil()
            .clamp(DVec3::ONE, DVec3::splat(MAX_BOXES));
        let mut boxes = Self {
            low,
            size: (high - low) / counts,
            counts: counts.to_array().map(|n| n as usize),
            starts: vec![],
            triangles: vec![],
        };
        let reaches: Vec<_> = triangles
            .iter()
            .map(|triangle| boxes.reached(triangle, extent))
            .collect();
        let mut ends = vec![0; counts.element_product() as usize + 1];
        for reach in &reaches {
            boxes.each(*reach, |at| ends[at + 1] += 1);
        }
        for at in 1..ends.len() {
            ends[at] += ends[at - 1];
        }
        boxes.starts = ends.clone();
        boxes.triangles = vec![0; ends.last().copied().unwrap_or(0)];
        let mut sorted = std::mem::take(&mut boxes.triangles);
        for (idx, reach) in (0..).zip(&reaches) {
            boxes.each(*reach, |at| {
                sorted[ends[at]] = idx;
                ends[at] += 1;
            });
        }
        boxes.triangles = sorted;
        boxes
    }

    /// Returns the first and last boxes that a triangle's volume reaches.
    fn reached(&self, triangle: &Triangle<'_>, extent: f64) -> [[usize; 3]; 2] {
        let [a, b, c] = triangle.corners;
        let low = a.min(b).min(c) - extent;
        let high = a.max(b).max(c) + extent;
        [low, high].map(|p| self.at(p))
    }

    /// Returns the box that holds a point, or the nearest one.
    fn at(&self, p: DVec3) -> [usize; 3] {
        let at = ((p - self.low) / self.size).floor().to_array();
        std::array::from_fn(|x| (at[x].max(0.0) as usize).min(self.counts[x] - 1))
    }

    fn each(&self, [first, last]: [[usize; 3]; 2], mut visit: impl FnMut(usize)) {
        for k in first[2]..=last[2] {
            for j in first[1]..=last[1] {
                for i in first[0]..=last[0] {
                    visit((k * self.counts[1] + j) * self.counts[0] + i);
                }
            }
        }
    }

    /// Returns the triangles whose volumes may hold a point, in ascending order.
    fn around(&self, p: DVec3) -> &[u32] {
        let [i, j, k] = self.at(p);
        let at = (k * self.counts[1] + j) * self.counts[0] + i;
        &self.triangles[self.starts[at]..self.starts[at + 1]]
    }
}
