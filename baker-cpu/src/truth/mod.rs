//! What everything that shades is judged against: occlusion and light at points, by rays through
//! the whole scene.
//!
//! # Theory
//!
//! The occlusion of a receiver is (1/π) ∫ hidden(ω) (n·ω) dω over its hemisphere (RR-5779
//! eq. 2). Directions with density (n·ω)/π make it the mean of `hidden`. They come from a
//! jittered grid in the unit square, mapped to the disk without tearing (Shirley and Chiu,
//! *A Low Distortion Map Between Disk and Square*, JGT 1997) and lifted to the hemisphere. What
//! varies is then only in strata that a silhouette crosses, and the error falls with the samples'
//! number to the power of −¾, not −½.
//!
//! Every stratum gets two samples, whose difference estimates its variance without bias: the
//! standard error costs a fifth of precision against one sample a stratum, and can be believed.
//!
//! Light is the mean radiance that arrives, irradiance over π: what a white surface reflects.
//! Of an [`Environment`] it is taken from the same rays up to a multiple of the map's mean; what
//! is brighter, the sun and lamps, is sampled by itself, so that no bright texel is found by
//! chance. An [`AreaLight`] is sampled over its surface.
//!
//! # Practice
//!
//! [`shade`] takes an [`Occluder`] over all that casts, in world space, and [`Receiver`]s: list
//! or pixels. Random numbers depend on the seed and the receiver's index alone.

mod area_light;
mod environment;
mod strata;

pub use area_light::{AreaLight, AreaLightError};
pub use environment::{Environment, EnvironmentError};

use std::sync::atomic::{AtomicUsize, Ordering};

use aogrid_bake_core::{Observer, Progress};
use glam::DVec3;
use rayon::prelude::*;

use crate::Occluder;
use strata::{Frame, Strata, Tally};

/// A point of a surface, in world space. Rays start exactly there: what lies on a surface that
/// casts should be lifted off it a little.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Where.
    pub position: [f64; 3],
    /// Away from the surface, of length 1.
    pub normal: [f64; 3],
}

/// How truth is found. No default: [`TruthOptions::recommended`] is a choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthOptions {
    /// Rays a receiver, at least: rounded up to twice a square. A tenth of it goes again to each
    /// light that is sampled by itself.
    pub samples: u32,
    /// Of the random numbers.
    pub seed: u64,
    /// What is farther than this, in world units, does not hide the sky; none: unlimited.
    pub max_distance: Option<f64>,
}

/// What lights a scene besides what its surfaces reflect.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lighting<'a> {
    /// Radiance from everywhere.
    pub ambient: [f32; 3],
    /// What surrounds everything.
    pub environment: Option<&'a Environment>,
    /// Direct light.
    pub area_light: Option<AreaLight>,
}

/// A number and how far off it may be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The mean over the samples.
    pub mean: f32,
    /// The standard deviation that such a mean has.
    pub standard_error: f32,
}

/// What a receiver gets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shade {
    /// AO: 0 open, 1 hidden.
    pub occlusion: Estimate,
    /// The radiance that a white diffuse surface reflects: red, green, blue.
    pub light: [Estimate; 3],
}

/// Why there is no truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TruthError {
    /// The observer broke it off.
    #[error("the rendering was cancelled")]
    Cancelled,
}

impl TruthOptions {
    /// 8,192 rays a receiver, whose error is well below 0.001 in most scenes.
    pub fn recommended() -> Self {
        Self {
            samples: 8192,
            seed: 0,
            max_distance: None,
        }
    }
}

/// Shades every receiver, on all threads of the pool; `occluder` is none where nothing casts.
/// The same input gives the same bits, for any number of threads.
///
/// # Errors
///
/// Cancellation.
pub fn shade(
    occluder: Option<&Occluder>,
    receivers: &[Receiver],
    lighting: &Lighting<'_>,
    options: &TruthOptions,
    observer: Observer<'_>,
) -> Result<Vec<Shade>, TruthError> {
    let scene = Shader {
        occluder,
        lighting,
        strata: Strata::of_samples(options.samples),
        few_strata: Strata::of_samples(options.samples / 8),
        reach: options.max_distance.unwrap_or(f64::INFINITY),
    };
    let done = AtomicUsize::new(0);
    let total = receivers.len();
    receivers
        .par_iter()
        .enumerate()
        .map(|(idx, receiver)| {
            let shade = scene.shade(receiver, Frame::random(options.seed, idx as u64));
            let done = 1 + done.fetch_add(1, Ordering::Relaxed);
            match observer(Progress { done, total }) {
                std::ops::ControlFlow::Continue(()) => Ok(shade),
                std::ops::ControlFlow::Break(()) => Err(TruthError::Cancelled),
            }
        })
        .collect()
}

/// What is the same for all receivers.
struct Shader<'a> {
    occluder: Option<&'a Occluder>,
    lighting: &'a Lighting<'a>,
    strata: Strata,
    /// For lights that are sampled by themselves.
    few_strata: Strata,
    reach: f64,
}

impl Shader<'_> {
    fn shade(&self, receiver: &Receiver, mut random: strata::Random) -> Shade {
        let frame = Frame::new(receiver.normal.into());
        let sky = self.hemisphere(receiver, &frame, &mut random);
        let (means, mut variances) = (sky.means(), sky.variances());
        let mut light = [means[1], means[2], means[3]];
        let sampled = [
            self.bright_sky(receiver, &frame, &mut random),
            self.area_light(receiver, &mut random),
        ];
        for tally in sampled.into_iter().flatten() {
            let (means, more) = (tally.means(), tally.variances());
            for x in 0..3 {
                light[x] += means[x];
                variances[1 + x] += more[x];
            }
        }
        let estimate = |mean: f64, variance: f64| Estimate {
            mean: mean as f32,
            standard_error: variance.sqrt() as f32,
        };
        Shade {
            occlusion: estimate(means[0], variances[0]),
            light: std::array::from_fn(|x| estimate(light[x], variances[1 + x])),
        }
    }

    /// Occlusion, then the light of the open directions but for the brightest.
    fn hemisphere(
        &self,
        receiver: &Receiver,
        frame: &Frame,
        random: &mut strata::Random,
    ) -> Tally<4> {
        self.strata.tally(random, |square| {
            let direction = frame.cosine_weighted(square);
            if self.hides(receiver, direction, self.reach) {
                return [1.0, 0.0, 0.0, 0.0];
            }
            let mut light = self.lighting.ambient.map(f64::from);
            if let Some(environment) = self.lighting.environment {
                let sky = environment.base(direction);
                light = std::array::from_fn(|x| light[x] + sky[x]);
            }
            [0.0, light[0], light[1], light[2]]
        })
    }

    /// The light of the environment's brightest texels, in so far as they are too bright.
    fn bright_sky(
        &self,
        receiver: &Receiver,
        frame: &Frame,
        random: &mut strata::Random,
    ) -> Option<Tally<3>> {
        let bright = self.lighting.environment?.bright()?;
        Some(self.few_strata.tally(random, |square| {
            let (direction, radiance_over_density) = bright.sample(square);
            let cosine = frame.normal.dot(direction);
            match cosine > 0.0 && !self.hides(receiver, direction, self.reach) {
                true => radiance_over_density.map(|v| v * cosine / std::f64::consts::PI),
                false => [0.0; 3],
            }
        }))
    }

    fn area_light(&self, receiver: &Receiver, random: &mut strata::Random) -> Option<Tally<3>> {
        let light = self.lighting.area_light.as_ref()?;
        let (position, normal) = (DVec3::from(receiver.position), DVec3::from(receiver.normal));
        Some(self.few_strata.tally(random, |square| {
            let Some((towards, radiance)) = light.sample(square, position, normal) else {
                return [0.0; 3];
            };
            match self.hides(receiver, towards, towards.length() * BEFORE_THE_LIGHT) {
                true => [0.0; 3],
                false => radiance,
            }
        }))
    }

    fn hides(&self, receiver: &Receiver, direction: DVec3, reach: f64) -> bool {
        let direction = direction.to_array();
        self.occluder
            .is_some_and(|occluder| occluder.hides(receiver.position, direction, reach))
    }
}

/// A lamp's own housing, flush with the light, is not in its way.
const BEFORE_THE_LIGHT: f64 = 1.0 - 1e-6;
