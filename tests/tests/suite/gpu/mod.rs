//! Tests of the GPU baker.

/// Whole bakes: exact answers, the choice of an algorithm, progress, the interior.
mod baker;
/// Lost and small devices, missing adapters.
mod device;
/// Rays, with and without a hierarchy, against the CPU's.
mod rays;
/// The direction sweep against the CPU's rays and sweep.
mod sweep;

use aogrid_bake_core::{BakeOptions, Placement, RawGrid, TriangleMesh, UNOBSERVED};
use aogrid_baker_gpu::{Baker, Context};
use aogrid_grid_format::GridSpec;

fn placed(mesh: &TriangleMesh, n: u32) -> GridSpec {
    let placement = Placement {
        resolution: [n; 3],
        ..Placement::paper()
    };
    placement.place(&mesh.bounds()).unwrap()
}

fn bake(context: &Context, mesh: &TriangleMesh, spec: GridSpec, o: &BakeOptions) -> RawGrid {
    bake_by(&mut Baker::new(context, None), context, mesh, spec, o)
}

/// Bakes and waits for the result.
fn bake_by(
    baker: &mut Baker,
    context: &Context,
    mesh: &TriangleMesh,
    spec: GridSpec,
    o: &BakeOptions,
) -> RawGrid {
    let raw = context.block_on(async {
        let mut ready = baker.prepare(mesh, spec, o).await?;
        ready.bake(UNOBSERVED).await
    });
    raw.unwrap()
}
