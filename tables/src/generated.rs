//! The committed tables, and the files that hold them.
//!
//! Each file is one line of text, which names the table and its generator, followed by the raw
//! texels. The masters are decoded, the textures are uploaded to the GPU as they are.

use crate::format::Format;
use crate::table::{ClipTable, MergeTable};

static CLIP_F32: &[u8] = payload(include_bytes!("generated/t_clip.f32"));
static CLIP_F16: &[u8] = payload(include_bytes!("generated/t_clip.rgba16float"));
static CLIP_UNORM8: &[u8] = payload(include_bytes!("generated/t_clip.rgba8unorm"));
static MERGE_F32: &[u8] = payload(include_bytes!("generated/t_merge.f32"));
static MERGE_F16: &[u8] = payload(include_bytes!("generated/t_merge.r16float"));
static MERGE_UNORM8: &[u8] = payload(include_bytes!("generated/t_merge.r8unorm"));

/// Returns the texels of `T_clip` to upload: [`ClipTable::SIZE`] of them, x fastest, tightly
/// packed, little-endian. Channels: AO, a′, f, 1.
#[inline]
pub fn clip_texels(format: Format) -> &'static [u8] {
    match format {
        Format::F16 => CLIP_F16,
        Format::Unorm8 => CLIP_UNORM8,
    }
}

/// Returns 1 − AO of `T_clip`, the factor that a renderer multiplies ambient light by, in a quarter
/// of the memory of [`clip_texels`]. [`ClipTable::SIZE`] texels, x fastest, tightly packed,
/// little-endian; one channel (`r16float` or `r8unorm`).
pub fn transmittance_texels(format: Format) -> Vec<u8> {
    let transmittance = |[occlusion, _, _]: [f32; 3]| 1.0 - occlusion;
    format.encode(clip_master().into_iter().map(transmittance))
}

/// Returns the texels of `T_merge` to upload: [`MergeTable::SIZE`] of them, x fastest, tightly
/// packed, little-endian. One channel, the union.
#[inline]
pub fn merge_texels(format: Format) -> &'static [u8] {
    match format {
        Format::F16 => MERGE_F16,
        Format::Unorm8 => MERGE_UNORM8,
    }
}

/// Returns the intersection I(a1, a2, γ) = a1 + a2 − `T_merge`, the fraction that both cones cover.
/// A renderer that keeps a running sum of fractions subtracts it. [`MergeTable::SIZE`] texels, x
/// fastest, tightly packed, little-endian; one channel (`r16float` or `r8unorm`).
///
/// The renderer then adds a1 + a2, the part of the union that is linear, at full precision, without
/// the rounding of the texture and the few bits of its filter: merging a cone with an empty one
/// leaves it exactly unchanged.
pub fn intersection_texels(format: Format) -> Vec<u8> {
    format.encode(MergeTable::committed().intersections())
}

/// A file of `tables/src/generated`, with the contents that it should have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GeneratedFile {
    /// The name in that folder.
    pub name: &'static str,
    /// The whole contents.
    pub bytes: Vec<u8>,
}

/// Returns the files that hold these tables, to write them or to compare them with the committed
/// ones.
pub fn generated_files(clip: &ClipTable, merge: &MergeTable) -> Vec<GeneratedFile> {
    let [clip_width, clip_height] = clip.size();
    let clip_table = format!("T_clip {clip_width}x{clip_height}");
    let [width, height, depth] = merge.size();
    let merge_table = format!("T_merge {width}x{height}x{depth}");
    vec![
        file("t_clip.f32", &clip_table, little_endian(clip.master())),
        file("t_clip.rgba16float", &clip_table, clip.encode(Format::F16)),
        file(
            "t_clip.rgba8unorm",
            &clip_table,
            clip.encode(Format::Unorm8),
        ),
        file("t_merge.f32", &merge_table, little_endian(merge.master())),
        file("t_merge.r16float", &merge_table, merge.encode(Format::F16)),
        file(
            "t_merge.r8unorm",
            &merge_table,
            merge.encode(Format::Unorm8),
        ),
    ]
}

fn file(name: &'static str, table: &str, texels: Vec<u8>) -> GeneratedFile {
    let header = format!("aogrid {table}, made by `cargo xtask tables`: do not edit\n");
    GeneratedFile {
        name,
        bytes: [header.into_bytes(), texels].concat(),
    }
}

fn little_endian<const C: usize>(master: &[[f32; C]]) -> Vec<u8> {
    master
        .as_flattened()
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
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
