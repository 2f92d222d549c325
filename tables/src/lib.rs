//! The tables `T_clip` and `T_merge`, with which a renderer clips an occlusion cone by a
//! receiver's tangent plane and unites two cones (RR-5779, section 5; JGT supplement).

mod cap;
pub mod clip;
pub mod merge;
mod quadrature;
mod real;

pub use clip::Clip;
pub use real::Real;
