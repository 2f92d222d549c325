//! Shades scenes with baked ambient-occlusion grids: a WGSL library, wgpu passes, and a CPU
//! twin of the shading functions. It links into renderers, so it knows the grid file and the
//! tables, and nothing of meshes or baking.
//!
//! Nothing here yet: the crate's place in the workspace is fixed, its contents are to come.
