//! The meaning of a texel's channels, and their conversion to bytes.

use half::f16;

/// The values of a cell that a texture holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// R = a, the occluded fraction of the sphere (RR-5779 eq. 5).
    Occlusion,
    /// RGB = d, the unit axis of the occlusion cone in object axes, A = a (RR-5779, section 5).
    Cone,
}

impl Encoding {
    /// Every encoding.
    pub const ALL: [Self; 2] = [Self::Occlusion, Self::Cone];

    /// Returns the name in files and on command lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Occlusion => "occlusion",
            Self::Cone => "cone",
        }
    }

    /// Returns the number of channels per texel.
    pub fn channels(self) -> usize {
        match self {
            Self::Occlusion => 1,
            Self::Cone => 4,
        }
    }
}

/// The storage format of a channel.
///
/// Largest error of a stored value relative to the original f32 ([`TexelFormat::max_error`]):
///
/// | format | occlusion a, 0..1 | each component of d, −1..1 | axis |
/// |---|---|---|---|
/// | `Unorm8` | 1/510 ≈ 0.00196 | 1/254 ≈ 0.00394 | 0.39° |
/// | `F16` | 2⁻¹² ≈ 0.00024 | 2⁻¹² | 0.024° |
/// | `F32` | 0 | 0 | 0° |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TexelFormat {
    /// 8-bit unsigned normalized. a is `byte / 255`; d is `byte/255 · 255/127 − 128/127`, which
    /// is exactly zero at byte 128.
    Unorm8,
    /// IEEE 754 half precision.
    F16,
    /// IEEE 754 single precision.
    F32,
}

impl TexelFormat {
    /// Every format, smallest first.
    pub const ALL: [Self; 3] = [Self::Unorm8, Self::F16, Self::F32];

    /// Returns the name on command lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unorm8 => "unorm8",
            Self::F16 => "f16",
            Self::F32 => "f32",
        }
    }

    /// Returns the number of bytes per channel.
    pub fn channel_bytes(self) -> usize {
        match self {
            Self::Unorm8 => 1,
            Self::F16 => 2,
            Self::F32 => 4,
        }
    }

    /// Returns the largest absolute error of a stored value: `[for a, for a component of d]`.
    /// Derivation: unorm8 rounds to half a step of 1/255 or 1/127; f16 to half a unit in the last
    /// place, which is 2⁻¹¹ in [½, 1].
    pub fn max_error(self) -> [f32; 2] {
        match self {
            Self::Unorm8 => [0.5 / 255.0, 0.5 / 127.0],
            Self::F16 => [f32::powi(2.0, -12); 2],
            Self::F32 => [0.0; 2],
        }
    }

    pub(crate) fn push_fraction(self, a: f32, out: &mut Vec<u8>) {
        match self {
            Self::Unorm8 => out.push((a * 255.0).round() as u8),
            Self::F16 | Self::F32 => self.push_float(a, out),
        }
    }

    pub(crate) fn push_component(self, d: f32, out: &mut Vec<u8>) {
        match self {
            Self::Unorm8 => out.push(((d * 127.0).round() + 128.0) as u8),
            Self::F16 | Self::F32 => self.push_float(d, out),
        }
    }

    fn push_float(self, v: f32, out: &mut Vec<u8>) {
        if self == Self::F16 {
            out.extend(f16::from_f32(v).to_le_bytes());
        } else {
            out.extend(v.to_le_bytes());
        }
    }

    /// Decodes the fraction stored in `bytes`, [`TexelFormat::channel_bytes`] long.
    pub(crate) fn fraction(self, bytes: &[u8]) -> f32 {
        match self {
            Self::Unorm8 => f32::from(bytes[0]) / 255.0,
            Self::F16 | Self::F32 => self.float(bytes),
        }
    }

    /// Decodes the component of d stored in `bytes`, [`TexelFormat::channel_bytes`] long.
    pub(crate) fn component(self, bytes: &[u8]) -> f32 {
        match self {
            Self::Unorm8 => (f32::from(bytes[0]) - 128.0) / 127.0,
            Self::F16 | Self::F32 => self.float(bytes),
        }
    }

    fn float(self, bytes: &[u8]) -> f32 {
        if self == Self::F16 {
            f16::from_le_bytes([bytes[0], bytes[1]]).to_f32()
        } else {
            f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of the f32 arithmetic in encode and decode, on top of the format's own error.
    const F32_ROUNDING: f32 = 4.0 * f32::EPSILON;

    #[test]
    fn the_documented_error_bounds_are_tight() {
        for format in TexelFormat::ALL {
            let [mut worst_a, mut worst_d] = [0.0_f32; 2];
            for step in 0..=100_000 {
                let a = step as f32 / 100_000.0;
                let d = 2.0 * a - 1.0;
                let mut bytes = Vec::new();
                format.push_fraction(a, &mut bytes);
                worst_a = worst_a.max((format.fraction(&bytes) - a).abs());
                bytes.clear();
                format.push_component(d, &mut bytes);
                worst_d = worst_d.max((format.component(&bytes) - d).abs());
            }
            let [max_a, max_d] = format.max_error();
            assert!(worst_a <= max_a + F32_ROUNDING, "{format:?} a: {worst_a}");
            assert!(worst_d <= max_d + F32_ROUNDING, "{format:?} d: {worst_d}");
            assert!(worst_a >= 0.98 * max_a && worst_d >= 0.98 * max_d);
        }
    }

    #[test]
    fn zero_and_plus_minus_one_are_exact_in_every_format() {
        for format in TexelFormat::ALL {
            for v in [-1.0, 0.0, 1.0] {
                let mut bytes = Vec::new();
                format.push_component(v, &mut bytes);
                assert_eq!(format.component(&bytes), v, "{format:?}");
                if v >= 0.0 {
                    bytes.clear();
                    format.push_fraction(v, &mut bytes);
                    assert_eq!(format.fraction(&bytes), v, "{format:?}");
                }
            }
        }
    }

    #[test]
    fn the_documented_angular_error_of_the_axis_is_tight() {
        for (format, degrees) in [(TexelFormat::Unorm8, 0.39), (TexelFormat::F16, 0.024)] {
            let mut worst = 0.0_f64;
            for step in 0..20_000 {
                // A spiral over the sphere: its height and azimuth are incommensurable.
                let z = (f64::from(step) + 0.5) / 10_000.0 - 1.0;
                let (sin, cos) = (f64::from(step) * 2.399_963).sin_cos();
                let r = (1.0 - z * z).sqrt();
                let d = [r * cos, r * sin, z];
                let stored = d.map(|v| {
                    let mut bytes = Vec::new();
                    format.push_component(v as f32, &mut bytes);
                    f64::from(format.component(&bytes))
                });
                let dot: f64 = (0..3).map(|x| d[x] * stored[x]).sum();
                let cross = [0, 1, 2].map(|x| {
                    let (y, z) = ((x + 1) % 3, (x + 2) % 3);
                    d[y] * stored[z] - d[z] * stored[y]
                });
                let sin = cross.iter().map(|v| v * v).sum::<f64>().sqrt();
                worst = worst.max(sin.atan2(dot).to_degrees());
            }
            assert!(
                worst <= degrees && worst > 0.8 * degrees,
                "{format:?}: {worst}"
            );
        }
    }
}
