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
//! occluders are multiplied (RR-5779, 5.2.1).
//!
//! What we do differently: the axis is normalised after filtering; directions turn with the
//! object's linear part, as they are stored in object axes; T_clip's texture holds 1 − AO; outside
//! its box an occluder does nothing at all. A grid that is looked up by an instance that is turned,
//! mirrored or uniformly scaled is exact; any other scale changes solid angles.
//!
//! # Practice
//!
//! * [`wgsl::SHADING`]: the library as text, pure functions for any shader. [`shading`] is its twin:
//!   the same names, in Rust.
//! * [`Instance`] and a grid make an [`AogridOccluder`], the uniform that both read.
//! * [`GridTexture`], [`tables`]: what a device needs, uploaded once, shared by all instances.
//! * [`OcclusionPass`]: new, prepare, draw; the back faces of the boxes over a G-buffer.
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

mod environment_map;
mod environment_pass;
mod environment_texture;
mod grid_texture;
mod linear_texture;
mod occluder;
mod occlusion_pass;

pub use environment::{AogridCone, AogridEnvironment, Up};
pub use environment_map::{EnvironmentMap, EnvironmentMapError};
pub use environment_pass::{
    EnvironmentFrame, EnvironmentFrameError, EnvironmentPass, EnvironmentPassDescriptor,
    EnvironmentPassError, Reflection,
};
pub use environment_texture::EnvironmentTexture;
pub use grid_texture::{GridTexture, GridTextureError};
pub use linear_texture::LinearTexture;
pub use occluder::{AogridOccluder, Instance, InstanceError};
pub use occlusion_pass::{
    DepthTest, Frame, Mode, Normals, OcclusionPass, OcclusionPassDescriptor, Output, PassError,
    Positions, PrepareError, Receivers,
};
pub use wgpu;
pub use wgsl::AOGRID_NO_OBJECT;
