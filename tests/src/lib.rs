//! The support library of the tests: baking in one call, exact results to compare with, random
//! numbers, and the data folder that the project does not ship.

mod analytic;
mod data;
mod gpu;
mod lookup;
mod random;
mod surface;

pub use analytic::{convex_fraction, form_factor, mesh_of, sphere_fraction};
pub use data::{files_with_ending, shared, skip};
pub use gpu::gpu;
pub use lookup::{Shaded, cells_around};
pub use random::Random;
pub use surface::{surface_points, truth, winding_number};

use aogrid_bake_core::{
    BakeOptions, Placement, RawGrid, TriangleMesh, UNOBSERVED, post, post::Refinements,
};
use aogrid_grid_format::{BoundaryMode, Encoding, Grid, Source, TexelFormat};

/// Returns the options of the papers with samples exactly at cell centers, no boundary treatment and
/// unquantized values.
pub fn exact_options() -> BakeOptions {
    BakeOptions {
        sample_offset: [0.0; 3],
        boundary: BoundaryMode::None,
        encoding: Encoding::Cone,
        format: TexelFormat::F32,
        ..BakeOptions::paper()
    }
}

/// Bakes the moments around `mesh`.
///
/// # Panics
///
/// If the grid cannot be placed or baked.
pub fn raw(mesh: &TriangleMesh, placement: &Placement, options: &BakeOptions) -> RawGrid {
    let spec = placement
        .place(&mesh.bounds())
        .expect("the mesh can be placed");
    aogrid_baker_cpu::bake(mesh, spec, options, UNOBSERVED).expect("the mesh can be baked")
}

/// Bakes a grid around `mesh` with the whole pipeline.
///
/// # Panics
///
/// If a step fails.
pub fn grid(mesh: &TriangleMesh, placement: &Placement, options: &BakeOptions) -> Grid {
    aogrid_baker_cpu::bake_grid(mesh, placement, options, source(), UNOBSERVED)
        .expect("the mesh can be baked")
}

/// Returns the source of a mesh that no file holds.
fn source() -> Source {
    Source {
        name: "test.obj".into(),
        part: None,
        blake3: "0".repeat(64),
        triangles: 1,
    }
}

/// Converts moments into a grid with the rest of the pipeline.
///
/// # Panics
///
/// If the moments do not make a valid grid.
pub fn finish(raw: RawGrid, placement: &Placement, options: &BakeOptions) -> Grid {
    post::finish(raw, &Refinements::default(), placement, options, source())
        .expect("the moments make a grid")
}
