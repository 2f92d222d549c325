//! The bytes of the committed tables.
//!
//! The masters are decoded, the textures are uploaded to the GPU as they are. `files` has the
//! layout of the files.

use crate::format::Format;

static CLIP_F32: &[u8] = payload(include_bytes!("generated/t_clip.f32"));
static CLIP_F16: &[u8] = payload(include_bytes!("generated/t_clip.rgba16float"));
static CLIP_UNORM8: &[u8] = payload(include_bytes!("generated/t_clip.rgba8unorm"));
static MERGE_F32: &[u8] = payload(include_bytes!("generated/t_merge.f32"));
static MERGE_F16: &[u8] = payload(include_bytes!("generated/t_merge.r16float"));
static MERGE_UNORM8: &[u8] = payload(include_bytes!("generated/t_merge.r8unorm"));

/// Returns the texels of `T_clip` to upload: [`ClipTable::SIZE`](crate::ClipTable::SIZE) of them, x
/// fastest, tightly packed, little-endian. Channels: AO, a′, f, 1.
#[inline]
pub fn clip_texels(format: Format) -> &'static [u8] {
    match format {
        Format::F16 => CLIP_F16,
        Format::Unorm8 => CLIP_UNORM8,
    }
}

/// Returns the texels of `T_merge` to upload: [`MergeTable::SIZE`](crate::MergeTable::SIZE) of them,
/// x fastest, tightly packed, little-endian. One channel, the union.
#[inline]
pub fn merge_texels(format: Format) -> &'static [u8] {
    match format {
        Format::F16 => MERGE_F16,
        Format::Unorm8 => MERGE_UNORM8,
    }
}

pub(crate) fn clip_master() -> Vec<[f32; 3]> {
    from_little_endian(CLIP_F32)
}

pub(crate) fn merge_master() -> Vec<[f32; 1]> {
    from_little_endian(MERGE_F32)
}

fn from_little_endian<const C: usize>(bytes: &[u8]) -> Vec<[f32; C]> {
    let value = |word: &[u8]| f32::from_le_bytes([word[0], word[1], word[2], word[3]]);
    let texel = |words: &[u8]| std::array::from_fn(|channel| value(&words[4 * channel..]));
    bytes.chunks_exact(4 * C).map(texel).collect()
}

/// Returns the bytes after the first line of a file.
const fn payload(file: &'static [u8]) -> &'static [u8] {
    let mut start = 0;
    while file[start] != b'\n' {
        start += 1;
    }
    file.split_at(start + 1).1
}
