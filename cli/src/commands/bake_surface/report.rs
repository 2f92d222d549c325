//! The report of a surface bake: a line for people, JSON for machines.

use std::time::Duration;

use aogrid_bake_core::surface::{FaceCenters, TexelPoints, VertexRecords};
use aogrid_baker_cpu::SurfaceBake;
use serde::Serialize;

use super::{Args, Bake};
use crate::console::Console;

/// The numbers of a bake.
#[derive(Serialize, Default)]
pub(super) struct Report {
    file: String,
    out: String,
    points: usize,
    rays: u64,
    seconds: f64,
    rays_per_second: f64,
    threads: usize,
    kernel: &'static str,
    /// The name of the GPU; none if the CPU baked.
    adapter: Option<String>,
    weights: &'static str,
    directions: &'static str,
    offset: f64,
    /// The mean accessibility of the points.
    mean: f64,
    /// The share of points none of whose directions are open.
    buried: f64,
    /// The number of triangles without an area.
    flat_faces: usize,
    /// The number of vertices whose faces all have no area, and of vertices of no face.
    filled_vertices: usize,
    unused_vertices: usize,
    /// The share of a texture's covered samples that several triangles cover, and the number of
    /// triangles with coordinates outside 0..1.
    overlaps: f64,
    outside_triangles: usize,
    /// The number of points that the finer model is not near.
    pub misses: usize,
}

impl Report {
    pub(super) fn new(faces: &FaceCenters) -> Self {
        Self {
            flat_faces: faces.flat,
            ..Self::default()
        }
    }

    pub(super) fn texels(points: &TexelPoints) -> Self {
        Self {
            flat_faces: points.flat,
            overlaps: points.overlaps,
            outside_triangles: points.outside,
            ..Self::default()
        }
    }

    pub(super) fn baked(&mut self, bake: &SurfaceBake, time: Duration) {
        let n = bake.records.len();
        let values = bake.records.iter().map(|r| f64::from(r.accessibility));
        let buried = bake.records.iter().filter(|r| r.is_buried()).count();
        self.points = n;
        self.rays = bake.rays;
        self.seconds = time.as_secs_f64();
        self.rays_per_second = bake.rays as f64 / self.seconds.max(f64::MIN_POSITIVE);
        self.threads = rayon::current_num_threads();
        self.kernel = bake.kernel.name();
        self.mean = values.sum::<f64>() / n.max(1) as f64;
        self.buried = buried as f64 / n.max(1) as f64;
    }

    pub(super) fn vertices(&mut self, vertices: &VertexRecords) {
        self.filled_vertices = vertices.filled;
        self.unused_vertices = vertices.unused;
    }

    /// Adds what the bake was asked for.
    pub(super) fn outline(&mut self, file: &str, args: &Args, bake: &Bake<'_>) {
        self.file = file.to_owned();
        self.out = args.out.display().to_string();
        self.weights = bake.options.weights.name();
        self.directions = bake.options.directions.name();
        self.offset = bake.offset;
        self.adapter = bake.device.adapter();
    }

    pub(super) fn print(&self, console: &Console, json: bool) -> anyhow::Result<()> {
        if json {
            return console.json(self);
        }
        let million = |n: f64| n / 1e6;
        console.result(&format!(
            "{}: {} points, {:.1} million rays ({}{}) in {:.2} s: {:.1} million a second; mean \
             accessibility {:.4}, {:.1} % of the points buried",
            self.out,
            self.points,
            million(self.rays as f64),
            self.kernel,
            self.adapter
                .as_ref()
                .map_or(String::new(), |name| format!(", {name}")),
            self.seconds,
            million(self.rays_per_second),
            self.mean,
            100.0 * self.buried,
        ));
        for (count, text) in [
            (
                self.flat_faces,
                "faces have no area, on the surface or in the texture",
            ),
            (
                self.filled_vertices,
                "vertices have only such faces: they have the mean of their neighbors",
            ),
            (
                self.misses,
                "points have none of the finer model within the cage: texels are filled from others, \
                 vertices and faces keep their place",
            ),
            (self.unused_vertices, "vertices have no face: they are open"),
        ] {
            if count > 0 {
                console.note(&format!("{count} {text}"));
            }
        }
        Ok(())
    }
}
