//! The tables `T_clip` and `T_merge`, with which a renderer clips an occlusion cone by a
//! receiver's tangent plane and unites two cones (RR-5779, section 5; JGT supplement).

mod cap;
pub mod clip;
mod format;
mod generated;
pub mod merge;
mod quadrature;
mod real;
mod table;
mod texture;

pub use clip::Clip;
pub use format::Format;
pub use generated::{GeneratedFile, clip_texels, generated_files, merge_texels};
pub use real::Real;
pub use table::{ClipRow, ClipTable, MergeRow, MergeTable};
pub use texture::texture_coordinate;
