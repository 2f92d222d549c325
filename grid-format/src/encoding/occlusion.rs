//! The occluded fraction of the sphere alone (RR-5779, section 4).

use super::{Channel, Facts};
use crate::{ChannelRange, TexelFormat};

pub(super) struct Occlusion;

impl Facts for Occlusion {
    const NAME: &'static str = "occlusion";
    const CHANNELS: &'static [Channel] = &[Channel {
        name: "a",
        range: ChannelRange::Unit,
    }];
    const HAS_DIRECTION: bool = false;

    #[inline(always)]
    fn push_cell(format: TexelFormat, [_, _, _, a]: [f32; 4], out: &mut Vec<u8>) {
        format.push(ChannelRange::Unit, a, out);
    }

    #[inline(always)]
    fn values(format: TexelFormat, texel: &[u8]) -> [f32; 4] {
        [format.read(ChannelRange::Unit, texel), 0.0, 0.0, 0.0]
    }

    #[inline(always)]
    fn cell_from_values([a, ..]: [f32; 4]) -> [f32; 4] {
        [0.0, 0.0, 0.0, a]
    }

    fn max_error(format: TexelFormat) -> [f32; 2] {
        [format.max_error(ChannelRange::Unit), 0.0]
    }
}
