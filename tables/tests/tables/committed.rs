use aogrid_tables::{ClipTable, Format, MergeTable, clip_texels, generated_files, merge_texels};
use std::path::Path;

/// One step of the master. On another platform, whose sines differ, an entry may be rounded to the
/// neighboring step, about once in a hundred million entries.
const MASTER_STEP: f32 = 1.0 / (1 << 24) as f32;

const REGENERATE: &str = "run `cargo xtask tables`, and review what changes";

#[test]
fn integration_reproduces_the_committed_clip_table() {
    let committed = ClipTable::committed().node_array();
    assert_same(
        &committed,
        &ClipTable::generate(ClipTable::SIZE).node_array(),
    );
}

#[test]
fn integration_reproduces_the_committed_merge_table() {
    let committed = MergeTable::committed().node_array();
    assert_same(
        &committed,
        &MergeTable::generate(MergeTable::SIZE).node_array(),
    );
}

fn assert_same(committed: &([usize; 3], Vec<f32>), fresh: &([usize; 3], Vec<f32>)) {
    assert_eq!(committed.0, fresh.0);
    let pairs = committed.1.iter().zip(&fresh.1);
    let different = pairs
        .filter(|(old, new)| (*old - *new).abs() > MASTER_STEP)
        .count();
    assert_eq!(different, 0, "entries differ: {REGENERATE}");
}

#[test]
fn the_committed_files_match_the_generator() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/generated");
    let files = generated_files(&ClipTable::committed(), &MergeTable::committed());
    for file in &files {
        let committed = std::fs::read(folder.join(file.name)).unwrap();
        assert!(
            committed == file.bytes,
            "{} differs: {REGENERATE}",
            file.name
        );
        assert!(
            committed.len() < 1 << 20,
            "{} is too large to review",
            file.name
        );
    }
    let others = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name());
    let others = others.filter(|name| files.iter().all(|file| name != file.name));
    assert_eq!(others.collect::<Vec<_>>(), Vec::<std::ffi::OsString>::new());
}

#[test]
fn every_file_names_its_generator_on_the_first_line() {
    for file in generated_files(&ClipTable::committed(), &MergeTable::committed()) {
        let first_line = file.bytes.split(|&byte| byte == b'\n').next().unwrap();
        let first_line = std::str::from_utf8(first_line).unwrap();
        assert!(
            first_line.contains("made by `cargo xtask tables`"),
            "{first_line}"
        );
    }
}

/// Checks the corners that distinguish the axes: zero at a = 0, one at a = 1.
#[test]
fn uploaded_texels_have_the_fraction_along_x() {
    let [width, height] = ClipTable::SIZE;
    let unorm8 = clip_texels(Format::Unorm8);
    assert_eq!(unorm8.len(), 4 * width * height);
    let occlusion = |x, y| unorm8[4 * (x + width * y)];
    assert!((0..height).all(|y| occlusion(0, y) == 0 && occlusion(width - 1, y) == 255));
    assert!(unorm8.chunks_exact(4).all(|texel| texel[3] == 255));

    let [width, height, depth] = MergeTable::SIZE;
    let unorm8 = merge_texels(Format::Unorm8);
    assert_eq!(unorm8.len(), width * height * depth);
    let union = |x, y, z| unorm8[x + width * (y + height * z)];
    assert_eq!([union(0, 0, 0), union(0, 0, depth - 1)], [0, 0]);
    assert_eq!(
        [union(width - 1, 0, 0), union(0, height - 1, 0)],
        [255, 255]
    );
    assert_eq!([union(24, 24, 0), union(24, 24, depth - 1)], [130, 255]);
}

#[test]
fn uploaded_texels_are_the_master_in_another_format() {
    let (clip, merge) = (ClipTable::committed(), MergeTable::committed());
    let f16 = |bytes: &[u8]| half::f16::from_le_bytes([bytes[0], bytes[1]]).to_f32();
    let (clip_f16, merge_f16) = (clip.quantized(Format::F16), merge.quantized(Format::F16));
    for (x, y) in [(0, 0), (63, 0), (17, 40), (40, 17)] {
        let texel = &clip_texels(Format::F16)[8 * (x + 64 * y)..][..8];
        let entry = clip_f16.node(x, y);
        let channels = [entry.occlusion, entry.fraction, entry.axis_weight, 1.0];
        assert_eq!(
            [
                f16(texel),
                f16(&texel[2..]),
                f16(&texel[4..]),
                f16(&texel[6..])
            ],
            channels
        );
    }
    for (x, y, z) in [(0, 0, 0), (47, 0, 0), (5, 20, 30), (30, 7, 11)] {
        let texel = &merge_texels(Format::F16)[2 * (x + 48 * (y + 48 * z))..];
        assert_eq!(f16(texel), merge_f16.node(x, y, z));
    }
}
