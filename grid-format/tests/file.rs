//! Tests of the grid file through the public interface: frozen bytes, and every kind of malformed
//! file.

use std::path::{Path, PathBuf};

use aogrid_grid_format::{
    BakeRecord, Boundary, BoundaryMode, Encoding, Grid, GridSpec, Interior, ReadError, Sampling,
    Source, TexelFormat,
};
use proptest::prelude::*;

/// Offsets in the KTX2 header (KTX 2.0 specification, section 3).
mod at {
    pub const FORMAT: usize = 12;
    pub const TYPE_SIZE: usize = 16;
    pub const WIDTH: usize = 20;
    pub const DEPTH: usize = 28;
    pub const LAYERS: usize = 32;
    pub const FACES: usize = 36;
    pub const LEVELS: usize = 40;
    pub const SCHEME: usize = 44;
    pub const DFD_OFFSET: usize = 48;
    pub const DFD_LENGTH: usize = 52;
    pub const KVD_OFFSET: usize = 56;
    pub const KVD_LENGTH: usize = 60;
    pub const SGD_OFFSET: usize = 64;
    pub const SGD_LENGTH: usize = 72;
    pub const LEVEL_OFFSET: usize = 80;
    pub const LEVEL_LENGTH: usize = 88;
    pub const LEVEL_UNCOMPRESSED: usize = 96;
    pub const DFD: usize = 104;
}

fn record() -> BakeRecord {
    BakeRecord {
        epsilon: Some(0.1),
        sample_offset: [3.1e-4, -1.7e-4, 4.3e-4],
        sampling: Sampling::CubeFaces { size: 16 },
        max_distance: None,
        interior: Interior::Enclosed,
        interior_cells: 12,
        inside: None,
        boundary: Boundary {
            requested: BoundaryMode::Jgt,
            applied: BoundaryMode::Rr,
            v_m: 0.375,
        },
        source: Source {
            name: "tést \"quoted\".obj".into(),
            part: Some("arm left".into()),
            blake3: "0123456789abcdef".repeat(4),
            triangles: 1234,
        },
    }
}

/// Cell values that cover their whole ranges. They must never change: the frozen files hold them.
fn cells(spec: &GridSpec) -> Vec<[f32; 4]> {
    (0..spec.cell_count())
        .map(|idx| {
            let step = |k: usize, n: usize| ((idx * k) % n) as f32 / (n - 1) as f32;
            let d = [step(1, 17), step(3, 19), step(5, 23)].map(|v| 2.0 * v - 1.0);
            [d[0], d[1], d[2], step(7, 29)]
        })
        .collect()
}

fn grid(encoding: Encoding, format: TexelFormat) -> Grid {
    let spec = GridSpec::new([9, 8, 11], [0.5, -1.25, 3.0], [1.5, 2.0, 0.1]).unwrap();
    Grid::encode(spec, encoding, format, &cells(&spec), record()).unwrap()
}

fn kinds() -> impl Iterator<Item = (Encoding, TexelFormat)> {
    Encoding::ALL
        .into_iter()
        .flat_map(|encoding| TexelFormat::ALL.map(|format| (encoding, format)))
}

/// The bytes of the smallest file, so that tests over every byte are quick.
fn small() -> Vec<u8> {
    let spec = GridSpec::new([8; 3], [0.0; 3], [1.0; 3]).unwrap();
    let format = TexelFormat::Unorm8;
    let grid = Grid::encode(spec, Encoding::Occlusion, format, &cells(&spec), record());
    grid.unwrap().to_bytes()
}

fn golden(encoding: Encoding, format: TexelFormat) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    folder.join(format!("v1-{}-{}.ao.ktx2", encoding.name(), format.name()))
}

/// Files of profile version 1.0 as aogrid 0.1.0 wrote them. They must never be regenerated: a
/// failure means that old files are no longer read as before.
#[test]
fn frozen_files_are_still_read_alike() {
    for (encoding, format) in kinds() {
        let bytes = std::fs::read(golden(encoding, format)).unwrap();
        let read = Grid::from_bytes(&bytes).unwrap();
        assert_eq!(read.to_bytes(), bytes, "{encoding:?} {format:?}");
        let now = grid(encoding, format);
        assert_eq!(read.record(), now.record());
        assert_eq!(read.spec(), now.spec());
        assert_eq!(read.statistics(), now.statistics());
        assert_eq!(read.texels(), now.texels());
        assert_eq!(read.writer(), "aogrid 0.1.0");
    }
}

/// New files differ from the frozen ones in the writer's version alone.
#[test]
fn written_files_match_the_frozen_ones() {
    for (encoding, format) in kinds() {
        let frozen = std::fs::read(golden(encoding, format)).unwrap();
        let old = "aogrid 0.1.0";
        let new = Grid::current_writer();
        if new.len() == old.len() {
            let at = find(&frozen, old.as_bytes());
            let mut expected = frozen;
            expected[at..at + old.len()].copy_from_slice(new.as_bytes());
            assert_eq!(grid(encoding, format).to_bytes(), expected);
        } else {
            // Offsets move with the name's length. The test above compares what is read.
            assert_ne!(grid(encoding, format).to_bytes(), frozen);
        }
    }
}

fn find(bytes: &[u8], needle: &[u8]) -> usize {
    let mut windows = bytes.windows(needle.len());
    let found = windows.position(|w| w == needle);
    found.expect("the bytes contain the needle")
}

#[test]
fn written_grids_are_read_back_within_the_error_bounds() {
    for (encoding, format) in kinds() {
        let grid = grid(encoding, format);
        let read = Grid::from_bytes(&grid.to_bytes()).unwrap();
        assert_eq!(read, grid);
        let [max_a, max_d] = encoding.max_error(format);
        for (idx, cell) in cells(grid.spec()).into_iter().enumerate() {
            let found = read.cone(idx);
            let rounding = 2.0 * f32::EPSILON;
            assert!((found[3] - cell[3]).abs() <= max_a + rounding);
            for x in 0..3 {
                let expected = if encoding.has_direction() {
                    cell[x]
                } else {
                    0.0
                };
                assert!((found[x] - expected).abs() <= max_d + rounding);
            }
        }
    }
}

#[test]
fn encoding_refuses_values_out_of_range() {
    let spec = GridSpec::new([8; 3], [0.0; 3], [1.0; 3]).unwrap();
    let encode = |change: &dyn Fn(&mut Vec<[f32; 4]>)| {
        let mut cells = vec![[0.0; 4]; 512];
        change(&mut cells);
        let format = TexelFormat::F32;
        Grid::encode(spec, Encoding::Cone, format, &cells, record())
    };
    assert!(encode(&|_| ()).is_ok());
    assert!(encode(&|cells| cells.truncate(511)).is_err());
    for (channel, value) in [
        (3, 1.01),
        (3, -0.01),
        (3, f32::NAN),
        (0, 1.01),
        (2, f32::NAN),
    ] {
        let error = encode(&|cells| cells[77][channel] = value).unwrap_err();
        assert!(error.to_string().contains("[5, 1, 1]"), "{error}");
    }
}

#[test]
fn every_truncated_length_is_an_error() {
    let bytes = small();
    for length in 0..bytes.len() {
        let error = Grid::from_bytes(&bytes[..length]).unwrap_err();
        let truncated = matches!(error, ReadError::Truncated { len, .. } if len == length as u64);
        assert!(truncated, "{length}: {error}");
    }
}

#[test]
fn extra_bytes_are_an_error() {
    let mut bytes = small();
    for extra in 1..=9 {
        bytes.push(0);
        let error = Grid::from_bytes(&bytes).unwrap_err();
        assert!(matches!(error, ReadError::TrailingBytes(n) if n == extra));
    }
}

/// Returns the error of reading a valid file with `value` written at `offset`.
fn with_u32(offset: usize, value: u32) -> ReadError {
    let mut bytes = small();
    bytes[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
    Grid::from_bytes(&bytes).unwrap_err()
}

#[test]
fn other_kinds_of_files_are_identified_in_the_error() {
    assert!(matches!(with_u32(0, 0), ReadError::NotKtx2));
    // "«KTX 11»", KTX version 1.
    assert!(matches!(
        with_u32(4, u32::from_le_bytes(*b" 11\xBB")),
        ReadError::NotKtx2
    ));
    assert!(matches!(
        Grid::from_bytes(b"# Wavefront OBJ"),
        Err(ReadError::NotKtx2)
    ));
    let not_a_grid = |offset, value| match with_u32(offset, value) {
        ReadError::NotAGrid(reason) => reason,
        other => panic!("{offset} {value}: {other}"),
    };
    // VK_FORMAT_R8_SRGB, undefined, unknown.
    assert!(not_a_grid(at::FORMAT, 15).contains("R8_SRGB"));
    assert!(not_a_grid(at::FORMAT, 0).contains("undefined"));
    not_a_grid(at::FORMAT, u32::MAX);
    assert!(not_a_grid(at::DEPTH, 0).contains("3D"));
    for (offset, value) in [
        (at::TYPE_SIZE, 2),
        (at::WIDTH, 0),
        (at::LAYERS, 1),
        (at::FACES, 0),
        (at::FACES, 6),
        (at::LEVELS, 0),
        (at::LEVELS, 2),
        (at::LEVELS, u32::MAX),
        (at::SCHEME, 2),
        (at::SCHEME, 77),
        (at::DFD, 0),
        // Texel block dimensions of 256: adding 1 in a byte would overflow to 0.
        (at::DFD + 16, u32::MAX),
    ] {
        not_a_grid(offset, value);
    }
}

#[test]
fn wrong_lengths_and_offsets_are_errors() {
    let offsets = [
        at::DFD_OFFSET,
        at::DFD_LENGTH,
        at::KVD_OFFSET,
        at::KVD_LENGTH,
        at::SGD_OFFSET,
        at::SGD_OFFSET + 4,
        at::SGD_LENGTH,
        at::SGD_LENGTH + 4,
        at::LEVEL_OFFSET,
        at::LEVEL_OFFSET + 4,
        at::LEVEL_LENGTH,
        at::LEVEL_LENGTH + 4,
        at::LEVEL_UNCOMPRESSED,
        at::LEVEL_UNCOMPRESSED + 4,
        at::WIDTH,
        at::DEPTH,
    ];
    let good = small();
    for offset in offsets {
        let bytes = good[offset..offset + 4].try_into().unwrap();
        let correct = u32::from_le_bytes(bytes);
        let wrong = [
            0,
            1,
            8,
            correct.wrapping_add(1),
            correct.wrapping_sub(1),
            correct ^ 4,
        ];
        let wrong = wrong.into_iter().chain([1 << 31, u32::MAX, u32::MAX - 3]);
        for value in wrong.filter(|value| *value != correct) {
            with_u32(offset, value);
        }
    }
}

#[test]
fn oversized_dimensions_are_errors_before_anything_is_allocated() {
    for offset in [at::WIDTH, at::DEPTH] {
        for size in [2049, 1 << 20, u32::MAX] {
            let error = with_u32(offset, size);
            assert!(matches!(error, ReadError::Spec(_)), "{error}");
        }
    }
    // Each axis is valid by itself, but there are too many cells in all.
    let mut bytes = small();
    for axis in 0..3 {
        bytes[at::WIDTH + 4 * axis..][..4].copy_from_slice(&2048_u32.to_le_bytes());
    }
    assert!(matches!(Grid::from_bytes(&bytes), Err(ReadError::Spec(_))));
}

/// Reads a valid file whose metadata is replaced by `json`, with all lengths adjusted.
fn with_json(json: &str) -> Result<Grid, ReadError> {
    let good = small();
    let number = |offset: usize| {
        let bytes = good[offset..offset + 4].try_into().unwrap();
        u32::from_le_bytes(bytes) as usize
    };
    let (kvd, kvd_length) = (number(at::KVD_OFFSET), number(at::KVD_LENGTH));
    let key = find(&good, b"aogrid\0");
    let mut pairs = good[kvd..key - 4].to_vec();
    let pair = ["aogrid\0", json, "\0"].concat();
    pairs.extend((pair.len() as u32).to_le_bytes());
    pairs.extend(pair.as_bytes());
    pairs.resize(pairs.len().next_multiple_of(4), 0);

    let mut bytes = good[..kvd].to_vec();
    bytes.extend(&pairs);
    let level = bytes.len() as u32;
    bytes.extend(&good[kvd + kvd_length..]);
    bytes[at::KVD_LENGTH..][..4].copy_from_slice(&(pairs.len() as u32).to_le_bytes());
    bytes[at::LEVEL_OFFSET..][..4].copy_from_slice(&level.to_le_bytes());
    Grid::from_bytes(&bytes)
}

fn good_json() -> String {
    let good = small();
    let start = find(&good, b"aogrid\0") + "aogrid\0".len();
    let length = good[start..].iter().position(|&b| b == 0).unwrap();
    String::from_utf8(good[start..start + length].to_vec()).unwrap()
}

#[test]
fn metadata_is_checked() {
    let good = good_json();
    assert!(with_json(&good).is_ok());
    // Each replacement must change the JSON, or nothing here is tested.
    let changed = |from: &str, to: &str| {
        assert!(good.contains(from), "{from} is not in {good}");
        with_json(&good.replacen(from, to, 1)).unwrap_err()
    };
    for broken in [
        "",
        "{",
        "null",
        "[]",
        "{}",
        "\u{FEFF}{}",
        &"[".repeat(100_000),
    ] {
        let error = with_json(broken).unwrap_err();
        assert!(matches!(error, ReadError::Metadata(_)), "{error}");
    }
    let newer = changed(r#""version":"1.0""#, r#""version":"2.0""#);
    assert!(matches!(newer, ReadError::NewerVersion(2)));
    assert!(newer.to_string().contains("update aogrid"), "{newer}");
    for version in ["", "1", "x.y", "0.9", "-1.0"] {
        let error = changed(r#""version":"1.0""#, &format!(r#""version":"{version}""#));
        assert!(
            matches!(error, ReadError::MetadataRange("version")),
            "{error}"
        );
    }
    let unknown = changed(r#""encoding":"occlusion""#, r#""encoding":"sh9""#);
    assert!(matches!(unknown, ReadError::UnknownEncoding(name) if name == "sh9"));
    let cone = changed(r#""encoding":"occlusion""#, r#""encoding":"cone""#);
    assert!(matches!(
        cone,
        ReadError::Channels {
            expected: 4,
            found: 1,
            ..
        }
    ));
    let flat = changed(r#""half_extents":[1.0"#, r#""half_extents":[0.0"#);
    assert!(matches!(flat, ReadError::Spec(_)));
    let infinite = changed(r#""center":[0.0"#, r#""center":[1e999"#);
    assert!(matches!(
        infinite,
        ReadError::Metadata(_) | ReadError::Spec(_)
    ));
    for (from, to, name) in [
        (r#""size":16"#, r#""size":4294967295"#, "method"),
        (r#""size":16"#, r#""size":0"#, "method"),
        (r#""epsilon":0.1"#, r#""epsilon":-1"#, "epsilon"),
        (r#""v_m":0.375"#, r#""v_m":1.5"#, "boundary"),
        (
            r#""max_distance":null"#,
            r#""max_distance":0"#,
            "max_distance",
        ),
        (
            r#""sample_offset":[0.00031"#,
            r#""sample_offset":[3.1"#,
            "sample_offset",
        ),
        (r#""largest":1.0"#, r#""largest":1.1"#, "largest"),
    ] {
        let error = changed(from, to);
        assert!(
            matches!(error, ReadError::MetadataRange(found) if found == name),
            "{error}"
        );
    }
}

#[test]
fn newer_minor_versions_may_add_json_keys() {
    let good = good_json();
    let more = good.replacen(r#""version":"1.0""#, r#""version":"1.7","color":"red""#, 1);
    let grid = with_json(&more.replacen(r#""bake":{"#, r#""bake":{"phase":3,"#, 1)).unwrap();
    assert_eq!(grid.record(), &record());
}

#[test]
fn files_without_aogrid_metadata_are_identified_in_the_error() {
    let mut bytes = small();
    let key = find(&bytes, b"aogrid\0");
    bytes[key] = b'x';
    let error = Grid::from_bytes(&bytes).unwrap_err();
    assert!(matches!(error, ReadError::NoMetadata), "{error}");
    assert!(matches!(with_u32(at::KVD_LENGTH, 0), ReadError::NoMetadata));
}

#[test]
fn texels_out_of_range_are_errors() {
    let good = grid(Encoding::Cone, TexelFormat::F32).to_bytes();
    let last = good.len() - 4;
    for value in [f32::NAN, f32::INFINITY, -0.5, 1.5] {
        let mut bytes = good.clone();
        bytes[last..].copy_from_slice(&value.to_le_bytes());
        let error = Grid::from_bytes(&bytes).unwrap_err();
        assert!(matches!(error, ReadError::Texel([8, 7, 10])), "{error}");
    }
    // Byte 0 of a direction decodes to −128/127.
    let mut bytes = grid(Encoding::Cone, TexelFormat::Unorm8).to_bytes();
    let last = bytes.len() - 4;
    bytes[last] = 0;
    assert!(matches!(Grid::from_bytes(&bytes), Err(ReadError::Texel(_))));
}

proptest! {
    /// Reading returns a grid or an error for any changed bytes, and a grid can be written again.
    #[test]
    fn flipped_bytes_never_panic(
        flips in prop::collection::vec((0_usize..2000, any::<u8>()), 1..6),
        kind in 0_usize..6,
    ) {
        let (encoding, format) = kinds().nth(kind).unwrap();
        let mut bytes = grid(encoding, format).to_bytes();
        let length = bytes.len();
        for (at, mask) in flips {
            bytes[at % length] ^= mask;
        }
        let _ = Grid::from_bytes(&bytes).map(|grid| grid.to_bytes());
    }

    #[test]
    fn random_bytes_behind_the_identifier_never_panic(
        tail in prop::collection::vec(any::<u8>(), 0..400),
    ) {
        let bytes = [&small()[..12], &tail].concat();
        prop_assert!(Grid::from_bytes(&bytes).is_err());
    }
}
