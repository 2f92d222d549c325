//! Bakes ambient-occlusion grids on the CPU, on all cores: by the direction sweep, and by rays,
//! the reference that every faster way is checked against.
//!
//! ```
//! use aogrid_bake_core::{BakeOptions, Placement, UNOBSERVED, samples::Sample};
//! use aogrid_baker_cpu::bake;
//! let mesh = Sample::Table.mesh(None)?;
//! let spec = Placement { resolution: [8; 3], ..Placement::default() }.place(&mesh.bounds())?;
//! let raw = bake(&mesh, spec, &BakeOptions::recommended(), UNOBSERVED)?;
//! assert_eq!(raw.moments.len(), 512);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Theory
//!
//! Two ways to sample visibility: [`Method::Faces`](aogrid_grid_format::Method::Faces) tests
//! the centre of every texel of six cube faces and weights it by the texel's exact solid
//! angle; [`Method::Rays`](aogrid_grid_format::Method::Rays) tests uniformly random directions
//! (RR-5779, 6.1, the third method). Either way a direction is occluded if its ray meets a
//! triangle, from whichever side, at a distance above zero and up to the maximum.
//!
//! The test is watertight (Woop, Benthin, Wald: *Watertight Ray/Triangle Intersection*, JCGT
//! 2013) in double precision, and the hierarchy's boxes are padded so that rounding never
//! discards a box: what a ray hits depends on the triangles alone, not on their order, the
//! hierarchy or the thread. A mirrored mesh gives exactly the mirrored counts.
//!
//! The same faces, many times faster, come from the *direction sweep*, which finds what lies
//! ahead of whole rows of cells at once. It cannot do random rays or a maximum distance.
//!
//! # Practice
//!
//! [`bake()`] is all it takes for a grid; a [`Baker`] kept warm bakes again and again and says
//! which kernel it uses. An [`Occluder`] bakes by rays and answers single ones
//! ([`Occluder::hides`], [`Occluder::nearest`]); [`truth`] shades with them. A [`Sweeper`] bakes a prepared mesh, and gives the
//! faces' bits. Threads are those of the `rayon` pool in which the call runs.

mod bake;
mod baker;
mod monte_carlo;
mod occluder;
mod snapped;
mod sweep;
mod triangle;
pub mod truth;

pub use aogrid_bake_core::{Kernel, WhyRays};
pub use bake::{BakeError, bake};
pub use baker::{Baker, Prepared};
pub use occluder::{Hit, Occluder};
pub use snapped::SnappedRays;
pub use sweep::Sweeper;
