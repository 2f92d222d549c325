//! Visibility by a ray for each point and direction.

use std::sync::atomic::{AtomicUsize, Ordering};

use aogrid_bake_core::surface::{
    Accumulator, Directions, SurfaceOptions, SurfacePoint, shared_directions,
};
use aogrid_bake_core::{Observer, Progress, TriangleMesh};
use rayon::prelude::*;

use super::directions::{rejection, stratified};
use crate::{BakeError, RayScene};

/// Returns the sums of all points.
pub(super) fn trace(
    mesh: &TriangleMesh,
    points: &[SurfacePoint],
    options: &SurfaceOptions,
    observer: Observer<'_>,
) -> Result<Vec<Accumulator>, BakeError> {
    let scene = RayScene::new(mesh);
    let shared = shared_directions(options.rays);
    let done = AtomicUsize::new(0);
    let sums = points.par_iter().enumerate().map(|(idx, point)| {
        let own;
        let directions = match options.directions {
            Directions::Shared => &shared,
            Directions::Stratified => {
                own = stratified(options.seed, idx, point.axis, options.rays);
                &own
            }
            Directions::Rejection => {
                own = rejection(options.seed, idx, point.axis, options.rays);
                &own
            }
        };
        let mut sum = Accumulator::default();
        for &direction in directions {
            let is_occluded = is_occluded(&scene, point, direction, options);
            sum.add(point, direction, options.weights, is_occluded);
        }
        let progress = Progress {
            done: done.fetch_add(1, Ordering::Relaxed) + 1,
            total: points.len(),
        };
        match observer(progress).is_break() {
            true => Err(BakeError::Cancelled),
            false => Ok(sum),
        }
    });
    sums.collect()
}

/// Whether the direction above the point, of this one and its opposite, is occluded; `false` if neither
/// counts.
pub(super) fn is_occluded(
    scene: &RayScene,
    point: &SurfacePoint,
    direction: [f64; 3],
    options: &SurfaceOptions,
) -> bool {
    let center = scene.center();
    let from_center = [0, 1, 2].map(|x| point.position[x] - center[x]);
    let upward = match point.side(direction) {
        1 => direction,
        -1 => direction.map(|v| -v),
        _ => return false,
    };
    options.ground_occludes(point, upward)
        || match options.ignore_backfaces {
            true => scene.is_occluded_by_fronts(from_center, upward, options.reach()),
            false => scene.is_occluded_from_center(from_center, upward, options.reach()),
        }
}
