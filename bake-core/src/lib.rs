//! The shared core of all bakers of ambient-occlusion grids: mesh, placement of the grid,
//! directions, options, moments, and the post-processing of moments to a grid.
//!
//! ```
//! use aogrid_bake_core::{BakeOptions, Placement, TriangleMesh, models};
//! let mesh = models::Model::Table.mesh(None)?;
//! let spec = Placement::paper().place(&mesh.bounds())?;
//! assert_eq!(spec.resolution(), [32; 3]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Theory
//!
//! RR-5779, section 3: a rigid object is surrounded by a box of cells ([`Placement`], eq. 4). For
//! each cell a baker finds the directions in which the object hides the sky, and reduces them
//! to moments ([`RawGrid`]): the occluded fraction a (eq. 5), the average occluded direction
//! m = (1/4π) ∫ ω dω, and the count of occluded directions. Then, once and in this order:
//! cells inside the object are filled from outside (3.3.3), values are rescaled to vanish at
//! the boundary (3.3.2; JGT 2007), and the result is encoded. That is [`Preset::Paper`].
//! [`Preset::Default`] rescales nothing, since renderers continue the field beyond the box, and
//! fits the cells near the surface to a second, finer bake, so that what they interpolate is right.
//!
//! Differences from the papers: the texels of a cube face are weighted by their exact solid angles
//! (the papers' unweighted average triples the error of the axis); enclosed cells are told by the
//! integer count, not by a float; flat and rod-like objects get a margin where eq. 4 gives none.
//!
//! # Practice
//!
//! [`TriangleMesh`] (validated once) → [`Placement::place`] → a baker (`aogrid-baker-cpu`)
//! with [`BakeOptions`] → [`RawGrid`] → [`post::finish`] → `Grid`, which is written to a file:
//! [`bake_grid`] does it all. An [`Observer`] reports a bake's progress to the caller, who may
//! cancel it.

mod algorithm;
mod classification;
pub mod cube_face;
mod face_bits;
mod face_sums;
mod far_field;
mod fit;
pub mod glb;
pub mod layers;
pub mod models;
mod observer;
mod option_warnings;
mod options;
mod pipeline;
mod placement;
pub mod post;
pub mod prepared;
mod preset;
mod raw_grid;
pub mod surface;
pub mod sweep;
mod warnings;

pub mod mesh;

pub use algorithm::{Algorithm, Plan, PlanError, RayFallbackReason};
pub use classification::Classification;
pub use face_bits::FaceBits;
pub use face_sums::{FaceSums, FixedTexel, fixed_texels};
pub use far_field::has_far_field;
pub use fit::NearSurface;
pub use layers::SignedLayers;
pub use mesh::TriangleMesh;
pub use observer::{Observer, Progress, UNOBSERVED};
pub use option_warnings::option_warnings;
pub use options::{BakeOptions, OptionsError};
pub use pipeline::{
    ALGORITHM_VERSION, PipelineError, bake_grid, bake_grid_at, near_surface_lattice,
};
pub use placement::{Extent, Placement, PlacementError};
pub use prepared::{PrepareError, PreparedMesh};
pub use preset::Preset;
pub use raw_grid::{Moments, RawGrid};
pub use warnings::{mesh_warnings, warnings};
