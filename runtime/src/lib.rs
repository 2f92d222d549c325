//! Shades scenes with baked ambient-occlusion grids.

pub mod shading;
pub mod tables;
pub mod wgsl;

mod grid_texture;
mod linear_texture;
mod occluder;
mod occlusion_pass;

pub use grid_texture::{GridTexture, GridTextureError};
pub use linear_texture::LinearTexture;
pub use occluder::{AogridOccluder, Instance, InstanceError};
pub use occlusion_pass::{
    DepthTest, Frame, Mode, Normals, OcclusionPass, OcclusionPassDescriptor, Output, PassError,
    Positions, PrepareError, Receivers,
};
pub use wgpu;
pub use wgsl::AOGRID_NO_OBJECT;
