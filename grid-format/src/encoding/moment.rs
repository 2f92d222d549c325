//! The moments of the occluded directions, scaled for interpolation: v = m/(a(1 − a)) and √a.

use super::{Channel, Facts, channel};
use crate::ChannelRange::{Signed, Unit};
use crate::TexelFormat;

pub(super) struct Moment;

impl Facts for Moment {
    const NAME: &'static str = "moment";
    const CHANNELS: &'static [Channel] = &[
        channel("vx", Signed),
        channel("vy", Signed),
        channel("vz", Signed),
        channel("sqrt_a", Unit),
    ];
    const HAS_DIRECTION: bool = true;

    #[inline(always)]
    fn push_cell(format: TexelFormat, [x, y, z, a]: [f32; 4], out: &mut Vec<u8>) {
        for v in [x, y, z] {
            format.push(Signed, v, out);
        }
        format.push(Unit, a.sqrt(), out);
    }

    #[inline(always)]
    fn values(format: TexelFormat, texel: &[u8]) -> [f32; 4] {
        let channel = |c: usize| &texel[c * format.channel_bytes()..];
        let v = |c| format.read(Signed, channel(c));
        [v(0), v(1), v(2), format.read(Unit, channel(3))]
    }

    #[inline(always)]
    fn cell_from_values([x, y, z, root]: [f32; 4]) -> [f32; 4] {
        [x, y, z, root * root]
    }

    fn max_error(format: TexelFormat) -> [f32; 2] {
        // An error e of √a ≤ 1 changes a by at most 2e, and by rounding of the root and the square.
        [
            2.0 * format.max_error(Unit) + 2.0 * f32::EPSILON,
            format.max_error(Signed),
        ]
    }
}

#[cfg(test)]
mod tests {
    use crate::{Encoding, TexelFormat};

    /// Small fractions are what a far field is made of: 8 bits of √a tell fractions of 1/65,025
    /// apart, where 8 bits of a end at 1/510.
    #[test]
    fn small_fractions_survive_eight_bits() {
        let stored = |encoding: Encoding, a: f32| {
            let mut texel = Vec::new();
            encoding.push_cell(TexelFormat::Unorm8, [0.0, 0.0, 1.0, a], &mut texel);
            encoding.cell(TexelFormat::Unorm8, &texel)[3]
        };
        assert_eq!(stored(Encoding::Cone, 0.0015), 0.0);
        for a in [0.0001_f32, 0.0015, 0.02] {
            let relative = stored(Encoding::Moment, a) / a - 1.0;
            // Half a step of √a, 1/510, is a relative change of a of 1/(255 √a).
            let bound = 1.0 / (255.0 * a.sqrt()) + (1.0 / (510.0 * a.sqrt())).powi(2);
            assert!(relative.abs() <= bound, "{a}: {relative} {bound}");
        }
    }

    #[test]
    fn the_alpha_channel_holds_the_root() {
        let mut texel = Vec::new();
        let cell = [0.5, -0.25, 0.0, 0.25];
        Encoding::Moment.push_cell(TexelFormat::F32, cell, &mut texel);
        let values = Encoding::Moment.values(TexelFormat::F32, &texel);
        assert_eq!(values, [0.5, -0.25, 0.0, 0.5]);
        assert_eq!(Encoding::Moment.cell(TexelFormat::F32, &texel), cell);
    }
}
