//! Shades scenes with baked ambient-occlusion grids: a WGSL library, a wgpu pass, and their CPU twin.
//!
//! ```
//! use aogrid_grid_format::Grid;
//! use aogrid_runtime::shading::aogrid_cone;
//! use aogrid_runtime::{AogridOccluder, Instance, LinearTexture};
//!
//! # fn shade(bytes: &[u8]) -> Result<f32, Box<dyn std::error::Error>> {
//! // What a GPU does per pixel, on the CPU.
//! let grid = Grid::from_bytes(bytes)?;
//! let world_from_object = [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., 0.], [0., 2., 0., 1.]];
//! let instance = Instance { strength: 0.8, ..Instance::at(world_from_object) };
//! let occluder = AogridOccluder::new(grid.spec(), grid.format(), &instance)?;
//! let texture = LinearTexture::of_grid(&grid);
//! let table = LinearTexture::transmittance_table();
//! let transmittance = aogrid_cone(&occluder, &texture, &table, [0., 2., 1.], [0., 1., 0.]);
//! # Ok(transmittance)
//! # }
//! ```
//!
//! # Theory
//!
//! A receiver looks a grid up at its position (RR-5779, 3.2). With occlusion alone (RR-5779, 4)
//! AO = 2a, or on the occluder's own surface 2a − 1: half of that is printed. With the axis d, too
//! (RR-5779, 5.1), the cone is clipped by the receiver's tangent plane: AO = T_clip(a, d·n). What
//! multiplies ambient light, and only ambient light, is the transmittance 1 − AO; those of several
//! occluders are multiplied (RR-5779, 5.2.1), or their cones merged (RR-5779, 5.2.2): a running
//! pair of AO and summed axis D, AO = 2 T_merge(AO/2, AOᵢ/2, ∠(D, dᵢ′)), D += (AOᵢ/2) dᵢ′.
//!
//! What we do differently: the axis is normalised after filtering; directions turn with the
//! object's linear part, as they are stored in object axes; T_clip's texture holds 1 − AO; outside
//! its box an occluder does nothing at all. T_merge's texture holds what two cones share, which leaves
//! a cone that meets nothing exactly as it is. Merging depends on the order from three occluders on:
//! it is the caller's everywhere. A grid that is looked up by an instance that is turned,
//! mirrored or uniformly scaled is exact; any other scale changes solid angles.
//!
//! # Practice
//!
//! * [`wgsl::SHADING`]: the library as text, pure functions for any shader. [`shading`] is its twin:
//!   the same names, in Rust.
//! * [`Instance`] and a grid make an [`AogridOccluder`], the uniform that both read.
//! * [`GridTexture`], [`tables`]: what a device needs, uploaded once, shared by all instances.
//! * [`OcclusionPass`]: new, prepare, draw; the back faces of the boxes over a G-buffer, multiplied.
//! * [`MergePass`]: the same, merged, between a pair of buffers.
//! * [`TiledPass`]: either in one dispatch, for many occluders; its lists serve forward and
//!   transparent shaders. [`GridAtlas`]: the grids in one texture that it reads.
//! * [`EnvironmentMap`], [`EnvironmentPass`], [`wgsl::ENVIRONMENT`] and its twin [`environment`]: light
//!   from all around, less what the occluders hide of it.
//! * [`LinearTexture`]: a texture and its filter on the CPU.
//!
//! Nothing here creates a device, submits, or waits; every object on the device has a label.
//! `docs/runtime.md` is the guide; the version of wgpu is [re-exported](wgpu).

pub mod environment;
pub mod shading;
pub mod tables;
pub mod wgsl;

mod boxes;
mod environment_map;
mod environment_pass;
mod environment_texture;
mod frame;
mod grid_atlas;
mod grid_texture;
mod linear_texture;
mod merge_pass;
mod occluder;
mod occlusion_pass;
mod tiled_pass;

pub use boxes::DepthTest;
pub use environment::{AogridCone, AogridEnvironment, Up};
pub use environment_map::{EnvironmentMap, EnvironmentMapError};
pub use environment_pass::{
    EnvironmentFrame, EnvironmentFrameError, EnvironmentPass, EnvironmentPassDescriptor,
    EnvironmentPassError, Reflection,
};
pub use environment_texture::EnvironmentTexture;
pub use frame::{Frame, Normals, Positions, PrepareError, Receivers};
pub use grid_atlas::{GridAtlas, GridAtlasError};
pub use grid_texture::{GridTexture, GridTextureError};
pub use linear_texture::LinearTexture;
pub use merge_pass::{MergePass, MergePassDescriptor};
pub use occluder::{AogridOccluder, Instance, InstanceError};
pub use occlusion_pass::{Mode, OcclusionPass, OcclusionPassDescriptor, Output, PassError};
pub use tiled_pass::{
    AogridAtlasOccluder, AogridTiles, Combine, TiledFrame, TiledPass, TiledPassDescriptor,
};
pub use wgpu;
pub use wgsl::{AOGRID_LIST_OF_ANYTHING, AOGRID_LIST_OF_RECEIVERS, AOGRID_NO_OBJECT, AOGRID_TILE};
