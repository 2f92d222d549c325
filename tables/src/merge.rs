//! `T_merge(a1, a2, γ)`: the fraction of the sphere that two cones cover together (JGT
//! supplement; RR-5779, section 5.2.2).
//!
//! The cones cover the fractions `a1` and `a2` around axes that are γ apart. Their union is
//! a1 + a2 − I, with I the fraction that both cover. I depends on the angle γ, in radians, not on
//! its cosine.

use crate::cap::{TiltedCap, half_angle};
use crate::real::{Float, Real};

/// Returns `T_merge` by numeric integration (JGT supplement eq. 1): over the rings around the
/// larger cone's axis up to its rim, each as far as it lies inside the smaller cone.
///
/// `a1`, `a2`: fractions of the sphere, 0..=1. `gamma`: angle between the axes, 0..=π radians.
/// Arguments out of range are clamped, NaN to the low end. The result lies between the larger of
/// both fractions and the smaller of their sum and 1. Agrees with [`closed_form`] to 1e-12.
pub fn integrate(a1: f64, a2: f64, gamma: f64) -> f64 {
    let (a1, a2, gamma) = domain(a1, a2, gamma);
    let rings_of_smaller = TiltedCap::new(half_angle(a1.min(a2)), gamma);
    let shared = rings_of_smaller
        .sum_rings_up_to(half_angle(a1.max(a2)))
        .solid_angle;
    union(a1, a2, shared / (4.0 * f64::PI))
}

/// Returns `T_merge` in closed form. Arguments and result as for [`integrate`]; in `f32` within
/// 1e-6 of the exact value, γ = π and γ = α₂ included.
pub fn closed_form<R: Real>(a1: R, a2: R, gamma: R) -> R {
    let (a1, a2, gamma) = domain(a1, a2, gamma);
    union(a1, a2, shared(a1, a2, gamma))
}

/// Returns I(a1, a2, γ), the fraction of the sphere that lies inside both cones, in closed form.
///
/// Arguments as for [`closed_form`]; the result lies between max(a1 + a2 − 1, 0) and the smaller of
/// both fractions. Environment look-ups use it to tell how much of one cone another one hides.
pub fn intersection<R: Real>(a1: R, a2: R, gamma: R) -> R {
    let (a1, a2, gamma) = domain(a1, a2, gamma);
    shared(a1, a2, gamma).within((a1 + a2 - R::ONE).max(R::ZERO), a1.min(a2))
}

fn domain<R: Float>(a1: R, a2: R, gamma: R) -> (R, R, R) {
    let unit = |a: R| a.within(R::ZERO, R::ONE);
    (unit(a1), unit(a2), gamma.within(R::ZERO, R::PI))
}

fn union<R: Float>(a1: R, a2: R, shared: R) -> R {
    (a1 + a2 - shared).within(a1.max(a2), (a1 + a2).min(R::ONE))
}

/// Returns the intersection of two caps: the lens shared by two crossing caps is two sectors, one
/// of each cap, minus the two spherical triangles between the axes and a crossing point of the
/// rims.
///
/// The triangle has the sides A, B and γ. Half its perimeter is s; s − A, s − B, s − γ and π − s
/// are all positive exactly if the rims cross. If not, the one that is not positive tells whether
/// the caps are disjoint, nested, or cover the sphere together. Each angle and the area E
/// (L'Huilier) are arc tangents of quotients of sines and cosines of these four, so that nothing
/// cancels where the rims touch.
fn shared<R: Float>(a1: R, a2: R, gamma: R) -> R {
    // If both caps exceed the hemisphere, their complements do not.
    if a1.min(a2) > R::HALF {
        return a1 + a2 - R::ONE + shared(R::ONE - a1, R::ONE - a2, gamma);
    }
    let (alpha1, alpha2) = (half_angle(a1), half_angle(a2));
    let less_alpha1 = R::HALF * (alpha2 + gamma - alpha1);
    let less_alpha2 = R::HALF * (alpha1 + gamma - alpha2);
    let less_gamma = R::HALF * (alpha1 + alpha2 - gamma);
    let less_s = R::PI - R::HALF * (alpha1 + alpha2 + gamma);
    // The caps are disjoint, or cover the sphere together, or one contains the other.
    if less_gamma <= R::ZERO {
        return R::ZERO;
    }
    if less_s <= R::ZERO {
        return a1 + a2 - R::ONE;
    }
    if less_alpha1 <= R::ZERO || less_alpha2 <= R::ZERO {
        return a1.min(a2);
    }

    // The half-angle formulas of the spherical triangle, with both legs of each arc tangent.
    let quarters = [less_s, less_alpha1, less_alpha2, less_gamma];
    let [sin_s, sin_1, sin_2, sin_gamma] = quarters.map(R::sin);
    let angle1 = R::TWO * root(sin_1 * sin_gamma).atan2(root(sin_s * sin_2));
    let angle2 = R::TWO * root(sin_2 * sin_gamma).atan2(root(sin_s * sin_1));
    (a1 * angle1 + a2 * angle2 - R::HALF * triangle_area(quarters)) / R::PI
}

/// Returns the area of the spherical triangle by L'Huilier's theorem, with π − s in place of s so
/// that the tangent has no pole.
fn triangle_area<R: Float>(quarters: [R; 4]) -> R {
    let halves = quarters.map(|x| R::HALF * x);
    let [sin_s, sin_1, sin_2, sin_gamma] = halves.map(R::sin);
    let [cos_s, cos_1, cos_2, cos_gamma] = halves.map(R::cos);
    let numerator = root(cos_s * sin_1 * sin_2 * sin_gamma);
    R::lit(4.0) * numerator.atan2(root(sin_s * cos_1 * cos_2 * cos_gamma))
}

/// The square root of a number that is non-negative but for rounding.
fn root<R: Float>(x: R) -> R {
    x.max(R::ZERO).sqrt()
}
