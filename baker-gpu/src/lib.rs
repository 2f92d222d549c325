//! Bakes ambient-occlusion grids with wgpu compute.
mod context;
mod error;
mod kernel;
#[cfg(test)]
mod layout_test;
mod pace;
mod shaders;
mod store;
mod sweep;
mod work;

pub use context::{Choice, Context, ContextError, adapters};
pub use error::BakeError;
pub use shaders::{Shader, shaders};
pub use sweep::{Sweeper, Uploaded};
pub use wgpu;
