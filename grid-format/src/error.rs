//! What can be wrong with a grid, on the way in and on the way out.

use crate::layout::PROFILE_MAJOR;
use crate::{MAX_CELLS, MAX_RESOLUTION, MIN_RESOLUTION};

/// Why numbers do not describe a grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpecError {
    /// Too few or too many cells along one axis.
    #[error("resolution {0} is outside {MIN_RESOLUTION}..={MAX_RESOLUTION} cells an axis")]
    Resolution(u32),
    /// Too many cells in all.
    #[error("{} × {} × {} cells are more than the {MAX_CELLS} a grid may have", .0[0], .0[1], .0[2])]
    TooManyCells([u32; 3]),
    /// The box reaches beyond what a float holds.
    #[error("the box is not finite along {0}")]
    NotFinite(&'static str),
    /// The box has no size along an axis.
    #[error("half-extent {1} along {0} is not above zero")]
    HalfExtent(&'static str, f32),
}

/// Why cells could not be encoded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// Not one cell for each of the spec's.
    #[error("{found} cells were given for a grid of {expected}")]
    CellCount {
        /// How many the spec has.
        expected: usize,
        /// How many came.
        found: usize,
    },
    /// A value outside its range, or not a number.
    #[error("cell {cell:?} holds {value:?}, not an occlusion in 0..=1 and an axis in -1..=1")]
    Value {
        /// The cell (i, j, k).
        cell: [u32; 3],
        /// Its (dx, dy, dz, a).
        value: [f32; 4],
    },
}

/// Why bytes are not a grid file of this profile.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The first 12 bytes are not those of KTX2.
    #[error("not a KTX2 file: the first 12 bytes are not its identifier")]
    NotKtx2,
    /// The file ends before something that it announces.
    #[error("the file ends at byte {len}, before the end of {what} at byte {end}")]
    Truncated {
        /// The part that is cut.
        what: &'static str,
        /// Where that part should end.
        end: u64,
        /// The file's length.
        len: u64,
    },
    /// Bytes after the last part.
    #[error("{0} bytes follow the end of the texture")]
    TrailingBytes(u64),
    /// A part is not where KTX2 puts it.
    #[error("{what} should start at byte {expected}, not {found}")]
    Misplaced {
        /// The part.
        what: &'static str,
        /// Where KTX2 puts it.
        expected: u64,
        /// Where the file puts it.
        found: u64,
    },
    /// KTX2, but not a plain 3D texture of one level in one of the profile's formats.
    #[error("a KTX2 file, but not an ambient-occlusion grid: {0}")]
    NotAGrid(String),
    /// The texture's size and the bytes of its level disagree.
    #[error("the level holds {found} bytes where its size and format ask for {expected}")]
    LevelLength {
        /// What the size and format ask for.
        expected: u64,
        /// What the file says.
        found: u64,
    },
    /// The key/value section is not well formed.
    #[error("the key/value data is malformed: {0}")]
    KeyValue(&'static str),
    /// No metadata under the profile's key.
    #[error(
        "a 3D texture without `aogrid` metadata: not baked by aogrid, or stripped by another tool"
    )]
    NoMetadata,
    /// The metadata is not the JSON it should be.
    #[error("the `aogrid` metadata is not readable")]
    Metadata(#[source] serde_json::Error),
    /// A profile that is newer than this reader.
    #[error(
        "grid profile version {0} is newer than {PROFILE_MAJOR}, the newest this reader knows: update aogrid"
    )]
    NewerVersion(u32),
    /// An encoding that is newer than this reader, or misspelt.
    #[error("encoding `{0}` is unknown to this reader: update aogrid")]
    UnknownEncoding(String),
    /// The encoding and the texture format have different channel counts.
    #[error("encoding `{encoding}` needs {expected} channels; the texture has {found}")]
    Channels {
        /// The encoding's name.
        encoding: &'static str,
        /// How many channels it has.
        expected: usize,
        /// How many the texture has.
        found: usize,
    },
    /// The metadata's box is none.
    #[error("the grid's box is impossible")]
    Spec(#[from] SpecError),
    /// A metadata number is out of its range.
    #[error("metadata `{0}` is out of range")]
    MetadataRange(&'static str),
    /// A texel that no baker writes.
    #[error("the texel of cell {0:?} is not an occlusion in 0..=1 with an axis in -1..=1")]
    Texel([u32; 3]),
}
