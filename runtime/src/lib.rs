//! Shades scenes with baked ambient-occlusion grids: a WGSL library, wgpu passes, and a CPU twin.
//!
//! ```
//! use aogrid_grid_format::Grid;
//! use aogrid_runtime::shading::aogrid_cone;
//! use aogrid_runtime::{AogridOccluder, Instance, CpuTexture};
//!
//! # fn shade(bytes: &[u8]) -> Result<f32, Box<dyn std::error::Error>> {
//! // The per-pixel computation of the GPU, on the CPU.
//! let grid = Grid::from_bytes(bytes)?;
//! let world_from_object =
//!     [[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., 0.], [0., 2., 0., 1.]];
//! let instance = Instance { strength: 0.8, ..Instance::at(world_from_object) };
//! let occluder = AogridOccluder::new(&grid, &instance)?;
//! let texture = CpuTexture::of_grid(&grid);
//! let table = CpuTexture::transmittance_table();
//! let transmittance = aogrid_cone(&occluder, &texture, &table, [0., 2., 1.], [0., 1., 0.]);
//! # Ok(transmittance)
//! # }
//! ```
//!
//! # Theory
//!
//! A grid is sampled at the receiver's position (RR-5779, 3.2). With occlusion alone (RR-5779, 4),
//! AO = 2a, or 2a − 1 on the occluder's own surface; the paper prints half of that. With the axis d
//! as well (RR-5779, 5.1), the cone is clipped by the receiver's tangent plane: AO = T_clip(a,
//! d·n). The transmittance 1 − AO multiplies ambient light, and only ambient light. Several
//! occluders are combined either by multiplying their transmittances (RR-5779, 5.2.1) or by merging
//! their cones (RR-5779, 5.2.2). Merging keeps a running AO and a summed axis D: AO = 2
//! T_merge(AO/2, AOᵢ/2, ∠(D, dᵢ′)), D += (AOᵢ/2) dᵢ′.
//!
//! Differences from the papers: the axis is normalized after filtering; directions are stored in
//! object axes and transformed by the linear part of the object's transform; the T_clip texture
//! holds 1 − AO. An occluder has no effect outside its box, or goes on beyond it in a far field: in each
//! direction as a body between a sphere and a disc, whose sin²α or tan²α falls with the distance squared. A receiver on the occluder
//! itself is looked up a fraction of a cell along its normal. The T_merge texture holds the fraction
//! that two cones share, so that a cone that overlaps no other stays exactly as it is. With three
//! or more occluders the result of merging depends on their order, which is the caller's in every
//! pass. Grids are exact for instances that are rotated, reflected or uniformly scaled; any other
//! scale changes solid angles.
//!
//! # Practice
//!
//! * [`wgsl::SHADING`]: the library as text, pure functions for any shader. [`shading`] is its CPU
//!   twin: the same names, in Rust.
//! * [`Instance`] and a grid make an [`AogridOccluder`], the uniform that both read.
//! * [`GridTexture`], [`tables`]: the GPU resources, uploaded once and shared by all instances.
//! * [`GBufferFormat`], [`GBufferViews`]: the description of your G-buffer, the same for all passes.
//! * [`OcclusionPass`]: new, prepare, draw. Draws the back faces of the boxes over a G-buffer with
//!   multiplicative blending.
//! * [`MergePass`]: the same with merged cones, alternating between two buffers.
//! * [`TiledPass`]: multiplies or merges in compute dispatches, for many occluders; forward and
//!   transparent shaders can read its lists. [`GridAtlas`]: the one texture with all grids that it
//!   reads.
//! * [`EnvironmentMap`], [`EnvironmentPass`], [`wgsl::ENVIRONMENT`] and its twin [`environment`]:
//!   environment light, less the part that the occluders block.
//! * [`VolumePass`], [`wgsl::VOLUMES`] and its twin [`volumes`]: the analytic occlusion of triangles, for
//!   objects that deform and need no bake.
//! * [`wgsl::SURFACE`] and its twin [`surface`]: environment light on surfaces with baked accessibility and
//!   bent normals, alone and beside grids.
//! * [`CpuTexture`]: a texture and its linear filter on the CPU.
//!
//! The crate creates no device, submits nothing and never waits; every GPU object has a label.
//! `docs/runtime.md` is the guide; the version of wgpu in use is [re-exported](wgpu).

pub mod environment;
pub mod shading;
pub mod surface;
pub mod tables;
pub mod volumes;
pub mod wgsl;

mod boxes;
mod cpu_texture;
mod environment_map;
mod environment_pass;
mod environment_texture;
mod frame;
mod gbuffer;
mod grid_atlas;
mod grid_facts;
mod grid_texture;
mod latlong_cube;
mod lookup;
mod merge_pass;
mod occluder;
mod occlusion_pass;
mod pipelines;
mod tiled_pass;
mod volume_pass;

pub use cpu_texture::CpuTexture;
pub use environment::{AogridEnvironment, Up};
pub use environment_map::{EnvironmentMap, EnvironmentMapError};
pub use environment_pass::{
    EnvironmentFrame, EnvironmentFrameError, EnvironmentPass, EnvironmentPassDescriptor,
    EnvironmentPassError, Reflection,
};
pub use environment_texture::EnvironmentTexture;
pub use frame::{Frame, PrepareError};
pub use gbuffer::{
    DepthTest, GBufferError, GBufferFormat, GBufferViews, Normals, Positions, Receivers,
};
pub use grid_atlas::{GridAtlas, GridAtlasError};
pub use grid_texture::{GridTexture, GridTextureError};
pub use latlong_cube::LatLongCube;
pub use merge_pass::{MergePass, MergePassDescriptor};
pub use occluder::{AogridOccluder, Instance, InstanceError};
pub use occlusion_pass::{Mode, OcclusionPass, OcclusionPassDescriptor, Output, PassError};
pub use shading::AogridCone;
pub use tiled_pass::{
    AogridAtlasOccluder, AogridTiles, Combine, TiledFrame, TiledPass, TiledPassDescriptor,
};
pub use volume_pass::{
    UpsamplePass, UpsamplePassDescriptor, VolumeFrame, VolumeFrameError, VolumeObject, VolumePass,
    VolumePassDescriptor, VolumePassError, VolumeResolution,
};
pub use volumes::{AogridVolume, VolumeError, VolumeWeight};
pub use wgpu;
pub use wgsl::{AOGRID_LIST_ALL_DEPTHS, AOGRID_LIST_OPAQUE, AOGRID_NO_OBJECT, AOGRID_TILE};
