//! What the tests of several crates share: baking in one call, exact answers to compare with,
//! and the folder of data that the project does not ship.

mod analytic;
mod data;
mod gpu;
mod lookup;
mod surface;

pub use analytic::{convex_fraction, form_factor, mesh_of, sphere_fraction};
pub use data::{files_with_ending, shared, skip};
pub use gpu::gpu;
pub use lookup::{Shaded, cells_around};
pub use surface::{surface_points, truth, winding_number};

use aogrid_bake_core::{BakeOptions, Placement, RawGrid, TriangleMesh, UNOBSERVED, post};
use aogrid_grid_format::{BoundaryMode, Encoding, Grid, Source, TexelFormat};

/// The recommended options with samples exactly at cell centres, and nothing done to values.
pub fn exact_options() -> BakeOptions {
    BakeOptions {
        sample_offset: [0.0; 3],
        boundary: BoundaryMode::None,
        encoding: Encoding::Cone,
        format: TexelFormat::F32,
        ..BakeOptions::recommended()
    }
}

/// The moments around `mesh`.
///
/// # Panics
///
/// If it cannot be placed or baked.
pub fn raw(mesh: &TriangleMesh, placement: &Placement, options: &BakeOptions) -> RawGrid {
    let spec = placement
        .place(&mesh.bounds())
        .expect("the mesh can be placed");
    aogrid_baker_cpu::bake(mesh, spec, options, UNOBSERVED).expect("the mesh can be baked")
}

/// The whole pipeline.
///
/// # Panics
///
/// If any of it fails.
pub fn grid(mesh: &TriangleMesh, placement: &Placement, options: &BakeOptions) -> Grid {
    finish(raw(mesh, placement, options), placement, options)
}

/// What follows the moments.
///
/// # Panics
///
/// If they make no grid.
pub fn finish(raw: RawGrid, placement: &Placement, options: &BakeOptions) -> Grid {
    let source = Source {
        name: "test.obj".into(),
        part: None,
        blake3: "0".repeat(64),
        triangles: 1,
    };
    post::finish(raw, placement, options, source).expect("the moments make a grid")
}
