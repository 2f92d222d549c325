//! Tests that the shaders are valid and match their CPU twin, in one binary.
//!
//! Tests that need a Vulkan, Metal or DX12 adapter are skipped with a note on machines without one;
//! `AOGRID_GPU=require` makes that a failure.

/// Environment light: its functions and its pass against the CPU twin.
mod environment;
/// The functions of the WGSL library, one by one, against the CPU twin.
mod functions;
/// Golden images, checked by eye before they were committed.
mod golden;
/// Merging, by raster and in tiles, against the CPU twin.
mod merge;
/// Validation of every shader, and of its structs' layout against Rust's.
mod modules;
/// The raster pass against the CPU twin on whole images.
mod raster;
/// The tiled pass against the raster pass and the CPU twin.
mod tiled;
/// Volume passes with many triangles and none, and on devices that lack something.
mod volume_limits;
/// Volume passes at less than full resolution, and their upsampling.
mod volume_resolution;
/// The volume pass and its term against the CPU twin.
mod volumes;

/// Grids with a known answer in every cell.
mod grids;
/// Single functions of the WGSL library, evaluated on the device.
mod kernel;
/// Scenes of several occluders, shaded by every pass.
mod many;
/// G-buffers by ray casting, without a rasterizer.
mod scene;
