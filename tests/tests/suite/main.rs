//! The cross-crate tests, one binary.

/// The accuracy of grids and modes, against a committed table and an independent program.
mod accuracy;
/// Exactly known occlusion: a ball, a box, random rays.
mod analytic;
/// Committed models match the generator.
mod assets;
/// Answers of cargo about this workspace.
mod cargo;
/// Modules form no circles.
mod cycles;
/// Bakes give the same bytes for any number of threads, and in two runs.
mod determinism;
/// Environment light in scenes through their grids.
mod environment_grids;
/// Environment light with exact cones, against ray tracing.
mod environment_light;
/// Environment maps: orientation, range, files.
mod environments;
/// The far field of baked objects.
mod far_field;
/// Scenes at map coordinates, and over large floors.
mod far_scenes;
/// Commands and tests resolve the same features.
mod features;
/// GLB files with grids, read by other programs' packages.
mod glb;
/// The GPU baker against rays and exact answers.
mod gpu;
/// Instances shade like the equally transformed mesh, baked again.
mod instances;
/// Other programs' readers for our files.
mod interchange;
/// The interior of meshes with holes.
mod interior;
/// The allowed dependencies between crates.
mod layering;
/// Licenses of what the project depends on.
mod licenses;
/// Several occluders, multiplied and merged, against ray tracing.
mod merge;
/// Real meshes made by others.
mod meshes;
/// Node.js with other programs' packages.
mod node;
/// The direction sweep against rays.
mod parity;
/// Presets: the frozen papers, the default's shadows.
mod presets;
/// The documented reader of grid files, in Python.
mod python_reader;
/// Rays by the tree against every triangle, on real meshes.
mod rays;
/// Receivers' values from an independent program.
mod reference;
/// Scene files, cameras, G-buffers.
mod scenes;
/// The shading library in GLSL and HLSL.
mod shading_languages;
/// The source files of the workspace.
mod sources;
/// Openings of doc comments, names, lengths.
mod style;
/// Accessibility and bent normals on surfaces.
mod surface;
/// Symmetric meshes give symmetric counts, exactly.
mod symmetry;
/// Tint's verdict on every shader.
mod tint;
/// The path-traced reference against closed forms.
mod truth;
/// Ambient occlusion volumes against ray tracing.
mod volumes;
/// The npm package for browsers.
mod web;
