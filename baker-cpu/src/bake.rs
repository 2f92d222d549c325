//! Every cell's directions, tested and reduced.

use std::sync::atomic::{AtomicUsize, Ordering};

use aogrid_bake_core::cube_face::texels;
use aogrid_bake_core::{BakeOptions, Moments, Observer, OptionsError, Progress};
use aogrid_bake_core::{FaceSums, FixedTexel, fixed_texels};
use aogrid_bake_core::{RawGrid, TriangleMesh};
use aogrid_grid_format::{GridSpec, Method};
use rayon::prelude::*;

use crate::monte_carlo::CellDirections;
use crate::{Baker, Occluder, WhyRays};

/// Why a bake gave nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// An option out of its range.
    #[error(transparent)]
    Options(#[from] OptionsError),
    /// The observer broke it off.
    #[error("the bake was cancelled")]
    Cancelled,
    /// The sweep was asked for, and only rays can do it.
    #[error("the sweep cannot bake this: {0}")]
    NoSweep(WhyRays),
}

/// Bakes the moments of every cell of `spec` around `mesh`, watched by `observer`, by the
/// sweep if it can be used and is faster, else by rays.
///
/// The same input gives the same bits, for any number of threads.
///
/// # Errors
///
/// An option out of its range, or cancellation.
pub fn bake(
    mesh: &TriangleMesh,
    spec: GridSpec,
    options: &BakeOptions,
    observer: Observer<'_>,
) -> Result<RawGrid, BakeError> {
    let mut baker = Baker::new(None);
    baker.prepare(mesh, spec, options)?.bake(observer)
}

impl Occluder {
    /// [`bake()`] around the mesh of this occluder, by rays; without its signed layers, which
    /// are [the options'](BakeOptions::layers).
    ///
    /// # Errors
    ///
    /// As [`bake()`].
    pub fn bake(
        &self,
        spec: GridSpec,
        options: &BakeOptions,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        options.validate()?;
        let sampler = Sampler::new(self, &spec, options);
        let directions = options.method.directions();
        let cells = match options.method {
            Method::Faces { size } => {
                let rays = face_rays(size);
                for_each_cell(&spec, observer, |idx| {
                    let sums = sampler.faces(idx, &rays);
                    (sums.moments(directions), sums.count)
                })
            }
            Method::Rays { count, seed } => for_each_cell(&spec, observer, |idx| {
                let units = CellDirections::new(seed, idx).take(count as usize);
                sampler.random(idx, units, count)
            }),
        }?;
        let (moments, counts) = cells.into_iter().unzip();
        Ok(RawGrid {
            spec,
            moments,
            counts,
            directions,
            layers: None,
        })
    }
}

/// A texel's direction, of length 1, and its share.
fn face_rays(size: u32) -> Vec<([f64; 3], FixedTexel)> {
    let units = texels(size).into_iter().map(|texel| {
        let length = texel.direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        texel.direction.map(|v| v / length)
    });
    units.zip(fixed_texels(size)).collect()
}

/// Where samples lie and how far they see.
struct Sampler<'a> {
    occluder: &'a Occluder,
    spec: &'a GridSpec,
    sample_offset: [f64; 3],
    /// From the centre of the mesh to the centre of the grid: zero for a placed grid.
    grid_from_mesh: [f64; 3],
    reach: f64,
}

impl<'a> Sampler<'a> {
    fn new(occluder: &'a Occluder, spec: &'a GridSpec, options: &BakeOptions) -> Self {
        let [grid, mesh] = [spec.center().map(f64::from), occluder.center()];
        Self {
            occluder,
            spec,
            sample_offset: options.sample_offset.map(f64::from),
            grid_from_mesh: std::array::from_fn(|x| grid[x] - mesh[x]),
            reach: options.max_distance.map_or(f64::INFINITY, f64::from),
        }
    }

    fn origin(&self, idx: usize) -> [f64; 3] {
        let cell = self.spec.cell_at(idx);
        let sample = self.spec.sample_from_center(cell, self.sample_offset);
        std::array::from_fn(|x| sample[x] + self.grid_from_mesh[x])
    }

    fn faces(&self, idx: usize, rays: &[([f64; 3], FixedTexel)]) -> FaceSums {
        let origin = self.origin(idx);
        let mut sums = FaceSums::default();
        for (unit, texel) in rays {
            if self.occluder.hides_from_center(origin, *unit, self.reach) {
                sums.add(texel);
            }
        }
        sums
    }

    fn random(
        &self,
        idx: usize,
        units: impl Iterator<Item = [f64; 3]>,
        rays: u32,
    ) -> (Moments, u32) {
        let origin = self.origin(idx);
        let (mut count, mut sum) = (0, [0.0; 3]);
        for unit in units {
            if self.occluder.hides_from_center(origin, unit, self.reach) {
                count += 1;
                for (sum, u) in sum.iter_mut().zip(unit) {
                    *sum += u;
                }
            }
        }
        // Every direction hidden is the whole sphere, which points nowhere; the mean of random
        // directions does.
        let m = if count == rays { [0.0; 3] } else { sum };
        let moments = Moments {
            a: (f64::from(count) / f64::from(rays)) as f32,
            m: m.map(|v| (v / f64::from(rays)) as f32),
        };
        (moments, count)
    }
}

/// Every cell's moments and count, computed on all threads, each written to its own place.
fn for_each_cell(
    spec: &GridSpec,
    observer: Observer<'_>,
    reduce: impl Fn(usize) -> (Moments, u32) + Sync,
) -> Result<Vec<(Moments, u32)>, BakeError> {
    let total = spec.cell_count();
    let done = AtomicUsize::new(0);
    (0..total)
        .into_par_iter()
        .map(|idx| {
            let sums = reduce(idx);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            match observer(Progress { done, total }).is_break() {
                true => Err(BakeError::Cancelled),
                false => Ok(sums),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use aogrid_bake_core::samples::Sample;
    use aogrid_bake_core::{Placement, UNOBSERVED};

    use super::*;

    fn coarse() -> (TriangleMesh, GridSpec, BakeOptions) {
        let mesh = Sample::Table.mesh(None).unwrap();
        let placement = Placement {
            resolution: [12, 9, 10],
            ..Placement::default()
        };
        let spec = placement.place(&mesh.bounds()).unwrap();
        (mesh, spec, BakeOptions::recommended())
    }

    #[test]
    fn counts_and_moments_agree() {
        let (mesh, spec, options) = coarse();
        let raw = bake(&mesh, spec, &options, UNOBSERVED).unwrap();
        assert_eq!(raw.directions, 1536);
        for (idx, cell) in raw.moments.iter().enumerate() {
            let share = raw.counts[idx] as f32 / 1536.0;
            // A texel's solid angle is within 0.37 and 1.9 times the mean of all.
            assert!(cell.a >= 0.3 * share && cell.a <= 2.0 * share);
            let [x, y, z] = cell.m;
            let length = (x * x + y * y + z * z).sqrt();
            // A cone has the longest moment of all sets of directions of its size; 0.01 for
            // texels, which are no points.
            assert!(length <= cell.a * (1.0 - cell.a) + 0.01, "{cell:?}");
        }
    }

    #[test]
    fn one_thread_and_many_give_the_same_bits() {
        let (mesh, spec, mut options) = coarse();
        for method in [
            Method::Faces { size: 8 },
            Method::Rays {
                count: 100,
                seed: 7,
            },
        ] {
            options.method = method;
            let with = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                let bake = || bake(&mesh, spec, &options, UNOBSERVED).unwrap();
                pool.build().unwrap().install(bake)
            };
            assert_eq!(with(1), with(5));
        }
    }

    #[test]
    fn seeds_differ_and_repeat() {
        let (mesh, spec, mut options) = coarse();
        let mut with = |seed| {
            options.method = Method::Rays { count: 64, seed };
            bake(&mesh, spec, &options, UNOBSERVED).unwrap()
        };
        assert_eq!(with(1), with(1));
        assert_ne!(with(1), with(2));
    }

    #[test]
    fn a_maximum_distance_forgets_what_is_beyond() {
        let (mesh, spec, mut options) = coarse();
        let mut with = |distance| {
            options.max_distance = distance;
            bake(&mesh, spec, &options, UNOBSERVED).unwrap().counts
        };
        let (unlimited, far, near) = (with(None), with(Some(100.0)), with(Some(0.2)));
        assert_eq!(unlimited, far);
        assert!(near.iter().zip(&far).all(|(near, far)| near <= far));
        // A corner cell is more than 0.2 from the table, one next to it is not.
        assert_eq!(near[0], 0);
        assert!(near.iter().any(|&n| n > 0) && unlimited[0] > 0);
    }

    #[test]
    fn the_observer_sees_every_cell_and_can_stop() {
        let (mesh, spec, options) = coarse();
        let seen = AtomicUsize::new(0);
        let count = |progress: Progress| {
            assert_eq!(progress.total, 1080);
            seen.fetch_add(1, Ordering::Relaxed);
            ControlFlow::Continue(())
        };
        Occluder::new(&mesh).bake(spec, &options, &count).unwrap();
        assert_eq!(seen.into_inner(), 1080);

        let stop = |progress: Progress| match progress.done < 10 {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        };
        let stopped = Occluder::new(&mesh).bake(spec, &options, &stop);
        assert_eq!(stopped, Err(BakeError::Cancelled));
    }

    #[test]
    fn the_sweep_is_watched_and_stopped_too() {
        let (mesh, spec, options) = coarse();
        let most = AtomicUsize::new(0);
        let watch = |progress: Progress| {
            most.fetch_max(progress.done, Ordering::Relaxed);
            ControlFlow::Continue(())
        };
        bake(&mesh, spec, &options, &watch).unwrap();
        assert_eq!(most.into_inner(), 1080);
        let stop = |_: Progress| ControlFlow::Break(());
        let stopped = bake(&mesh, spec, &options, &stop);
        assert_eq!(stopped, Err(BakeError::Cancelled));
    }
}
