//! The files that hold the tables.
//!
//! Each is one line of text, which names the table and its generator, followed by the raw texels.

use crate::format::Format;
use crate::table::{ClipTable, MergeTable};

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
