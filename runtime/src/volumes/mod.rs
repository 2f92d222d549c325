//! Ambient occlusion volumes: the analytic occlusion of single triangles (McGuire 2010).
//!
//! # Theory
//!
//! A polygon covers the share (1/2π) |Σ θᵢ n·(pᵢ × pᵢ₊₁)/|pᵢ × pᵢ₊₁|| of the cosine-weighted hemisphere
//! of a receiver with normal n, where pᵢ are the corners of its part above the receiver's horizon,
//! relative to the receiver, and θᵢ the angle between two of them: Lambert's form factor, and McGuire's
//! equation 1. A weight lets it fall off within a volume over the polygon's front side, so that only
//! near receivers need it. The sum over all polygons, at most 1, is AO: two behind one another count
//! twice.
//!
//! # Practice
//!
//! [`polygon_occlusion`] is the exact form factor of a polygon of any number of corners, in double
//! precision. The other functions are the twin of `volumes.wgsl` ([`wgsl::VOLUMES`]), under its names,
//! for triangles. No bake is needed, and the geometry may deform; the cost grows with the number of
//! triangles near a receiver.
//!
//! [`wgsl::VOLUMES`]: crate::wgsl::VOLUMES

mod exact;
#[cfg(test)]
mod tests;
mod twin;

use bytemuck::{Pod, Zeroable};

pub use exact::polygon_occlusion;
pub use twin::*;

/// The extent and weight of volumes: the struct of the same name in the WGSL, 16 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct AogridVolume {
    /// The distance at which occlusion ends, in world units.
    pub extent: f32,
    /// The exponent of the fall-off along the triangle's normal.
    pub exponent: f32,
    /// The [weight](VolumeWeight), as a number.
    pub weight: u32,
    /// 1 if triangles occlude on both sides, 0 if only where they face the receiver.
    pub two_sided: u32,
}

/// The fall-off of a triangle's occlusion within its volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VolumeWeight {
    /// 1 up to the extent, measured along the normal and in the triangle's plane, and 0 beyond.
    None,
    /// (1 − r/δ)(1 − h/δ)^exponent: r is the distance in the triangle's plane, h that along its normal.
    Linear {
        /// The exponent, 1 unless you choose.
        exponent: f32,
    },
    /// A ramp for each edge in place of 1 − r/δ, as in McGuire's paper. It equals the linear weight
    /// except at corners, where the ramps of two edges multiply.
    Edges {
        /// The exponent.
        exponent: f32,
    },
}

/// The reason that a volume is invalid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// The extent is not positive and finite.
    #[error("the extent {0} of volumes must be greater than zero and finite")]
    Extent(f32),
    /// The exponent is negative or not finite.
    #[error("the exponent {0} of the fall-off must be finite and not negative")]
    Exponent(f32),
}

impl AogridVolume {
    /// Returns the shader data of volumes that reach `extent` world units.
    ///
    /// # Errors
    ///
    /// The extent is not positive and finite, or the exponent is negative or not finite.
    pub fn new(extent: f32, weight: VolumeWeight, two_sided: bool) -> Result<Self, VolumeError> {
        if !(extent > 0.0 && extent.is_finite()) {
            return Err(VolumeError::Extent(extent));
        }
        let (number, exponent) = match weight {
            VolumeWeight::None => (AOGRID_WEIGHT_NONE, 0.0),
            VolumeWeight::Linear { exponent } => (AOGRID_WEIGHT_LINEAR, exponent),
            VolumeWeight::Edges { exponent } => (AOGRID_WEIGHT_EDGES, exponent),
        };
        if !(exponent >= 0.0 && exponent.is_finite()) {
            return Err(VolumeError::Exponent(exponent));
        }
        Ok(Self {
            extent,
            exponent,
            weight: number,
            two_sided: u32::from(two_sided),
        })
    }
}

/// [`VolumeWeight::None`] in shaders.
pub(crate) const AOGRID_WEIGHT_NONE: u32 = 0;
/// [`VolumeWeight::Linear`] in shaders.
pub(crate) const AOGRID_WEIGHT_LINEAR: u32 = 1;
/// [`VolumeWeight::Edges`] in shaders.
pub(crate) const AOGRID_WEIGHT_EDGES: u32 = 2;
