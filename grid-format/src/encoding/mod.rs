//! The meaning of a texel's channels. All facts of an encoding are in a file of its own.

mod cone;
mod moment;
mod occlusion;

use crate::{ChannelRange, TexelFormat};

/// The values of a cell that a texture holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// R = a, the occluded fraction of the sphere (RR-5779 eq. 5).
    Occlusion,
    /// RGB = d, the unit axis of the occlusion cone in object axes, A = a (RR-5779, section 5).
    Cone,
    /// RGB = v = m/(a(1 − a)), A = √a, with m the first moment of the occluded directions, in
    /// object axes. v is the unit axis of a true cone and shorter where occlusion is spread out, so
    /// that interpolated cells tell how far their axes agree.
    Moment,
}

/// A channel of a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    /// The name in tables and exported files.
    pub name: &'static str,
    /// The range of its values.
    pub range: ChannelRange,
}

const fn channel(name: &'static str, range: ChannelRange) -> Channel {
    Channel { name, range }
}

/// The facts of an encoding. A cell is `[x, y, z, a]`, see [`Grid::encode`](crate::Grid::encode).
trait Facts {
    const NAME: &'static str;
    /// One channel or four: WebGPU has no texture formats with three, and none of ours has two.
    const CHANNELS: &'static [Channel];
    const HAS_DIRECTION: bool;

    /// Appends the texel of a cell.
    fn push_cell(format: TexelFormat, cell: [f32; 4], out: &mut Vec<u8>);

    /// Decodes a texel to the values of its channels; the values behind the last channel are zero.
    fn values(format: TexelFormat, texel: &[u8]) -> [f32; 4];

    /// Computes the cell from the values of the channels; x, y and z are zero without a direction.
    fn cell_from_values(values: [f32; 4]) -> [f32; 4];

    /// Returns the largest absolute error of a decoded cell: `[for a, for x, y and z]`.
    fn max_error(format: TexelFormat) -> [f32; 2];
}

/// Evaluates an expression in which `$facts` is the type with the facts of an encoding.
macro_rules! with_facts {
    ($encoding:expr, $facts:ident => $value:expr) => {
        match $encoding {
            Encoding::Occlusion => {
                type $facts = occlusion::Occlusion;
                $value
            }
            Encoding::Cone => {
                type $facts = cone::Cone;
                $value
            }
            Encoding::Moment => {
                type $facts = moment::Moment;
                $value
            }
        }
    };
}

impl Encoding {
    /// Every encoding, the recommended one first.
    pub const ALL: [Self; 3] = [Self::Moment, Self::Cone, Self::Occlusion];

    /// Returns the name in files and on command lines.
    pub fn name(self) -> &'static str {
        with_facts!(self, F => F::NAME)
    }

    /// Returns the encoding with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|e| e.name() == name)
    }

    /// Returns the number of channels per texel, 1 or 4.
    pub fn channels(self) -> usize {
        self.channel_list().len()
    }

    /// Returns the channels in their order in a texel.
    pub fn channel_list(self) -> &'static [Channel] {
        with_facts!(self, F => F::CHANNELS)
    }

    /// Returns the names of the channels in their order in a texel.
    pub fn channel_names(self) -> impl ExactSizeIterator<Item = &'static str> {
        self.channel_list().iter().map(|channel| channel.name)
    }

    /// Whether a cell has a direction: without one there are no cones to clip or to merge.
    pub fn has_direction(self) -> bool {
        with_facts!(self, F => F::HAS_DIRECTION)
    }

    /// Returns the largest absolute error of a decoded cell: `[for a, for x, y and z]`.
    pub fn max_error(self, format: TexelFormat) -> [f32; 2] {
        with_facts!(self, F => F::max_error(format))
    }

    /// Appends the texel of a cell `[x, y, z, a]`.
    #[inline(always)]
    pub(crate) fn push_cell(self, format: TexelFormat, cell: [f32; 4], out: &mut Vec<u8>) {
        with_facts!(self, F => F::push_cell(format, cell, out));
    }

    /// Decodes a texel to the cell `[x, y, z, a]`; x, y and z are zero without a direction.
    #[inline(always)]
    pub(crate) fn cell(self, format: TexelFormat, texel: &[u8]) -> [f32; 4] {
        with_facts!(self, F => F::cell_from_values(F::values(format, texel)))
    }

    /// Decodes a texel to the values of its channels; the values behind the last channel are zero.
    #[inline(always)]
    pub(crate) fn values(self, format: TexelFormat, texel: &[u8]) -> [f32; 4] {
        with_facts!(self, F => F::values(format, texel))
    }

    /// Whether all values of a texel are in their channels' ranges.
    #[inline(always)]
    pub(crate) fn is_in_range(self, format: TexelFormat, texel: &[u8]) -> bool {
        with_facts!(self, F => {
            let mut channels = F::CHANNELS.iter().zip(F::values(format, texel));
            channels.all(|(channel, value)| channel.range.contains(value))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_found() {
        for encoding in Encoding::ALL {
            assert_eq!(Encoding::from_name(encoding.name()), Some(encoding));
        }
        assert_eq!(Encoding::from_name("sh9"), None);
    }

    #[test]
    fn texels_have_one_channel_or_four_and_keep_what_they_hold() {
        for encoding in Encoding::ALL {
            assert!([1, 4].contains(&encoding.channels()));
            assert_eq!(encoding.channel_names().len(), encoding.channels());
            let mut texel = Vec::new();
            encoding.push_cell(TexelFormat::F32, [0.6, 0.0, -0.8, 0.25], &mut texel);
            assert_eq!(texel.len(), 4 * encoding.channels());
            let [x, y, z, a] = encoding.cell(TexelFormat::F32, &texel);
            let direction =
                [0.6, 0.0, -0.8].map(|v| if encoding.has_direction() { v } else { 0.0 });
            assert_eq!(([x, y, z], a), (direction, 0.25));
            assert!(encoding.is_in_range(TexelFormat::F32, &texel));
        }
    }
}
