//! Integration over a spherical cap in rings around an axis that is not its own, shared by both
//! tables.

use crate::quadrature::integrate;
use crate::real::Float;
use std::f64::consts::PI;

/// Returns the half-angle α of a cap that covers the fraction `a` of the sphere: a = (1 − cos α)/2.
///
/// It uses the arc tangent because the arc cosine loses all digits near 0 and π.
pub(crate) fn half_angle<R: Float>(a: R) -> R {
    R::TWO * a.sqrt().atan2((R::ONE - a).sqrt())
}

/// Returns the sine and cosine of [`half_angle`], without computing the angle.
pub(crate) fn sin_cos_half_angle<R: Float>(a: R) -> (R, R) {
    (R::TWO * (a * (R::ONE - a)).sqrt(), R::ONE - R::TWO * a)
}

/// Returns the angle with the given cosine, to full precision near 0 and π.
pub(crate) fn angle_of_cos(cos: f64) -> f64 {
    2.0 * (1.0 - cos).sqrt().atan2((1.0 + cos).sqrt())
}

/// A cap whose axis is tilted away from the axis of integration.
///
/// The sphere is cut into rings around the axis of integration, at angle θ from it. The directions
/// of a ring inside the cap are those whose azimuth is less than
/// φ(θ) = acos(clamp((cos α − cos θ cos β) / (sin θ sin β))) away from the cap's axis, which is
/// the integrand of JGT supplement eq. 1 (α half-angle, β tilt). φ has kinks at the first and the
/// last ring that crosses the cap's rim, θ = |α − β| and θ = min(α + β, 2π − α − β). Before the
/// first a ring lies wholly inside the cap if α > β, else wholly outside it; beyond the last it
/// lies wholly inside if α + β > π, else wholly outside.
pub(crate) struct TiltedCap {
    half_angle: f64,
    tilt: f64,
    /// Angle of the first ring that crosses the rim.
    first: f64,
    /// Angle of the last ring that crosses the rim.
    last: f64,
}

/// Integrals over the part of a cap that lies within some angle of the axis of integration.
pub(crate) struct RingSums {
    /// Solid angle, ∫ 2φ sin θ dθ.
    pub solid_angle: f64,
    /// Component of ∫ω dω along the axis of integration, ∫ 2φ cos θ sin θ dθ.
    pub along: f64,
    /// Component of ∫ω dω perpendicular to it, toward the cap's axis, ∫ 2 sin φ sin²θ dθ.
    pub across: f64,
}

impl TiltedCap {
    /// Creates a cap from `half_angle` and `tilt` in radians, 0..=π.
    pub(crate) fn new(half_angle: f64, tilt: f64) -> Self {
        Self {
            half_angle,
            tilt,
            first: (half_angle - tilt).abs(),
            last: (half_angle + tilt).min(2.0 * PI - half_angle - tilt),
        }
    }

    /// Sums all rings from the axis up to the angle `limit`, piece by piece between the kinks.
    pub(crate) fn sum_rings_up_to(&self, limit: f64) -> RingSums {
        let (first, last) = (self.first.min(limit), self.last.min(limit));
        let inner = if self.half_angle > self.tilt { PI } else { 0.0 };
        let outer = if self.half_angle + self.tilt > PI {
            PI
        } else {
            0.0
        };

        // φ is constant before the first kink and beyond the last one.
        let before = integrate(first, |theta, _| ring(theta, inner, 0.0));
        let crossing = integrate(last - first, |from_first, to_last| {
            let phi = self.half_width(from_first, to_last + (self.last - last));
            ring(first + from_first, phi, phi.sin())
        });
        let beyond = integrate(limit - last, |from_last, _| {
            ring(last + from_last, outer, 0.0)
        });

        let [solid_angle, along, across] =
            std::array::from_fn(|k| before[k] + crossing[k] + beyond[k]);
        RingSums {
            solid_angle,
            along,
            across,
        }
    }

    /// Returns φ of a ring that crosses the rim, given its distances from the two kinks.
    ///
    /// With g the arc cosine's argument, 1 − g and 1 + g are (up to a common factor) products of
    /// the sines of half the distances to the kinks. φ = 2 atan √((1 − g)/(1 + g)) then keeps its
    /// digits where g loses them: small caps, small tilts, rings that touch the rim.
    fn half_width(&self, from_first: f64, to_last: f64) -> f64 {
        let near_first = (0.5 * from_first).sin();
        let far_first = (self.first + 0.5 * from_first).sin();
        let near_last = (0.5 * to_last).sin();
        let far_last = (self.last - 0.5 * to_last).sin();
        // The kinks swap roles with the signs of α − β and α + β − π.
        let (one_minus_g, one_plus_g) = match (
            self.half_angle >= self.tilt,
            self.half_angle + self.tilt <= PI,
        ) {
            (true, true) => (far_first * near_last, near_first * far_last),
            (true, false) => (far_first * far_last, near_first * near_last),
            (false, true) => (near_first * near_last, far_first * far_last),
            (false, false) => (near_first * far_last, far_first * near_last),
        };
        2.0 * one_minus_g
            .max(0.0)
            .sqrt()
            .atan2(one_plus_g.max(0.0).sqrt())
    }
}

/// Returns the three integrands at one ring. sin φ is an argument because sin π is not 0 in f64.
fn ring(theta: f64, phi: f64, sin_phi: f64) -> [f64; 3] {
    let (sin_theta, cos_theta) = theta.sin_cos();
    let area = 2.0 * phi * sin_theta;
    [
        area,
        area * cos_theta,
        2.0 * sin_phi * sin_theta * sin_theta,
    ]
}
