//! What tests, examples and benches need of a GPU: a device, textures, uploads and read-back. It is
//! below all other crates and knows nothing of occlusion.
//!
//! Tests that need an adapter or a display skip with a note on machines without one. With
//! `AOGRID_GPU=require` that is a failure; this crate is the only place that reads the variable.

mod depth;
mod device;
mod picture;
mod textures;

pub use device::{Gpu, gpu, gpu_with, gpu_with_limits, skip};
pub use picture::{brightness, color, picture};
pub use textures::{attachment, read_only_depth};
