//! A rectangular area light that emits to one side.

use glam::DVec3;

/// A diffuse rectangular light. It emits to the side that u × v points to, and occludes nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaLight {
    center: DVec3,
    half_u: DVec3,
    half_v: DVec3,
    normal: DVec3,
    area: f64,
    radiance: [f64; 3],
}

/// The reason that an area light is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AreaLightError {
    /// The half-sides are parallel or zero.
    #[error("its half-sides span no area: they must be nonzero and not parallel")]
    NoArea,
    /// The half-sides span a parallelogram that is not a rectangle.
    #[error("its half-sides are not at right angles")]
    NotRectangular,
}

/// The maximum deviation of the half-sides from a right angle, as the cosine of their angle.
const MAX_SKEW: f64 = 1e-4;

impl AreaLight {
    /// Creates the rectangle around `center` with its corners at ± `half_u` ± `half_v` (world
    /// units), which emits `radiance`.
    ///
    /// # Errors
    ///
    /// The half-sides do not span a rectangle.
    pub fn new(
        center: [f64; 3],
        half_u: [f64; 3],
        half_v: [f64; 3],
        radiance: [f32; 3],
    ) -> Result<Self, AreaLightError> {
        let (half_u, half_v) = (DVec3::from(half_u), DVec3::from(half_v));
        let across = half_u.cross(half_v);
        let normal = across.try_normalize().ok_or(AreaLightError::NoArea)?;
        if half_u.dot(half_v).abs() > MAX_SKEW * half_u.length() * half_v.length() {
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

    /// Returns the corners, counterclockwise around the normal.
    pub fn corners(&self) -> [[f64; 3]; 4] {
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[u, v]| (self.center + u * self.half_u + v * self.half_v).to_array())
    }

    /// Returns the emitted radiance: red, green, blue.
    pub fn radiance(&self) -> [f64; 3] {
        self.radiance
    }

    /// Returns the vector from `position` to a point of the light, and the radiance times the solid
    /// angle that the light's area would have there. `square` selects the point, uniformly by area.
    ///
    /// `None` if the light faces away from `position`.
    pub(super) fn sample(&self, square: [f64; 2], position: DVec3) -> Option<(DVec3, [f64; 3])> {
        let [u, v] = square.map(|v| 2.0 * v - 1.0);
        let towards = self.center + u * self.half_u + v * self.half_v - position;
        // The cosine at the light times the distance.
        let projected = -self.normal.dot(towards);
        if projected <= 0.0 {
            return None;
        }
        // Area · cosine / distance²; the third power divides the distance out of `projected`.
        let solid_angle = self.area * projected / towards.length().powi(3);
        Some((towards, self.radiance.map(|v| v * solid_angle)))
    }
}
