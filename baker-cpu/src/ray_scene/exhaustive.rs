//! Rays against every triangle, in double precision: the reference for the tree.

use super::{Hit, RayScene};
use crate::triangle::Ray;

impl RayScene {
    /// Returns [`RayScene::closest_hit`] by the exact test of every triangle, to verify it: the two
    /// are equal to the bit. It takes thousands of times as long.
    pub fn closest_hit_exhaustive(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<Hit> {
        let ray = self.exact_ray(origin, direction, f64::INFINITY);
        let hits = self.triangles.iter().zip(&self.indices);
        let hits = hits.filter_map(|(t, &triangle)| Some((ray.hit_distance(t)?, triangle)));
        let (distance, triangle) =
            hits.min_by(|a, b| a.partial_cmp(b).expect("distances are numbers"))?;
        Some(Hit {
            distance: distance / self.scale,
            triangle,
        })
    }

    /// Returns [`RayScene::is_occluded`] by the exact test of every triangle, to verify it.
    pub fn is_occluded_exhaustive(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        max_distance: f64,
    ) -> bool {
        let ray = self.exact_ray(origin, direction, max_distance * self.scale);
        self.triangles.iter().any(|t| ray.hits(t))
    }

    fn exact_ray(&self, origin: [f64; 3], direction: [f64; 3], t_max: f64) -> Ray {
        let local = self.relative_to_center(origin).map(|v| v * self.scale);
        Ray::new(local, unit(direction), t_max)
    }
}

/// Returns a direction with length 1.
pub(super) fn unit(direction: [f64; 3]) -> [f64; 3] {
    let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
    direction.map(|v| v / length)
}
