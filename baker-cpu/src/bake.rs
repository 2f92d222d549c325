//! The bake by ray casting: traces the sampled directions of every cell and reduces them to moments.

use std::sync::atomic::{AtomicUsize, Ordering};

use aogrid_bake_core::cube_face::texels;
use aogrid_bake_core::{
    BakeOptions, FaceSums, FixedTexel, Moments, Observer, PlanError, Progress, RawGrid,
    fixed_texels,
};
use aogrid_grid_format::{GridSpec, Sampling};
use rayon::prelude::*;

use crate::error::BakeError;
use crate::monte_carlo::CellDirections;
use crate::ray_scene::RayScene;

impl RayScene {
    /// Bakes a grid around this occluder's mesh by ray casting; see [`bake()`](crate::bake()).
    ///
    /// The result has no signed layers; [`BakeOptions::layers`] computes them.
    ///
    /// # Errors
    ///
    /// The same as [`bake()`](crate::bake()).
    pub fn bake(
        &self,
        spec: GridSpec,
        options: &BakeOptions,
        observer: Observer<'_>,
    ) -> Result<RawGrid, BakeError> {
        options.validate().map_err(PlanError::from)?;
        let sampler = Sampler::new(self, &spec, options);
        let directions = options.sampling.directions();
        let cells = match options.sampling {
            Sampling::CubeFaces { size } => {
                let rays = face_rays(size);
                for_each_cell(&spec, observer, |idx| {
                    let sums = sampler.cube_faces(idx, &rays);
                    (sums.moments(directions), sums.count)
                })
            }
            Sampling::MonteCarlo { count, seed } => for_each_cell(&spec, observer, |idx| {
                let unit_directions = CellDirections::new(seed, idx).take(count as usize);
                sampler.monte_carlo(idx, unit_directions, count)
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

/// Returns the direction of each cube-face texel, of length 1, and its fixed-point moments.
fn face_rays(size: u32) -> Vec<([f64; 3], FixedTexel)> {
    let unit_directions = texels(size).into_iter().map(|texel| {
        let length = texel.direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        texel.direction.map(|v| v / length)
    });
    unit_directions.zip(fixed_texels(size)).collect()
}

/// The sample positions of a grid and the rays traced from them.
struct Sampler<'a> {
    occluder: &'a RayScene,
    spec: &'a GridSpec,
    sample_offset: [f64; 3],
    /// The offset from the center of the mesh to the center of the grid, in object space; zero
    /// for a grid placed around this mesh.
    grid_from_mesh: [f64; 3],
    max_distance: f64,
}

impl<'a> Sampler<'a> {
    fn new(occluder: &'a RayScene, spec: &'a GridSpec, options: &BakeOptions) -> Self {
        let [grid, mesh] = [spec.center().map(f64::from), occluder.center()];
        Self {
            occluder,
            spec,
            sample_offset: options.sample_offset.map(f64::from),
            grid_from_mesh: std::array::from_fn(|x| grid[x] - mesh[x]),
            max_distance: options.max_distance.map_or(f64::INFINITY, f64::from),
        }
    }

    /// Returns the sample position of a cell relative to the center of the mesh.
    fn origin(&self, idx: usize) -> [f64; 3] {
        let cell = self.spec.cell_at(idx);
        let sample = self.spec.sample_from_center(cell, self.sample_offset);
        std::array::from_fn(|x| sample[x] + self.grid_from_mesh[x])
    }

    /// Sums the occluded texels of a cell's cube faces, in fixed point.
    fn cube_faces(&self, idx: usize, rays: &[([f64; 3], FixedTexel)]) -> FaceSums {
        let origin = self.origin(idx);
        let mut sums = FaceSums::default();
        for (unit, texel) in rays {
            if self
                .occluder
                .is_occluded_from_center(origin, *unit, self.max_distance)
            {
                sums.add(texel);
            }
        }
        sums
    }

    /// Returns the moments and the occluded count of a cell over `rays` random directions.
    fn monte_carlo(
        &self,
        idx: usize,
        unit_directions: impl Iterator<Item = [f64; 3]>,
        rays: u32,
    ) -> (Moments, u32) {
        let origin = self.origin(idx);
        let (mut count, mut sum) = (0, [0.0; 3]);
        for unit in unit_directions {
            if self
                .occluder
                .is_occluded_from_center(origin, unit, self.max_distance)
            {
                count += 1;
                for (sum, u) in sum.iter_mut().zip(unit) {
                    *sum += u;
                }
            }
        }
        // A fully occluded sphere has a first moment of zero, but the mean of finitely many random
        // directions does not.
        let m = if count == rays { [0.0; 3] } else { sum };
        let moments = Moments {
            a: (f64::from(count) / f64::from(rays)) as f32,
            m: m.map(|v| (v / f64::from(rays)) as f32),
        };
        (moments, count)
    }
}

/// Computes the moments and count of every cell in parallel, in the order of the cells.
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

    use aogrid_bake_core::models::Model;
    use aogrid_bake_core::{Placement, TriangleMesh, UNOBSERVED};

    use super::*;
    use crate::bake;

    fn coarse() -> (TriangleMesh, GridSpec, BakeOptions) {
        let mesh = Model::Table.mesh(None).unwrap();
        let placement = Placement {
            resolution: [12, 9, 10],
            ..Placement::paper()
        };
        let spec = placement.place(&mesh.bounds()).unwrap();
        (mesh, spec, BakeOptions::paper())
    }

    #[test]
    fn counts_and_moments_agree() {
        let (mesh, spec, options) = coarse();
        let raw = bake(&mesh, spec, &options, UNOBSERVED).unwrap();
        assert_eq!(raw.directions, 1536);
        for (idx, cell) in raw.moments.iter().enumerate() {
            let share = raw.counts[idx] as f32 / 1536.0;
            // The solid angle of a texel is 0.37 to 1.9 times the mean.
            assert!(cell.a >= 0.3 * share && cell.a <= 2.0 * share);
            let [x, y, z] = cell.m;
            let length = (x * x + y * y + z * z).sqrt();
            // A cone has the longest first moment of all sets of directions with the same solid
            // angle; 0.01 allows for the finite size of the texels.
            assert!(length <= cell.a * (1.0 - cell.a) + 0.01, "{cell:?}");
        }
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        let (mesh, spec, mut options) = coarse();
        for sampling in [
            Sampling::CubeFaces { size: 8 },
            Sampling::MonteCarlo {
                count: 100,
                seed: 7,
            },
        ] {
            options.sampling = sampling;
            let with = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                let bake = || bake(&mesh, spec, &options, UNOBSERVED).unwrap();
                pool.build().unwrap().install(bake)
            };
            assert_eq!(with(1), with(5));
        }
    }

    #[test]
    fn equal_seeds_repeat_and_different_seeds_differ() {
        let (mesh, spec, mut options) = coarse();
        let mut with = |seed| {
            options.sampling = Sampling::MonteCarlo { count: 64, seed };
            bake(&mesh, spec, &options, UNOBSERVED).unwrap()
        };
        assert_eq!(with(1), with(1));
        assert_ne!(with(1), with(2));
    }

    #[test]
    fn triangles_beyond_the_maximum_distance_are_ignored() {
        let (mesh, spec, mut options) = coarse();
        let mut with = |distance| {
            options.max_distance = distance;
            bake(&mesh, spec, &options, UNOBSERVED).unwrap().counts
        };
        let (unlimited, far, near) = (with(None), with(Some(100.0)), with(Some(0.2)));
        assert_eq!(unlimited, far);
        assert!(near.iter().zip(&far).all(|(near, far)| near <= far));
        // The corner cell is more than 0.2 away from the table; cells next to the table are not.
        assert_eq!(near[0], 0);
        assert!(near.iter().any(|&n| n > 0) && unlimited[0] > 0);
    }

    #[test]
    fn the_observer_is_called_for_every_cell_and_can_cancel() {
        let (mesh, spec, options) = coarse();
        let seen = AtomicUsize::new(0);
        let count = |progress: Progress| {
            assert_eq!(progress.total, 1080);
            seen.fetch_add(1, Ordering::Relaxed);
            ControlFlow::Continue(())
        };
        RayScene::new(&mesh).bake(spec, &options, &count).unwrap();
        assert_eq!(seen.into_inner(), 1080);

        let stop = |progress: Progress| match progress.done < 10 {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        };
        let stopped = RayScene::new(&mesh).bake(spec, &options, &stop);
        assert_eq!(stopped, Err(BakeError::Cancelled));
    }

    #[test]
    fn the_sweep_reports_progress_and_can_be_cancelled() {
        let (mesh, spec, options) = coarse();
        let max_done = AtomicUsize::new(0);
        let watch = |progress: Progress| {
            max_done.fetch_max(progress.done, Ordering::Relaxed);
            ControlFlow::Continue(())
        };
        bake(&mesh, spec, &options, &watch).unwrap();
        assert_eq!(max_done.into_inner(), 1080);
        // The first of these calls is made while the mesh is prepared.
        for stop_at in 1..8 {
            let calls = AtomicUsize::new(0);
            let stop = |_: Progress| match calls.fetch_add(1, Ordering::Relaxed) + 1 < stop_at {
                true => ControlFlow::Continue(()),
                false => ControlFlow::Break(()),
            };
            let stopped = bake(&mesh, spec, &options, &stop);
            assert_eq!(stopped, Err(BakeError::Cancelled));
        }
    }
}
