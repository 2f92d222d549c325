//! Tests of the grid file through the public interface.

/// Every changed or cut file gives a grid or an error.
mod broken;
/// The specification in the documents.
mod document;
/// Frozen bytes, and what is written is read back.
mod frozen;
/// Headers, offsets and lengths of other kinds of files.
mod header;
/// The metadata's version, names and ranges.
mod metadata;
/// Levels that other tools have supercompressed.
mod packed;

use std::path::{Path, PathBuf};

use aogrid_grid_format::{
    BakeRecord, Boundary, BoundaryMode, Encoding, Grid, GridSpec, Interior, ReadError, Sampling,
    Source, TexelFormat,
};

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
        snap: false,
        fit: false,
        without: vec![],
        self_offset: 0.0,
        flatness: [0.0; 4],
        check: None,
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

fn find(bytes: &[u8], needle: &[u8]) -> usize {
    let mut windows = bytes.windows(needle.len());
    let found = windows.position(|w| w == needle);
    found.expect("the bytes contain the needle")
}

/// Returns the error of reading a valid file with `value` written at `offset`.
fn with_u32(offset: usize, value: u32) -> ReadError {
    let mut bytes = small();
    bytes[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
    Grid::from_bytes(&bytes).unwrap_err()
}
