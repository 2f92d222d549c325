//! The ambient-occlusion grid file (`*.ao.ktx2`): a 3D texture that any KTX2 reader opens as
//! data, plus the metadata that a renderer needs to place and decode it.
//!
//! ```
//! use aogrid_grid_format::{Encoding, Grid, GridSpec, TexelFormat};
//! # use aogrid_grid_format::{BakeRecord, Boundary, BoundaryMode, Interior, Sampling, Source};
//! let spec = GridSpec::new([8, 8, 8], [0.0; 3], [1.5; 3])?;
//! // One (a, d) pair per cell, x fastest: here nothing is occluded anywhere.
//! let cells = vec![[0.0_f32; 4]; spec.cell_count()];
//! # let record = BakeRecord {
//! #     epsilon: Some(0.1), sample_offset: [0.0; 3], sampling: Sampling::CubeFaces { size: 16 },
//! #     max_distance: None, interior: Interior::Enclosed, interior_cells: 0, inside: None,
//! #     snap: false, fit: false, self_offset: 0.0, flatness: [0.0; 4], check: None, without: vec![],
//! #     boundary: Boundary { requested: BoundaryMode::None, applied: BoundaryMode::None, v_m: 0.0 },
//! #     source: Source { name: "nothing.obj".into(), part: None, blake3: "0".repeat(64), triangles: 1 },
//! # };
//! let grid = Grid::encode(spec, Encoding::Cone, TexelFormat::Unorm8, &cells, record)?;
//! let bytes = grid.to_bytes();
//! let same = Grid::from_bytes(&bytes)?;
//! assert_eq!(same.texels(), grid.texels()); // upload these as an Rgba8Unorm 3D texture
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Theory
//!
//! A cell stores the set of directions in which the object hides the sky as a cone (RR-5779,
//! section 5): `a`, the hidden fraction of the full sphere in 0..1 (RR-5779 eq. 5), and `d`,
//! the unit axis of the cone in object axes, from the cell toward the object. The file never
//! holds an angle. [`Encoding::Occlusion`] keeps `a` alone (RR-5779, section 4).
//! [`Encoding::Moment`] keeps the moment m of these directions instead of a cone's axis, as
//! v = m/(a(1 − a)): its length is 1 for a true cone and less where the directions are spread out,
//! also between cells whose axes disagree, where linear filtering shortens it.
//!
//! Differences from the paper: a direction's byte is `round(127 d) + 128`, so that the zero vector
//! of an open cell is exact; the printed remapping of −1..1 to 0..255 cannot represent zero.
//!
//! # Practice
//!
//! * [`GridSpec`]: the resolution and the box in object space. Validated once, on construction.
//! * [`Grid`]: a spec, encoded texels and the [`BakeRecord`].
//!   [`Grid::to_bytes`] and [`Grid::from_bytes`] are each other's inverse, bit for bit.
//! * [`Encoding`]: the meaning of a texel's channels, with all that depends on it.
//! * [`TexelFormat`]: 8-bit unorm, f16 or f32, each with its documented largest error.
//!
//! The crate depends on neither meshes nor a GPU.
//!
//! # The file
//!
//! A plain KTX2 3D texture, little-endian: `R8_UNORM`, `R16_SFLOAT` or `R32_SFLOAT` for
//! `occlusion`, the four-channel formats of the same kinds for `cone` and `moment`; layerCount
//! 0, faceCount 1, levelCount 1, no supercompression, never sRGB; readers accept zstd and zlib, which
//! other tools apply. Three key/value pairs, sorted by key, each
//! NUL-terminated and padded to 4 bytes: `KTXorientation` = `ruo` (x right, y up, z out of the
//! page), `KTXwriter`, and `aogrid`, a JSON object:
//!
//! | key | value |
//! |---|---|
//! | `version` | profile version `"major.minor"`; a reader refuses a newer major |
//! | `encoding` | `"occlusion"`, `"cone"` or `"moment"` |
//! | `center`, `half_extents` | the box, three numbers each, object units |
//! | `origin` | three numbers: the point in object space that `center` is relative to; absent if it is zero |
//! | `bake` | the [`BakeRecord`] |
//! | `mean`, `largest` | mean and maximum of the stored a over all cells |
//! | `texels_blake3` | BLAKE3 hash of the texels as they are uploaded, in hexadecimal; absent in files of aogrid 0.1.0 |
//!
//! It holds no time, machine, adapter or thread count: equal bakes give equal bytes.

mod bake_record;
mod encoding;
mod error;
mod grid;
mod ktx2;
mod spec;
mod texel_format;

pub use bake_record::{
    AreaError, BakeRecord, Boundary, BoundaryMode, Check, FACE_SIZES, FLATNESSES, Inside, Interior,
    MAX_FLATNESS, MAX_SELF_OFFSET, RAY_COUNTS, Sampling, Source,
};
pub use encoding::{Channel, Encoding};
pub use error::{EncodeError, ReadError};
pub use grid::{Grid, Statistics};
pub use spec::{GridSpec, MAX_CELLS, MAX_RESOLUTION, MIN_RESOLUTION, SpecError};
pub use texel_format::{ChannelRange, TexelFormat};
