//! The path-traced reference: occlusion and light at points, by rays through the whole scene.
//!
//! # Theory
//!
//! The occlusion of a receiver is (1/π) ∫ occluded(ω) (n·ω) dω over its hemisphere (RR-5779
//! eq. 2). Directions with density (n·ω)/π make it the mean of `occluded`. The directions come
//! from a jittered grid in the unit square, mapped continuously to the disk (Shirley and Chiu,
//! *A Low Distortion Map Between Disk and Square*, JGT 1997) and lifted to the hemisphere. Only
//! the strata that a silhouette crosses then contribute variance, and the error falls with the
//! number of samples to the power of −¾, not −½.
//!
//! Every stratum gets two samples, whose difference is an unbiased estimate of its variance. This
//! loses a fifth of the precision of one sample per stratum, but gives a reliable standard error.
//!
//! With a standard error to reach ([`ReferenceOptions::error`]), a few samples of a receiver tell
//! how many it needs by that power of −¾. They are thrown away: the estimate from as many new ones
//! has no bias, whereas one that stops as soon as it looks good enough has, since a receiver that
//! happens to hit nothing looks good.
//!
//! Light is the mean incident radiance, irradiance over π, which is what a white surface
//! reflects. The radiance of an [`Environment`] up to a multiple of the map's mean comes from the
//! same rays. The excess of brighter texels, such as the sun and lamps, is importance-sampled, so
//! that no bright texel is found by chance alone. An [`AreaLight`] is sampled over its surface.
//!
//! # Practice
//!
//! [`shade`] takes one [`RayScene`] over all casting geometry, in world space, and a list of
//! [`Receiver`]s, such as the pixels of a picture. [`reflect`] does the same for glossy
//! receivers, [`Lobe`]s. Random numbers depend on the seed and the receiver's index alone.

mod area_light;
mod environment;
mod reflection;
mod strata;

pub use area_light::{AreaLight, AreaLightError};
pub use environment::{Environment, EnvironmentError};
pub use reflection::Lobe;

use std::sync::atomic::{AtomicUsize, Ordering};

use aogrid_bake_core::{Observer, Progress};
use glam::DVec3;
use rayon::prelude::*;

use aogrid_baker_cpu::RayScene;
use reflection::Reflection;
use strata::{Accumulator, Random, Strata};

/// A point of a surface, in world space.
///
/// Rays start exactly there. Offset the point along the normal a little if its surface is also an
/// occluder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// The position, in world space.
    pub position: [f64; 3],
    /// The surface normal, of length 1.
    pub normal: [f64; 3],
}

/// The options of the reference. There is no default; [`ReferenceOptions::recommended`] is one choice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceOptions {
    /// The number of rays per receiver, rounded up to twice a square. An eighth as many are added
    /// for each light that is sampled separately.
    pub samples: u32,
    /// The standard error to reach, of AO and of light (in radiance): a receiver gets as few rays
    /// as that takes, and `samples` at the most. `None` for `samples` rays for all.
    pub error: Option<f64>,
    /// The seed of the random numbers.
    pub seed: u64,
    /// The distance, in world units, beyond which geometry does not occlude the sky; `None` for
    /// unlimited. Shadow rays to an area light ignore it.
    pub max_distance: Option<f64>,
}

/// The light sources of a scene. Light between its surfaces is not included.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lighting<'a> {
    /// The constant radiance from all directions.
    pub ambient: [f32; 3],
    /// The environment map.
    pub environment: Option<&'a Environment>,
    /// An area light.
    pub area_light: Option<AreaLight>,
}

/// An estimated mean and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The mean over the samples.
    pub mean: f32,
    /// The estimated standard deviation of the mean.
    pub standard_error: f32,
}

/// The occlusion and light of a receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShadingEstimate {
    /// AO: 0 open, 1 fully occluded. For a lobe, its occluded share.
    pub occlusion: Estimate,
    /// The radiance that a white surface reflects: red, green, blue.
    pub light: [Estimate; 3],
}

/// The reason that the reference was not computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// The observer cancelled.
    #[error("the rendering was cancelled")]
    Cancelled,
}

impl ReferenceOptions {
    /// Returns 8,192 rays per receiver, whose error is well below 0.001 in most scenes.
    pub fn recommended() -> Self {
        Self {
            samples: 8192,
            error: None,
            seed: 0,
            max_distance: None,
        }
    }
}

/// Shades diffuse receivers, on all threads of the pool.
///
/// `occluder` is `None` for a scene without casting geometry. The result is bit-identical for any
/// number of threads.
///
/// # Errors
///
/// The observer cancelled.
pub fn shade(
    occluder: Option<&RayScene>,
    receivers: &[Receiver],
    lighting: &Lighting<'_>,
    options: &ReferenceOptions,
    observer: Observer<'_>,
) -> Result<Vec<ShadingEstimate>, ReferenceError> {
    Integrator::new(occluder, lighting, options).shade_all(receivers, options.seed, observer)
}

/// Shades glossy receivers; see [`shade`].
///
/// # Errors
///
/// The observer cancelled.
pub fn reflect(
    occluder: Option<&RayScene>,
    lobes: &[Lobe],
    lighting: &Lighting<'_>,
    options: &ReferenceOptions,
    observer: Observer<'_>,
) -> Result<Vec<ShadingEstimate>, ReferenceError> {
    Integrator::new(occluder, lighting, options).shade_all(lobes, options.seed, observer)
}

/// The scene and sampling, shared by all receivers.
struct Integrator<'a> {
    occluder: Option<&'a RayScene>,
    lighting: &'a Lighting<'a>,
    samples: u32,
    error: Option<f64>,
    max_distance: f64,
}

/// The number of rays that tell how many a receiver needs.
const PILOT_SAMPLES: u32 = 128;

impl<'a> Integrator<'a> {
    fn new(
        occluder: Option<&'a RayScene>,
        lighting: &'a Lighting<'a>,
        options: &ReferenceOptions,
    ) -> Self {
        Self {
            occluder,
            lighting,
            samples: options.samples,
            error: options.error,
            max_distance: options.max_distance.unwrap_or(f64::INFINITY),
        }
    }

    /// Shades all receivers in parallel, each with its own random stream.
    fn shade_all<R: Sync>(
        &self,
        receivers: &[R],
        seed: u64,
        observer: Observer<'_>,
    ) -> Result<Vec<ShadingEstimate>, ReferenceError>
    where
        Reflection: for<'r> From<&'r R>,
    {
        let done = AtomicUsize::new(0);
        let total = receivers.len();
        receivers
            .par_iter()
            .enumerate()
            .map(|(idx, receiver)| {
                let random = Random::of_receiver(seed, idx as u64);
                let shade = self.shade(&Reflection::from(receiver), random);
                let done = 1 + done.fetch_add(1, Ordering::Relaxed);
                match observer(Progress { done, total }) {
                    std::ops::ControlFlow::Continue(()) => Ok(shade),
                    std::ops::ControlFlow::Break(()) => Err(ReferenceError::Cancelled),
                }
            })
            .collect()
    }

    /// Shades one receiver.
    fn shade(&self, receiver: &Reflection, mut random: Random) -> ShadingEstimate {
        let samples = match self.error {
            Some(error) if self.samples > PILOT_SAMPLES => {
                let pilot = self.estimate(receiver, PILOT_SAMPLES, &mut random);
                samples_for(error, &pilot).min(self.samples)
            }
            _ => self.samples,
        };
        self.estimate(receiver, samples, &mut random)
    }

    /// Shades one receiver with so many samples.
    fn estimate(
        &self,
        receiver: &Reflection,
        samples: u32,
        random: &mut Random,
    ) -> ShadingEstimate {
        let strata = Strata::of_samples(samples);
        let light_strata = Strata::of_samples(samples / 8);
        let hemisphere = self.hemisphere(receiver, strata, random);
        let (means, mut variances) = (hemisphere.means(), hemisphere.variances());
        let mut light = [means[1], means[2], means[3]];
        // The estimates are independent, so that their variances add.
        let sampled = [
            self.bright_texels(receiver, light_strata, random),
            self.area_light(receiver, light_strata, random),
        ];
        for estimates in sampled.into_iter().flatten() {
            let (means, more) = (estimates.means(), estimates.variances());
            for x in 0..3 {
                light[x] += means[x];
                variances[1 + x] += more[x];
            }
        }
        let estimate = |mean: f64, variance: f64| Estimate {
            mean: mean as f32,
            standard_error: variance.sqrt() as f32,
        };
        ShadingEstimate {
            occlusion: estimate(means[0], variances[0]),
            light: std::array::from_fn(|x| estimate(light[x], variances[1 + x])),
        }
    }

    /// Estimates the occlusion, then the three colors of the ambient light and of the environment
    /// up to its cap, over the receiver's hemisphere or lobe.
    fn hemisphere(
        &self,
        receiver: &Reflection,
        strata: Strata,
        random: &mut Random,
    ) -> Accumulator<4> {
        strata.accumulate(random, |square| {
            let Some((direction, weight)) = receiver.sample(square) else {
                return [0.0; 4];
            };
            if self.is_occluded(receiver, direction, self.max_distance) {
                return [weight, 0.0, 0.0, 0.0];
            }
            let mut light = self.lighting.ambient.map(f64::from);
            if let Some(environment) = self.lighting.environment {
                let sky = environment.capped_radiance(direction);
                light = std::array::from_fn(|x| light[x] + sky[x]);
            }
            [0.0, light[0], light[1], light[2]].map(|v| weight * v)
        })
    }

    /// Estimates the light of the environment above its cap.
    fn bright_texels(
        &self,
        receiver: &Reflection,
        strata: Strata,
        random: &mut Random,
    ) -> Option<Accumulator<3>> {
        let bright = self.lighting.environment?.bright()?;
        Some(strata.accumulate(random, |square| {
            let (direction, radiance_over_density) = bright.sample(square);
            let weight = receiver.density(direction);
            match weight > 0.0 && !self.is_occluded(receiver, direction, self.max_distance) {
                true => radiance_over_density.map(|v| v * weight),
                false => [0.0; 3],
            }
        }))
    }

    /// Estimates the light of the area light.
    fn area_light(
        &self,
        receiver: &Reflection,
        strata: Strata,
        random: &mut Random,
    ) -> Option<Accumulator<3>> {
        let light = self.lighting.area_light.as_ref()?;
        Some(strata.accumulate(random, |square| {
            let Some((towards, irradiance)) = light.sample(square, receiver.position.into()) else {
                return [0.0; 3];
            };
            let distance = towards.length();
            let weight = receiver.density(towards / distance);
            match weight == 0.0
                || self.is_occluded(receiver, towards, distance * SHADOW_RAY_FRACTION)
            {
                true => [0.0; 3],
                false => irradiance.map(|v| v * weight),
            }
        }))
    }

    /// Whether a ray from the receiver is occluded.
    fn is_occluded(&self, receiver: &Reflection, direction: DVec3, max_distance: f64) -> bool {
        let direction = direction.to_array();
        self.occluder.is_some_and(|occluder| {
            occluder.is_occluded(receiver.position, direction, max_distance)
        })
    }
}

/// Returns the number of samples that reach a standard error, given the estimate of the pilot.
fn samples_for(error: f64, pilot: &ShadingEstimate) -> u32 {
    // Few pairs of the pilot differ, so that their number is uncertain: one more is counted. Without
    // it, a receiver whose pilot hits nothing would seem to be free of error.
    let one_pair = 1.0 / f64::from(PILOT_SAMPLES);
    let occlusion = one_pair.hypot(f64::from(pilot.occlusion.standard_error));
    let light = pilot.light.map(|c| f64::from(c.standard_error));
    let largest = light.into_iter().fold(occlusion, f64::max);
    let samples = f64::from(PILOT_SAMPLES) * (largest / error).powf(4.0 / 3.0);
    // The cast saturates.
    (samples.ceil() as u32).max(PILOT_SAMPLES)
}

/// The length of a shadow ray as a fraction of the distance to the light, so that a lamp's housing
/// flush with the light does not occlude it.
const SHADOW_RAY_FRACTION: f64 = 1.0 - 1e-6;
