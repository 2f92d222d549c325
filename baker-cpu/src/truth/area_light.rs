//! A rectangle that shines to one side.

use glam::DVec3;

/// A diffuse rectangle. It lights what lies on the side that u × v points to, and hides nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaLight {
    center: DVec3,
    half_u: DVec3,
    half_v: DVec3,
    normal: DVec3,
    area: f64,
    radiance: [f64; 3],
}

/// Why there is no such light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AreaLightError {
    /// Its sides are parallel or zero.
    #[error("its half-sides span no area")]
    NoArea,
    /// Its sides make another parallelogram.
    #[error("its half-sides are not at right angles")]
    NotRectangular,
}

/// How far from a right angle the sides may be, as a cosine.
const SKEW: f64 = 1e-4;

impl AreaLight {
    /// The rectangle around `center` with corners at ± `half_u` ± `half_v` (world units), and the
    /// radiance that it emits.
    ///
    /// # Errors
    ///
    /// The sides span no rectangle.
    pub fn new(
        center: [f64; 3],
        half_u: [f64; 3],
        half_v: [f64; 3],
        radiance: [f32; 3],
    ) -> Result<Self, AreaLightError> {
        let (half_u, half_v) = (DVec3::from(half_u), DVec3::from(half_v));
        let across = half_u.cross(half_v);
        let normal = across.try_normalize().ok_or(AreaLightError::NoArea)?;
        if half_u.dot(half_v).abs() > SKEW * half_u.length() * half_v.length() {
            return Err(AreaLightError::NotRectangular);
        }
        Ok(Self {
            center: center.into(),
            half_u,
            half_v,
            normal,
            area: 4.0 * across.length(),
            radiance: radiance.map(f64::from),
        })
    }

    /// The light's corners, around its normal.
    pub fn corners(&self) -> [[f64; 3]; 4] {
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[u, v]| (self.center + u * self.half_u + v * self.half_v).to_array())
    }

    /// The radiance that it emits.
    pub fn radiance(&self) -> [f64; 3] {
        self.radiance
    }

    /// From `position` to the light's point that belongs to `square`, and what arrives if all of
    /// the light is at that point: radiance times the solid angle that its area there has. None
    /// where it looks away.
    pub(super) fn sample(&self, square: [f64; 2], position: DVec3) -> Option<(DVec3, [f64; 3])> {
        let [u, v] = square.map(|v| 2.0 * v - 1.0);
        let towards = self.center + u * self.half_u + v * self.half_v - position;
        let leaves = -self.normal.dot(towards);
        if leaves <= 0.0 {
            return None;
        }
        // The cosine lacks a length.
        let solid_angle = self.area * leaves / towards.length().powi(3);
        Some((towards, self.radiance.map(|v| v * solid_angle)))
    }
}
