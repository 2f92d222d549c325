//! `T_clip(a, cos β)`: an occlusion cone clipped by the receiver's tangent plane (RR-5779, sections
//! 5.1 and 5.2.2).
//!
//! The cone covers the fraction `a` of the sphere around the axis d; the plane has the normal n;
//! cos β = d·n. The part of the cone above the plane is a region C, and
//!
//! - AO = (1/π) ∫_C ω·n dω is the occlusion that it casts on a Lambertian receiver,
//! - a′ = (1/4π) ∫_C dω is the fraction of the sphere that C covers,
//! - f is the weight for which f d + (1 − f) n has the direction of ∫_C ω dω, the axis of C.
//!
//! ∫_C ω dω lies in the plane of d and n. Written as p d + q n, it gives AO = (p cos β + q)/π
//! and f = p/(p + q); neither p nor q is ever negative. f weights d, as in the text of RR-5779;
//! both printed listings have `lerp(d, n, f)`, which weights n. An unclipped cone keeps its axis,
//! so it has f = 1, and a shader writes `mix(n, d, f)`.
//!
//! If C is empty, f is undefined and we set it to its limit: the direction in the plane that is
//! nearest to d. The only point without a limit is a = ½, cos β = 1, where d = n and every f gives
//! the same axis.

use crate::cap::{TiltedCap, angle_of_cos, half_angle, sin_cos_half_angle};
use crate::real::{Float, Real};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

/// The part of a cone above a tangent plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clip<R> {
    /// AO, 0..=1: the cosine-weighted share of the receiver's hemisphere that is occluded.
    pub occlusion: R,
    /// a′, 0..=½: the fraction of the full sphere that the clipped cone covers.
    pub fraction: R,
    /// f, 0..=1: the clipped cone's axis is the direction of f d + (1 − f) n. The sum is zero only
    /// for d = −n and an empty clipped cone: guard the normalization.
    pub axis_weight: R,
}

impl<R: Real> Clip<R> {
    /// Returns AO, a′, f: the channels of the table, in their order.
    pub(crate) fn to_array(self) -> [R; 3] {
        [self.occlusion, self.fraction, self.axis_weight]
    }

    pub(crate) fn from_array([occlusion, fraction, axis_weight]: [R; 3]) -> Self {
        Self {
            occlusion,
            fraction,
            axis_weight,
        }
    }
}

/// Returns `T_clip` by numeric integration over the angle from the normal.
///
/// `a`: fraction of the sphere, 0..=1. `cos_beta`: cosine of the angle between the cone's axis
/// and the receiver's normal, −1..=1. Arguments out of range are clamped, NaN to the low end.
///
/// Agrees with [`closed_form`] to 1e-12; f to 1e-15/sin β if that is larger.
pub fn integrate(a: f64, cos_beta: f64) -> Clip<f64> {
    let (a, cos_beta) = (a.within(0.0, 1.0), cos_beta.within(-1.0, 1.0));
    let cap = TiltedCap::new(half_angle(a), angle_of_cos(cos_beta));
    let rings = cap.sum_rings_up_to(FRAC_PI_2);

    let sin_beta = ((1.0 - cos_beta) * (1.0 + cos_beta)).sqrt();
    let p = if sin_beta > 0.0 {
        rings.across / sin_beta
    } else {
        whole_rim_p(a, cos_beta)
    };
    // p + q = p + (M_n − p cos β), in a form without cancellation.
    let p_plus_q = rings.along + p * (1.0 - cos_beta);
    Clip {
        occlusion: (rings.along / PI).within(0.0, 1.0),
        fraction: (rings.solid_angle / (4.0 * PI)).within(0.0, 0.5),
        axis_weight: axis_weight(p, p_plus_q, cos_beta),
    }
}

/// The limit of p for sin β → 0, where ∫_C ω dω has no component perpendicular to n from which p
/// could be computed: the rim is a circle around n, either all above the plane or all below it.
fn whole_rim_p(a: f64, cos_beta: f64) -> f64 {
    let (sin_alpha, cos_alpha) = sin_cos_half_angle(a);
    let (half_rim, _, _) = uncut(cos_alpha, cos_beta);
    sin_alpha * sin_alpha * half_rim
}

/// Returns `T_clip` in closed form. Arguments and result as for [`integrate`]; in `f32` within 1e-6
/// of the exact value.
///
/// The rim and the plane intersect at two points. These determine half the part of the rim above
/// the plane (t₀, an azimuth around d), half the part of the horizon inside the cone (φ₀, an
/// azimuth around n) and the angle between rim and horizon (ψ), all as arc tangents with the same
/// root D. Then p = sin²α (t₀ − sin t₀ cos t₀), q = φ₀ − sin φ₀ cos φ₀, and a′ = (ψ − t₀ cos α)/2π
/// by Gauss-Bonnet.
pub fn closed_form<R: Real>(a: R, cos_beta: R) -> Clip<R> {
    let a = a.within(R::ZERO, R::ONE);
    let cos_beta = cos_beta.within(-R::ONE, R::ONE);
    let (sin_alpha, cos_alpha) = sin_cos_half_angle(a);

    // D² ≤ 0: the plane misses the rim.
    let square = root_squared(sin_alpha, cos_alpha, cos_beta);
    let (half_rim, half_horizon, corner) = if square > R::ZERO {
        let root = square.sqrt();
        (
            root.atan2(-cos_alpha * cos_beta),
            root.atan2(cos_alpha),
            root.atan2(-cos_beta),
        )
    } else {
        uncut(cos_alpha, cos_beta)
    };

    let p = sin_alpha * sin_alpha * twice_segment(half_rim);
    let q = twice_segment(half_horizon);
    let fraction = (corner - half_rim * cos_alpha) / (R::TWO * R::PI);
    Clip {
        occlusion: ((p * cos_beta + q) / R::PI).within(R::ZERO, R::ONE),
        fraction: fraction.within(R::ZERO, R::HALF.min(a)),
        axis_weight: axis_weight(p, p + q, cos_beta),
    }
}

/// Returns D² = sin²α − cos²β = sin²β − cos²α, using the difference with the smaller terms.
fn root_squared<R: Float>(sin_alpha: R, cos_alpha: R, cos_beta: R) -> R {
    if cos_beta.abs() < R::lit(FRAC_1_SQRT_2) {
        (sin_alpha - cos_beta) * (sin_alpha + cos_beta)
    } else {
        let sin_beta = ((R::ONE - cos_beta) * (R::ONE + cos_beta)).sqrt();
        (sin_beta - cos_alpha) * (sin_beta + cos_alpha)
    }
}

/// Returns t₀, φ₀ and ψ if the plane misses the rim. Up to a hemisphere the rim is above the plane
/// if the cone is; beyond a hemisphere the complement of the cone, a cone around −d, decides.
fn uncut<R: Float>(cos_alpha: R, cos_beta: R) -> (R, R, R) {
    let up_to_hemisphere = cos_alpha >= R::ZERO;
    let rim_above = if up_to_hemisphere {
        cos_beta > R::ZERO
    } else {
        cos_beta < R::ZERO
    };
    let pi_if = |yes| if yes { R::PI } else { R::ZERO };
    (
        pi_if(rim_above),
        pi_if(!up_to_hemisphere),
        pi_if(rim_above == up_to_hemisphere),
    )
}

/// Returns x − sin x cos x, twice the area of the segment of the unit disk with half-angle x.
///
/// For small x the two terms cancel, and f is a ratio of such differences: there the power series
/// of (2x − sin 2x)/2 is used instead.
fn twice_segment<R: Float>(x: R) -> R {
    let y = R::TWO * x;
    if y > R::ONE {
        return x - x.sin() * x.cos();
    }
    // y³/12 (1 − y²/(4·5) (1 − y²/(6·7) (1 − …))); the first omitted term is below 1e-17.
    let series = (2..=8).rev().fold(R::ONE, |tail, k| {
        R::ONE - y * y / R::lit(f64::from(2 * k * (2 * k + 1))) * tail
    });
    y * y * y / R::lit(12.0) * series
}

/// Returns f = p/(p + q), or its limit if the clipped cone is empty.
fn axis_weight<R: Float>(p: R, p_plus_q: R, cos_beta: R) -> R {
    if p_plus_q > R::ZERO {
        (p / p_plus_q).within(R::ZERO, R::ONE)
    } else {
        R::ONE / (R::ONE + (-cos_beta).max(R::ZERO))
    }
}
