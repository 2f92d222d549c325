//! Bakes ambient-occlusion grids on the CPU, on all cores, by the direction sweep or by ray
//! casting. Ray casting is the reference that every faster implementation is checked against.
//!
//! ```
//! use aogrid_bake_core::{Preset, UNOBSERVED, models::Model};
//! use aogrid_grid_format::Source;
//! # let mesh = Model::Table.mesh(None)?;
//! # let loaded = aogrid_bake_core::mesh::LoadedMesh::from_mesh(mesh, "table.obj".into(), "0".repeat(64));
//! // `loaded` comes from `aogrid_bake_core::mesh::load("table.obj".as_ref())?`.
//! let (placement, options) = (Preset::Economy.placement(), Preset::Economy.options());
//! let source = Source::from(&loaded);
//! let grid = aogrid_baker_cpu::bake_grid(&loaded.mesh, &placement, &options, source, UNOBSERVED)?;
//! assert_eq!(grid.texels().len(), 16 * 1024); // 16³ cells of 4 bytes
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Theory
//!
//! Visibility is sampled in one of two ways. [`Sampling::CubeFaces`](aogrid_grid_format::Sampling::CubeFaces)
//! tests the center of every texel of six cube faces and weights it by the texel's exact solid
//! angle. [`Sampling::MonteCarlo`](aogrid_grid_format::Sampling::MonteCarlo) tests uniformly random directions
//! (RR-5779, 6.1, the third method). A direction is occluded if its ray hits a triangle, from
//! either side, at a distance above zero and up to the maximum.
//!
//! The ray–triangle test is watertight (Woop, Benthin, Wald: *Watertight Ray/Triangle
//! Intersection*, JCGT 2013) and in double precision. The boxes of the BVH are padded, so that
//! rounding never culls a box that the ray hits. The result depends on the triangles alone, not
//! on their order, the BVH or the thread. A mirrored mesh gives exactly the mirrored counts.
//!
//! The *direction sweep* computes the same cube faces many times faster: it finds the occluders
//! ahead of a whole row of cells at once. It supports neither random directions nor a maximum
//! distance.
//!
//! # Practice
//!
//! [`bake_grid`] bakes a grid to encode and write, [`bake()`] its moments alone. A [`Baker`] keeps its
//! buffers for further bakes and reports which algorithm it uses. A [`Rebaker`] also keeps what stays
//! the same while a mesh deforms. A [`RayScene`] bakes by ray casting and traces single rays
//! ([`RayScene::is_occluded`], [`RayScene::closest_hit`]). A [`Sweeper`] bakes a prepared mesh by the
//! direction sweep and also returns the occlusion bits of the faces. [`bake_surface`] bakes the
//! accessibility of points on surfaces. All of them use the `rayon` thread pool in which they are called.

mod bake;
mod baker;
mod error;
mod monte_carlo;
pub mod parity;
mod quantized_rays;
#[cfg(test)]
mod random;
mod ray_scene;
mod rebaker;
mod surface;
mod sweep;
mod triangle;

pub use aogrid_bake_core::{Algorithm, PlanError, RayFallbackReason};
pub use baker::{Baker, Prepared, bake, bake_grid};
pub use error::BakeError;
pub use quantized_rays::QuantizedMeshRays;
pub use ray_scene::{Hit, RayScene};
pub use rebaker::Rebaker;
pub use surface::{Projection, SurfaceBake, SurfaceKernel, bake_surface};
pub use sweep::Sweeper;
