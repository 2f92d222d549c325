//! The options of a surface bake.

use std::ops::RangeInclusive;

use super::{Directions, SurfacePoint, Weights};

/// The range of rays a hemisphere.
pub const SURFACE_RAYS: RangeInclusive<u32> = 1..=65_536;

/// The options that determine the records of given points, shared by all bakers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceOptions {
    /// The choice of directions.
    pub directions: Directions,
    /// Rays a hemisphere, within [`SURFACE_RAYS`]; with shared directions on average.
    pub rays: u32,
    /// The seed of random directions.
    pub seed: u64,
    /// The weights of directions.
    pub weights: Weights,
    /// Distance in object units beyond which occluders are ignored; `None` for unlimited.
    pub max_distance: Option<f64>,
    /// The height of an endless solid ground, across +Y, that occludes, too: its y in the coordinates of
    /// the points; `None` for no ground.
    pub ground: Option<f64>,
    /// Whether triangles occlude from their front alone, which they are counterclockwise from.
    pub ignore_backfaces: bool,
}

/// The reason that options are invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceOptionsError {
    /// There are too few or too many rays.
    #[error("{0} rays a hemisphere are outside {lo}..={hi}", lo = SURFACE_RAYS.start(), hi = SURFACE_RAYS.end())]
    Rays(u32),
    /// The maximum distance is not positive and finite.
    #[error("maximum distance {0} must be greater than zero and finite")]
    MaxDistance(f64),
}

impl SurfaceOptions {
    /// Returns the recommended options: 512 shared directions a hemisphere, weighted by the cosine,
    /// without a maximum distance.
    pub fn recommended() -> Self {
        Self {
            directions: Directions::Shared,
            rays: 512,
            seed: 0,
            weights: Weights::Cosine,
            max_distance: None,
            ground: None,
            ignore_backfaces: false,
        }
    }

    /// Returns the options of the chapter: random directions by rejection, weighted alike.
    pub fn chapter() -> Self {
        Self {
            directions: Directions::Rejection,
            weights: Weights::Uniform,
            ..Self::recommended()
        }
    }

    /// Checks the options.
    ///
    /// # Errors
    ///
    /// A number is out of its range.
    pub fn check(&self) -> Result<(), SurfaceOptionsError> {
        if !SURFACE_RAYS.contains(&self.rays) {
            return Err(SurfaceOptionsError::Rays(self.rays));
        }
        match self.max_distance {
            Some(d) if !(d > 0.0 && d.is_finite()) => Err(SurfaceOptionsError::MaxDistance(d)),
            _ => Ok(()),
        }
    }

    /// Returns the maximum distance, infinite if there is none.
    pub fn reach(&self) -> f64 {
        self.max_distance.unwrap_or(f64::INFINITY)
    }

    /// Whether the ground occludes a direction, of length 1, from a point. Below the ground everything
    /// does.
    pub fn ground_occludes(&self, point: &SurfacePoint, direction: [f64; 3]) -> bool {
        self.ground.is_some_and(|ground| {
            let height = point.position[1] - ground;
            height <= 0.0 || direction[1] < 0.0 && height <= self.reach() * -direction[1]
        })
    }
}
