//! Bakes ambient-occlusion grids with wgpu compute: the same faces, moments and integer counts
//! as the CPU baker, from the same prepared mesh and options.
//!
//! ```no_run
//! use aogrid_bake_core::{BakeOptions, Placement, UNOBSERVED, samples::Sample};
//! use aogrid_baker_gpu::{Baker, Choice, Context};
//! let context = Context::new(&Choice::Real)?;
//! let mesh = Sample::Table.mesh(None)?;
//! let spec = Placement::default().place(&mesh.bounds())?;
//! let options = BakeOptions::recommended();
//! let raw = Baker::new(&context, None)
//!     .prepare(&mesh, spec, &options)?
//!     .bake(UNOBSERVED)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Theory
//!
//! RR-5779, 6.1 renders six faces of 16×16 pixels around each cell on the GPU, one cell after
//! the other, and reads them back or reduces them there, with directions or without. Compute
//! shaders need not draw. The *direction sweep* finds what lies ahead of whole rows of cells,
//! one direction at a time, and costs far less than its triangles are many; rays over a tree
//! take what it cannot: a maximum distance, random directions, huge soups. Both reduce on the
//! GPU, to integers that no order changes; read back are five numbers a cell. A kernel that
//! asks every triangle about every texel says what all of them compute.
//!
//! # Practice
//!
//! A [`Context`] holds a device: the caller's own ([`Context::from_device`]) or one on an
//! adapter that it chooses. A [`Baker`] kept warm bakes again and again and says which kernel
//! it uses; below it are a [`Sweeper`] and a [`Caster`], which also give the faces' bits. All
//! run within WebGPU's default limits and use larger buffers where the device has them.
//!
//! Work is cut into submissions of some hundredths of a second, by measurement, so that no
//! driver's watchdog fires; between them the observer is told and may cancel. Whatever the
//! device does ([`BakeError`]), a bake returns. WGSL lies beside what dispatches it; its
//! constants come from Rust, and [`shaders()`] lists the sources in full.

mod baker;
mod context;
mod error;
mod kernel;
#[cfg(test)]
mod layout_test;
mod pace;
mod rays;
mod shaders;
mod store;
mod sweep;
mod work;

pub use aogrid_bake_core::{Kernel, WhyRays};
pub use baker::{Baker, Prepared};
pub use context::{Choice, Context, ContextError, adapters};
pub use error::BakeError;
pub use rays::{Caster, UploadedTree};
pub use shaders::{Shader, shaders};
pub use sweep::{Sweeper, UploadedMesh};
pub use wgpu;
