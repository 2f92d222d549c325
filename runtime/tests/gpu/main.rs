//! The shaders: valid, and equal to their CPU twin. One binary.
//!
//! A machine without a Vulkan, Metal or DX12 adapter skips what needs one, and says so;
//! `AOGRID_GPU=require` makes that a failure.

/// Light from an environment: its functions and its pass against the twin.
mod environment;
/// The WGSL library, function by function, against the twin.
mod functions;
/// Pictures that were looked at, kept.
mod golden;
/// Merging, by raster and in tiles, against the twin.
mod merge;
/// Every shader compiles, and its structs are laid out as Rust's.
mod modules;
/// The raster pass against the twin on whole images.
mod raster;

/// The tiled pass against the raster pass and the twin.
mod tiled;

/// Adapters, buffers and images.
mod gpu;
/// Grids with a known answer in every cell.
mod grids;
/// Several occluders, shaded in every way.
mod many;
/// G-buffers without a rasteriser.
mod scene;
