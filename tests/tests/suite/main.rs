//! The cross-crate tests, one binary.

/// Occlusion that is known exactly: a ball, a box, random rays.
mod analytic;
/// Committed sample models are what the generator makes.
mod assets;
/// Answers of cargo about this workspace.
mod cargo;
/// The same bytes for any number of threads, and for two runs.
mod determinism;
/// Light from environments in scenes by their grids.
mod environment_grids;
/// Light from environments by exact cones, against ray tracing.
mod environment_light;
/// Maps of radiance: orientation, range, files.
mod environments;
/// Commands and tests resolve the same features.
mod features;
/// The GPU baker against rays and exact answers.
mod gpu;
/// An instance shades like the equally transformed mesh, baked anew.
mod instances;
/// Other programs' readers open our files.
mod interchange;
/// The inside of meshes with holes.
mod interior;
/// Which crate may use which.
mod layering;
/// Several occluders, multiplied and merged, against ray tracing.
mod merge;
/// Real meshes made by others.
mod meshes;
/// Node.js with other programs' packages.
mod node;
/// The direction sweep against rays.
mod parity;
/// Values per receiver from an independent program.
mod reference;
/// Scene files, cameras, G-buffers.
mod scenes;
/// A symmetric mesh gives symmetric counts, exactly.
mod symmetry;
/// Every shader through Tint.
mod tint;
/// Ray-traced truth against closed forms.
mod truth;
