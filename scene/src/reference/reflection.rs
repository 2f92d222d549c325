//! The reflection of a receiver: diffuse, or a glossy lobe.

use std::f64::consts::PI;

use glam::DVec3;

use super::Receiver;
use super::strata::TangentFrame;

/// A glossy receiver, seen from one direction.
///
/// The viewer sees the mean radiance over a cone around the mirrored view direction, weighted by
/// the cosine to the cone's axis. Only the part of the cone above the surface counts, normalized
/// to 1. A cone of 90° around the normal is a diffuse surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// The reflecting point.
    pub receiver: Receiver,
    /// The mirrored view direction, of length 1, in world space.
    pub axis: [f64; 3],
    /// The half-angle of the cone, in radians, above 0 and up to π/2.
    pub half_angle: f64,
}

impl Lobe {
    /// Returns the lobe that a viewer sees who is in direction `towards`, of length 1, from the
    /// receiver.
    pub fn seen_from(towards: [f64; 3], receiver: Receiver, half_angle: f64) -> Self {
        let (normal, towards) = (DVec3::from(receiver.normal), DVec3::from(towards));
        let axis = 2.0 * towards.dot(normal) * normal - towards;
        Self {
            receiver,
            axis: axis.to_array(),
            half_angle,
        }
    }
}

/// A receiver and its weighting of directions. The weight per solid angle is proportional to the
/// cosine to an axis, inside a cone and above the surface, and zero elsewhere.
pub(super) struct Reflection {
    pub position: [f64; 3],
    normal: DVec3,
    /// The frame around the axis.
    frame: TangentFrame,
    sin_half: f64,
    cos_half: f64,
    /// The inverse of the share of the cone's weight that is above the surface, or zero.
    scale: f64,
}

impl From<&Receiver> for Reflection {
    fn from(receiver: &Receiver) -> Self {
        let normal = DVec3::from(receiver.normal);
        Self {
            position: receiver.position,
            normal,
            frame: TangentFrame::new(normal),
            sin_half: 1.0,
            cos_half: 0.0,
            scale: 1.0,
        }
    }
}

impl From<&Lobe> for Reflection {
    fn from(lobe: &Lobe) -> Self {
        let (axis, normal) = (DVec3::from(lobe.axis), DVec3::from(lobe.receiver.normal));
        let (sin_half, cos_half) = lobe.half_angle.sin_cos();
        let above = weight_above(sin_half, cos_half, axis.dot(normal));
        Self {
            position: lobe.receiver.position,
            normal,
            frame: TangentFrame::new(axis),
            sin_half,
            cos_half,
            scale: if above > MIN_WEIGHT_ABOVE {
                1.0 / above
            } else {
                0.0
            },
        }
    }
}

/// The minimum share of a cone above the surface; a cone with less reflects nothing. No viewer in
/// front of the surface sees such a cone.
const MIN_WEIGHT_ABOVE: f64 = 1e-9;

impl Reflection {
    /// Maps a point of the unit square to a direction, of length 1, and its weight. The mean of
    /// weight times radiance over uniform points is the reflection.
    ///
    /// `None` for a direction below the surface.
    pub(super) fn sample(&self, square: [f64; 2]) -> Option<(DVec3, f64)> {
        let direction = self.frame.cosine_weighted(square, self.sin_half);
        (direction.dot(self.normal) > 0.0).then_some((direction, self.scale))
    }

    /// Returns the weight of a direction, of length 1, per solid angle.
    pub(super) fn density(&self, direction: DVec3) -> f64 {
        let cosine = self.frame.normal.dot(direction);
        match cosine > self.cos_half && direction.dot(self.normal) > 0.0 {
            true => self.scale * cosine / (PI * self.sin_half * self.sin_half),
            false => 0.0,
        }
    }
}

/// Returns the share of a cone's weight above a plane, where `cos_tilt` = d·n is the cosine of its
/// axis d to the normal n.
///
/// ∫ω dω over the part above is p d + q n (derived as for the axis of T_clip), and the sum of the
/// weights is its component along d.
fn weight_above(sin_half: f64, cos_half: f64, cos_tilt: f64) -> f64 {
    // The cone's rim crosses the plane if the half-angle exceeds the axis's elevation.
    let square = sin_half * sin_half - cos_tilt * cos_tilt;
    if square <= 0.0 {
        return if cos_tilt > 0.0 { 1.0 } else { 0.0 };
    }
    let root = square.sqrt();
    // Half of the azimuth about d of the rim above the plane, and half of the azimuth about n of
    // the horizon inside the cone.
    let rim = root.atan2(-cos_half * cos_tilt);
    let horizon = root.atan2(cos_half);
    let p = sin_half * sin_half * (rim - rim.sin() * rim.cos());
    let q = horizon - horizon.sin() * horizon.cos();
    (p + q * cos_tilt) / (PI * sin_half * sin_half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::strata::{Random, Strata};

    fn lobe(tilt: f64, half_angle: f64) -> Lobe {
        let receiver = Receiver {
            position: [0.0; 3],
            normal: [0.0, 1.0, 0.0],
        };
        let (sin, cos) = tilt.to_radians().sin_cos();
        Lobe {
            receiver,
            axis: [sin, cos, 0.0],
            half_angle: half_angle.to_radians(),
        }
    }

    /// Whether a mean is 1 within five standard errors and rounding.
    fn is_one(means: [f64; 1], variances: [f64; 1]) -> bool {
        (means[0] - 1.0).abs() < 5.0 * variances[0].sqrt() + 1e-12
    }

    #[test]
    fn weights_above_the_surface_sum_to_one_for_any_tilt() {
        for half_angle in [3.0, 20.0, 60.0, 90.0] {
            for tilt in [0.0, 30.0, 65.0, 85.0, 90.0] {
                let reflection = Reflection::from(&lobe(tilt, half_angle));
                let mut random = Random::of_receiver(1, 2);
                let estimates = Strata::of_samples(20_000).accumulate(&mut random, |square| {
                    [reflection.sample(square).map_or(0.0, |(_, weight)| weight)]
                });
                let (means, variances) = (estimates.means(), estimates.variances());
                assert!(is_one(means, variances), "{tilt} {half_angle}: {means:?}");
            }
        }
    }

    #[test]
    fn densities_integrate_to_one() {
        // Height and azimuth parametrize the sphere by equal areas.
        for (tilt, half_angle) in [(0.0, 90.0), (40.0, 60.0), (80.0, 30.0)] {
            let reflection = Reflection::from(&lobe(tilt, half_angle));
            let mut random = Random::of_receiver(3, 4);
            let estimates = Strata::of_samples(200_000).accumulate(&mut random, |[s, t]| {
                let (z, (sin, cos)) = (2.0 * s - 1.0, (2.0 * PI * t).sin_cos());
                let r = (1.0 - z * z).sqrt();
                [4.0 * PI * reflection.density(DVec3::new(r * cos, z, r * sin))]
            });
            let (means, variances) = (estimates.means(), estimates.variances());
            assert!(is_one(means, variances), "{tilt} {half_angle}: {means:?}");
        }
    }

    #[test]
    fn seen_from_mirrors_the_view_about_the_normal() {
        let receiver = lobe(0.0, 10.0).receiver;
        let axis = Lobe::seen_from([0.6, 0.8, 0.0], receiver, 0.1).axis;
        let expected = [-0.6, 0.8, 0.0];
        assert!((0..3).all(|x| (axis[x] - expected[x]).abs() < 1e-15));
    }
}
