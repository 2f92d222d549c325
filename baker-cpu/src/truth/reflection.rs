//! What a surface makes of the light that arrives: diffuse, or a glossy lobe.

use std::f64::consts::PI;

use glam::DVec3;

use super::Receiver;
use super::strata::Frame;

/// A receiver that mirrors, not sharply: what one viewer sees there is the mean radiance over a
/// cone about the mirrored direction, each direction weighted by its cosine to that. Of the
/// cone only what is above the surface counts, and counts as the whole. A cone of 90° about the
/// normal is a diffuse surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// The point that reflects.
    pub receiver: Receiver,
    /// The mirrored direction, of length 1, in world space.
    pub axis: [f64; 3],
    /// Of the cone, in radians, above 0 and up to π/2.
    pub half_angle: f64,
}

impl Lobe {
    /// What a viewer sees in this direction, of length 1, from the receiver.
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

/// A receiver and how it weighs directions. The density of the weights, per solid angle, is the
/// cosine to an axis, within a cone and above the surface.
pub(super) struct Reflection {
    pub position: [f64; 3],
    normal: DVec3,
    /// Around the axis.
    frame: Frame,
    sin_half: f64,
    cos_half: f64,
    /// 1 over the share of the cone's weights that is above the surface.
    scale: f64,
}

impl From<&Receiver> for Reflection {
    fn from(receiver: &Receiver) -> Self {
        let normal = DVec3::from(receiver.normal);
        Self {
            position: receiver.position,
            normal,
            frame: Frame::new(normal),
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
        let above = share_above(sin_half, cos_half, axis.dot(normal));
        Self {
            position: lobe.receiver.position,
            normal,
            frame: Frame::new(axis),
            sin_half,
            cos_half,
            scale: if above > LEAST { 1.0 / above } else { 0.0 },
        }
    }
}

/// A cone of which less is above the surface reflects nothing: nobody who sees the surface's front
/// sees such a cone.
const LEAST: f64 = 1e-9;

impl Reflection {
    /// The direction, of length 1, that belongs to a point of the unit square, and what it counts:
    /// the mean over all points is the reflection. None below the surface.
    pub(super) fn sample(&self, square: [f64; 2]) -> Option<(DVec3, f64)> {
        let direction = self.frame.cosine_weighted(square, self.sin_half);
        (direction.dot(self.normal) > 0.0).then_some((direction, self.scale))
    }

    /// What light from a direction of length 1 counts, per solid angle.
    pub(super) fn density(&self, direction: DVec3) -> f64 {
        let cosine = self.frame.normal.dot(direction);
        match cosine > self.cos_half && direction.dot(self.normal) > 0.0 {
            true => self.scale * cosine / (PI * self.sin_half * self.sin_half),
            false => 0.0,
        }
    }
}

/// The share of a cone's weights above a plane, `cos_tilt` the cosine of its axis to the normal d·n.
/// ∫ω dω over the part above is p d + q n (the derivation is that of T_clip's axis), and the
/// weights' sum is what of it lies along d.
fn share_above(sin_half: f64, cos_half: f64, cos_tilt: f64) -> f64 {
    let square = sin_half * sin_half - cos_tilt * cos_tilt;
    if square <= 0.0 {
        return if cos_tilt > 0.0 { 1.0 } else { 0.0 };
    }
    let root = square.sqrt();
    let rim = root.atan2(-cos_half * cos_tilt);
    let horizon = root.atan2(cos_half);
    let p = sin_half * sin_half * (rim - rim.sin() * rim.cos());
    let q = horizon - horizon.sin() * horizon.cos();
    (p + q * cos_tilt) / (PI * sin_half * sin_half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::strata::Strata;

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

    /// Five standard errors, and rounding.
    fn is_one(means: [f64; 1], variances: [f64; 1]) -> bool {
        (means[0] - 1.0).abs() < 5.0 * variances[0].sqrt() + 1e-12
    }

    #[test]
    fn weights_above_the_surface_add_up_to_one_however_the_lobe_is_tilted() {
        for half_angle in [3.0, 20.0, 60.0, 90.0] {
            for tilt in [0.0, 30.0, 65.0, 85.0, 90.0] {
                let reflection = Reflection::from(&lobe(tilt, half_angle));
                let tally = Strata::of_samples(20_000).tally(&mut Frame::random(1, 2), |square| {
                    [reflection.sample(square).map_or(0.0, |(_, weight)| weight)]
                });
                let (means, variances) = (tally.means(), tally.variances());
                assert!(is_one(means, variances), "{tilt} {half_angle}: {means:?}");
            }
        }
    }

    #[test]
    fn densities_are_those_of_the_samples() {
        // The sphere by equal areas: height and azimuth.
        for (tilt, half_angle) in [(0.0, 90.0), (40.0, 60.0), (80.0, 30.0)] {
            let reflection = Reflection::from(&lobe(tilt, half_angle));
            let tally = Strata::of_samples(200_000).tally(&mut Frame::random(3, 4), |[s, t]| {
                let (z, (sin, cos)) = (2.0 * s - 1.0, (2.0 * PI * t).sin_cos());
                let r = (1.0 - z * z).sqrt();
                [4.0 * PI * reflection.density(DVec3::new(r * cos, z, r * sin))]
            });
            let (means, variances) = (tally.means(), tally.variances());
            assert!(is_one(means, variances), "{tilt} {half_angle}: {means:?}");
        }
    }

    #[test]
    fn mirrors_send_a_view_to_the_other_side_of_the_normal() {
        let receiver = lobe(0.0, 10.0).receiver;
        let axis = Lobe::seen_from([0.6, 0.8, 0.0], receiver, 0.1).axis;
        let expected = [-0.6, 0.8, 0.0];
        assert!((0..3).all(|x| (axis[x] - expected[x]).abs() < 1e-15));
    }
}
