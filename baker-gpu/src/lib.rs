//! Bakes ambient-occlusion grids with wgpu compute: six 16×16 cube faces per cell, reduced
//! to moments on the GPU. It fills the same `RawGrid` from the same options as the CPU baker.
//!
//! Nothing here yet: the crate's place in the workspace is fixed, its contents are to come.
