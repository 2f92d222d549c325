//! The texture formats of the uploaded tables.

use half::f16;

/// A texture format that every WebGPU adapter can filter. (16-bit unorm and 32-bit float need
/// features that not every adapter has.)
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 16-bit float: `rgba16float` for `T_clip`, `r16float` for `T_merge`.
    F16,
    /// 8-bit unorm: `rgba8unorm` for `T_clip`, `r8unorm` for `T_merge`.
    Unorm8,
}

impl Format {
    /// Every format, in order of decreasing precision.
    pub const ALL: [Self; 2] = [Self::F16, Self::Unorm8];

    /// Returns the little-endian bytes of a texture with these channels.
    pub(crate) fn encode(self, channels: impl Iterator<Item = f32>) -> Vec<u8> {
        match self {
            Self::F16 => channels
                .flat_map(|value| f16::from_f32(value).to_le_bytes())
                .collect(),
            Self::Unorm8 => channels.map(to_unorm8).collect(),
        }
    }

    /// Returns `value` as a shader reads it after its upload.
    pub(crate) fn quantize(self, value: f32) -> f32 {
        match self {
            Self::F16 => f16::from_f32(value).to_f32(),
            Self::Unorm8 => f32::from(to_unorm8(value)) / 255.0,
        }
    }
}

fn to_unorm8(value: f32) -> u8 {
    (value * 255.0).round() as u8
}
