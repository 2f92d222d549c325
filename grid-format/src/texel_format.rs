//! The storage of a channel's values as bytes.

use half::f16;

/// The range of a channel's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelRange {
    /// The range 0..=1, as of a fraction.
    Unit,
    /// The range −1..=1, as of a component of an axis.
    Signed,
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

impl ChannelRange {
    /// Whether a value is in the range; false for NaN.
    pub fn contains(self, value: f32) -> bool {
        match self {
            Self::Unit => (0.0..=1.0).contains(&value),
            Self::Signed => (-1.0..=1.0).contains(&value),
        }
    }
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

    /// Returns the format with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }

    /// Returns the number of bytes per channel.
    pub fn channel_bytes(self) -> usize {
        match self {
            Self::Unorm8 => 1,
            Self::F16 => 2,
            Self::F32 => 4,
        }
    }

    /// Returns the largest absolute error of a stored value. Derivation: unorm8 rounds to half a
    /// step of 1/255 or 1/127; f16 to half a unit in the last place, which is 2⁻¹¹ in [½, 1].
    pub fn max_error(self, range: ChannelRange) -> f32 {
        match (self, range) {
            (Self::Unorm8, ChannelRange::Unit) => 0.5 / 255.0,
            (Self::Unorm8, ChannelRange::Signed) => 0.5 / 127.0,
            (Self::F16, _) => f32::powi(2.0, -12),
            (Self::F32, _) => 0.0,
        }
    }

    /// Returns `[scale, offset]` of the decoding `scale · t + offset` of a channel t as a shader
    /// reads it ([`TexelFormat::shader_value`]).
    pub fn decoding(self, range: ChannelRange) -> [f64; 2] {
        match (self, range) {
            (Self::Unorm8, ChannelRange::Signed) => [255.0 / 127.0, -128.0 / 127.0],
            _ => [1.0, 0.0],
        }
    }

    /// Returns the channel at the start of `bytes` as a shader reads it from a texture, before the
    /// [decoding](TexelFormat::decoding).
    ///
    /// # Panics
    ///
    /// If there are fewer bytes than [`TexelFormat::channel_bytes`].
    #[inline(always)]
    pub fn shader_value(self, bytes: &[u8]) -> f32 {
        match self {
            Self::Unorm8 => f32::from(bytes[0]) / 255.0,
            Self::F16 => f16::from_le_bytes([bytes[0], bytes[1]]).to_f32(),
            Self::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }

    // `push` and `read` run once a channel: their branches, the same for all cells, must fold into
    // the caller's loop.

    /// Appends the bytes of a value.
    #[inline(always)]
    pub(crate) fn push(self, range: ChannelRange, value: f32, out: &mut Vec<u8>) {
        match (self, range) {
            (Self::Unorm8, ChannelRange::Unit) => out.push((value * 255.0).round() as u8),
            (Self::Unorm8, ChannelRange::Signed) => {
                out.push(((value * 127.0).round() + 128.0) as u8);
            }
            (Self::F16, _) => out.extend(f16::from_f32(value).to_le_bytes()),
            (Self::F32, _) => out.extend(value.to_le_bytes()),
        }
    }

    /// Decodes the value at the start of `bytes`.
    #[inline(always)]
    pub(crate) fn read(self, range: ChannelRange, bytes: &[u8]) -> f32 {
        match (self, range) {
            // One rounding, where scale and offset in single precision would have two.
            (Self::Unorm8, ChannelRange::Signed) => (f32::from(bytes[0]) - 128.0) / 127.0,
            _ => self.shader_value(bytes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RANGES: [ChannelRange; 2] = [ChannelRange::Unit, ChannelRange::Signed];

    /// Rounding of the f32 arithmetic in encode and decode, on top of the format's own error.
    const F32_ROUNDING: f32 = 4.0 * f32::EPSILON;

    fn stored(format: TexelFormat, range: ChannelRange, value: f32) -> Vec<u8> {
        let mut bytes = Vec::new();
        format.push(range, value, &mut bytes);
        bytes
    }

    #[test]
    fn the_documented_error_bounds_are_tight() {
        for format in TexelFormat::ALL {
            for range in RANGES {
                let mut worst = 0.0_f32;
                for step in 0..=100_000 {
                    let fraction = step as f32 / 100_000.0;
                    let value = match range {
                        ChannelRange::Unit => fraction,
                        ChannelRange::Signed => 2.0 * fraction - 1.0,
                    };
                    let found = format.read(range, &stored(format, range, value));
                    worst = worst.max((found - value).abs());
                }
                let bound = format.max_error(range);
                assert!(
                    worst <= bound + F32_ROUNDING,
                    "{format:?} {range:?}: {worst}"
                );
                assert!(worst >= 0.98 * bound, "{format:?} {range:?}: {worst}");
            }
        }
    }

    #[test]
    fn zero_and_plus_minus_one_are_exact_in_every_format() {
        for format in TexelFormat::ALL {
            for range in RANGES {
                for v in [-1.0, 0.0, 1.0] {
                    if range.contains(v) {
                        let found = format.read(range, &stored(format, range, v));
                        assert_eq!(found, v, "{format:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn shaders_decode_as_the_reader_does() {
        for format in TexelFormat::ALL {
            for range in RANGES {
                let [scale, offset] = format.decoding(range);
                for step in 0..=1000 {
                    let value = step as f32 / 1000.0;
                    let bytes = stored(format, range, value);
                    let t = f64::from(format.shader_value(&bytes));
                    let error = scale * t + offset - f64::from(format.read(range, &bytes));
                    assert!(
                        error.abs() <= f64::from(F32_ROUNDING),
                        "{format:?}: {error}"
                    );
                }
            }
        }
    }

    #[test]
    fn names_are_unique_and_found() {
        for format in TexelFormat::ALL {
            assert_eq!(TexelFormat::from_name(format.name()), Some(format));
        }
        assert_eq!(TexelFormat::from_name("unorm16"), None);
    }
}
