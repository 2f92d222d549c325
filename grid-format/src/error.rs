//! The errors of encoding and reading a grid.

use crate::SpecError;
use crate::ktx2::PROFILE_MAJOR;

/// The reason that cells could not be encoded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// The number of cells is not that of the spec.
    #[error("{found} cells were given for a grid of {expected} cells")]
    CellCount {
        /// Number of cells of the spec.
        expected: usize,
        /// Number of cells given.
        found: usize,
    },
    /// A value is outside its range, or not a number.
    #[error("cell {cell:?} holds {value:?}: the axis must be in -1..=1 and the occlusion in 0..=1")]
    Value {
        /// The cell (i, j, k).
        cell: [u32; 3],
        /// Its (dx, dy, dz, a).
        value: [f32; 4],
    },
}

/// The reason that bytes are not a grid file of this profile.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The first 12 bytes are not those of KTX2.
    #[error("not a KTX2 file: the first 12 bytes are not the KTX2 identifier")]
    NotKtx2,
    /// The file ends before the end of a part that it declares.
    #[error("the file ends at byte {len}, before the end of {what} at byte {end}")]
    Truncated {
        /// The truncated part.
        what: &'static str,
        /// Offset at which that part should end.
        end: u64,
        /// The file's length.
        len: u64,
    },
    /// Bytes follow the last part.
    #[error("{0} bytes follow the end of the texture")]
    TrailingBytes(u64),
    /// A part does not start at the offset that KTX2 requires.
    #[error("{what} should start at byte {expected}, not {found}")]
    Misplaced {
        /// The part.
        what: &'static str,
        /// Offset that KTX2 requires.
        expected: u64,
        /// Offset that the file gives.
        found: u64,
    },
    /// The file is KTX2, but not a plain 3D texture of one level in a format of the profile.
    #[error("a KTX2 file, but not an ambient-occlusion grid: {0}")]
    NotAGrid(String),
    /// The texture's size and the bytes of its level disagree.
    #[error("the level holds {found} bytes, but its size and format require {expected}")]
    LevelLength {
        /// Number of bytes that the size and format require.
        expected: u64,
        /// Number of bytes that the file gives.
        found: u64,
    },
    /// The level's supercompressed data are malformed.
    #[error("the supercompressed level cannot be unpacked: {0}")]
    Packed(String),
    /// The key/value section is not well formed.
    #[error("the key/value data is malformed: {0}")]
    KeyValue(&'static str),
    /// There is no metadata under the profile's key.
    #[error(
        "a 3D texture without `aogrid` metadata: not baked by aogrid, or stripped by another tool"
    )]
    NoMetadata,
    /// The metadata is not valid JSON of the profile.
    #[error("the `aogrid` metadata cannot be parsed")]
    Metadata(#[source] serde_json::Error),
    /// The profile is newer than this reader.
    #[error(
        "grid profile version {0} is newer than {PROFILE_MAJOR}, the newest that this reader \
         supports: update aogrid"
    )]
    NewerVersion(u32),
    /// The encoding is newer than this reader, or misspelled.
    #[error("encoding `{0}` is unknown to this reader: update aogrid")]
    UnknownEncoding(String),
    /// The encoding and the texture format have different channel counts.
    #[error("encoding `{encoding}` needs {expected} channels; the texture has {found}")]
    Channels {
        /// The encoding's name.
        encoding: &'static str,
        /// Number of channels of the encoding.
        expected: usize,
        /// Number of channels of the texture.
        found: usize,
    },
    /// The metadata's box is invalid.
    #[error("the grid's box is invalid")]
    Spec(#[from] SpecError),
    /// A metadata number is out of its range.
    #[error("metadata `{0}` is out of range")]
    MetadataRange(&'static str),
    /// A texel holds values out of range, which no baker writes.
    #[error(
        "the texel of cell {0:?} is out of range: the axis must be in -1..=1 and the occlusion in \
         0..=1"
    )]
    Texel([u32; 3]),
}
