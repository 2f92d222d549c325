//! The irregular z-buffer: visibility of all points in shared directions, without rays.
//!
//! # Theory
//!
//! Johnson et al. (*The Irregular Z-Buffer*, ACM TOG 24, 2005) and Aila and Laine (*Alias-Free Shadow
//! Maps*, EGSR 2004) turn a shadow map around: the receivers are known, so that they, not pixels, are
//! the samples. For a direction d:
//!
//! 1. All points and vertices are projected along d (`frame.rs`).
//! 2. The points are sorted into the cells of a plane grid, two to four a cell (`bins.rs`). Of d and −d
//!    one is above a point; the points of each are sorted apart and see the depth with its sign.
//! 3. Each triangle tests the points in the cells that it covers, row by row, eight at a time: within
//!    it by its edges, behind it by its plane (`triangle.rs`). Cells all of whose points are in front
//!    of the triangle are skipped.
//!
//! There is no hierarchy, no connectivity, no bias and no resolution.
//!
//! Coordinates are single floats. Each test has a bound of its rounding error, which `triangle.rs`
//! derives; a point whose bit depends on less is in *doubt*, and a ray decides, so that all bits are
//! those of [`RayScene::is_occluded`]. Directions are the unit of threading. Their bits are added up
//! in the order of directions, as the rays' are.
//!
//! # Practice
//!
//! [`trace`] is all. A batch of directions is projected at a time, which bounds the memory for bits.

mod bins;
mod frame;
mod order;
mod simd;
mod triangle;

use std::sync::atomic::{AtomicUsize, Ordering};

use aogrid_bake_core::surface::{Accumulator, SurfaceOptions, SurfacePoint, shared_directions};
use aogrid_bake_core::{Observer, Progress, TriangleMesh};
use rayon::prelude::*;

use super::rays::is_occluded;
use crate::{BakeError, RayScene};
use bins::{Bins, Vertex};
use frame::{Frame, Scaled};
use triangle::Projected;

/// The directions of a batch: enough for many threads. A batch takes a bit a point and direction.
const BATCH: usize = 64;

/// Points that are added up at a time by a thread.
const POINT_CHUNK: usize = 1024;

/// The state of a point in a direction: the bits of all triangles together.
pub(super) const OCCLUDED: u32 = 1;
pub(super) const DOUBT: u32 = 2;

/// All that does not depend on the direction.
struct Job<'a> {
    rays: RayScene,
    points: &'a [SurfacePoint],
    scaled: Scaled,
    options: &'a SurfaceOptions,
}

/// Returns the sums of all points over the shared directions.
pub(super) fn trace(
    mesh: &TriangleMesh,
    points: &[SurfacePoint],
    options: &SurfaceOptions,
    observer: Observer<'_>,
) -> Result<Vec<Accumulator>, BakeError> {
    let mut scaled = Scaled::new(mesh, points);
    // Neighbors in space fall into the same cells: in memory they share cache lines then.
    let order = order::z_curve(scaled.points.iter().copied());
    scaled.points = order
        .iter()
        .map(|idx| scaled.points[*idx as usize])
        .collect();
    scaled.sort_triangles();
    let sorted: Vec<_> = order.iter().map(|idx| points[*idx as usize]).collect();
    let points = &sorted;
    let job = Job {
        rays: RayScene::new(mesh),
        points,
        scaled,
        options,
    };
    let directions = shared_directions(options.rays);
    let mut sums = vec![Accumulator::default(); points.len()];
    let done = AtomicUsize::new(0);
    for batch in directions.chunks(BATCH) {
        let bits = batch
            .par_iter()
            .map_init(Scratch::default, |scratch, &direction| {
                let bits = job.direction(direction, scratch);
                let progress = Progress {
                    done: done.fetch_add(1, Ordering::Relaxed) + 1,
                    total: directions.len(),
                };
                match observer(progress).is_break() {
                    true => Err(BakeError::Cancelled),
                    false => Ok(bits),
                }
            });
        let bits = bits.collect::<Result<Vec<_>, _>>()?;
        let chunks = sums.par_chunks_mut(POINT_CHUNK).enumerate();
        chunks.for_each(|(chunk, sums)| {
            for (idx, sum) in (chunk * POINT_CHUNK..).zip(sums) {
                for (&direction, bits) in batch.iter().zip(&bits) {
                    sum.add(&points[idx], direction, options.weights, bits.get(idx));
                }
            }
        });
    }
    let mut in_order = sums.clone();
    for (idx, sum) in order.into_iter().zip(sums) {
        in_order[idx as usize] = sum;
    }
    Ok(in_order)
}

/// The occluded points of a direction and its opposite.
struct Bits(Vec<u64>);

impl Bits {
    fn set(&mut self, idx: usize) {
        self.0[idx / 64] |= 1 << (idx % 64);
    }

    fn get(&self, idx: usize) -> bool {
        self.0[idx / 64] >> (idx % 64) & 1 == 1
    }
}

/// The buffers of a thread.
#[derive(Default)]
struct Scratch {
    vertices: Vec<Vertex>,
    bins: Bins,
}

impl Job<'_> {
    /// Finds the occluded points of a direction and its opposite.
    fn direction(&self, direction: [f64; 3], scratch: &mut Scratch) -> Bits {
        let frame = Frame::new(direction);
        let mut bits = Bits(vec![0; self.points.len().div_ceil(64)]);
        let Scratch { vertices, bins } = scratch;
        bins.clear();
        for (idx, (point, position)) in (0..).zip(self.points.iter().zip(&self.scaled.points)) {
            let side = point.side(direction);
            if side == 0 {
                continue;
            }
            let upward = direction.map(|v| v * f64::from(side));
            match self.options.ground_occludes(point, upward) {
                true => bits.set(idx as usize),
                false => bins.push(idx, frame.project(*position), side < 0),
            }
        }
        bins.sort();
        let vertex = |p: &[f64; 3]| bins.grid.vertex(frame.project(*p));
        vertices.clear();
        vertices.extend(self.scaled.vertices.iter().map(vertex));
        let triangles = Projected {
            vertices,
            triangles: &self.scaled.triangles,
            reach: (self.options.reach() * self.scaled.scale) as f32,
            fronts_alone: self.options.ignore_backfaces,
        };
        simd::test(&triangles, bins);
        for (idx, state) in bins.states() {
            let point = &self.points[idx];
            if state & OCCLUDED != 0
                || state & DOUBT != 0 && is_occluded(&self.rays, point, direction, self.options)
            {
                bits.set(idx);
            }
        }
        bits
    }
}
