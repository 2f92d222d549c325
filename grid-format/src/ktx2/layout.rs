//! The KTX2 layout of the one kind of texture that this profile allows: 80 bytes of header, one
//! level index entry, the data format descriptor, key/value data, the level.

use ::ktx2::{Format, Header, LevelIndex, dfd};
use serde::{Deserialize, Serialize};

use crate::{BakeRecord, TexelFormat};

/// The profile's version. A reader accepts every minor version of its own major version.
pub(crate) const PROFILE_MAJOR: u32 = 1;
pub(crate) const PROFILE_MINOR: u32 = 0;

/// The keys of the key/value pairs, and the value of `KTXorientation`. `aogrid` holds the JSON.
pub(crate) const METADATA_KEY: &str = "aogrid";
pub(crate) const ORIENTATION_KEY: &str = "KTXorientation";
pub(crate) const WRITER_KEY: &str = "KTXwriter";
pub(crate) const ORIENTATION: &str = "ruo";

/// Offset of the data format descriptor: behind the header and the index entry of the one level.
pub(crate) const DFD_START: usize = Header::LENGTH + LevelIndex::LENGTH;

/// The bytes of the data format descriptor section that hold the sizes of a texel's planes.
pub(crate) const BYTES_PLANES: std::ops::Range<usize> = 20..28;

/// The JSON object of the profile.
#[derive(Serialize, Deserialize)]
pub(crate) struct FileMetadata {
    pub version: String,
    pub encoding: String,
    pub center: [f32; 3],
    pub half_extents: [f32; 3],
    /// The point that the center is relative to; absent if it is zero.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub origin: [f64; 3],
    pub bake: BakeRecord,
    pub mean: f64,
    pub largest: f32,
    /// The BLAKE3 hash of the texels, in hexadecimal; files of aogrid 0.1.0 have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texels_blake3: Option<String>,
}

fn is_zero(origin: &[f64; 3]) -> bool {
    *origin == [0.0; 3]
}

/// The numbers of channels that a texel can have.
const CHANNELS: [usize; 2] = [1, 4];

/// Returns the Vulkan format of texels with one channel or four.
pub(crate) fn vk_format(channels: usize, format: TexelFormat) -> Format {
    let [one, four] = match format {
        TexelFormat::Unorm8 => [Format::R8_UNORM, Format::R8G8B8A8_UNORM],
        TexelFormat::F16 => [Format::R16_SFLOAT, Format::R16G16B16A16_SFLOAT],
        TexelFormat::F32 => [Format::R32_SFLOAT, Format::R32G32B32A32_SFLOAT],
    };
    if channels == 1 { one } else { four }
}

/// The inverse of [`vk_format`]; `None` for a format outside the profile.
pub(crate) fn texel_kind(format: Option<Format>) -> Option<(usize, TexelFormat)> {
    CHANNELS
        .into_iter()
        .flat_map(|channels| TexelFormat::ALL.map(|format| (channels, format)))
        .find(|&(channels, kind)| Some(vk_format(channels, kind)) == format)
}

/// Returns the data format descriptor section, its leading total length included, and the
/// header's type size.
pub(crate) fn descriptor(format: Format) -> (Vec<u8>, u32) {
    let (basic, type_size) =
        dfd::Basic::from_format(format).expect("the profile's formats are all in ktx2's table");
    let block = dfd::Block::Basic(basic).to_vec();
    let total = (block.len() + 4) as u32;
    ([&total.to_le_bytes()[..], &block].concat(), type_size)
}

/// Returns the offset of the level: the first multiple of both 4 and the texel's bytes at or after
/// `end`, the end of the key/value data. Texels have 1, 2 or 4 · 2ⁿ bytes, so a multiple of the
/// larger is a multiple of both.
pub(crate) fn level_start(end: usize, texel_bytes: usize) -> usize {
    end.next_multiple_of(texel_bytes.max(4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_count_and_texel_format_has_its_own_vulkan_format() {
        for channels in CHANNELS {
            for format in TexelFormat::ALL {
                let vk = vk_format(channels, format);
                assert_eq!(texel_kind(Some(vk)), Some((channels, format)));
                let (bytes, type_size) = descriptor(vk);
                assert_eq!(type_size as usize, format.channel_bytes());
                // 4 of total length, 24 of basic block, 16 for each channel's sample.
                assert_eq!(bytes.len(), 28 + 16 * channels);
            }
        }
        assert_eq!(texel_kind(Some(Format::R8G8B8A8_SRGB)), None);
        assert_eq!(texel_kind(None), None);
    }
}
