//! Bakes a grid with the recommended options:
//! `cargo run --release --example bake model.obj model.ao.ktx2`.

use aogrid_bake_core::{BakeOptions, Placement, UNOBSERVED, mesh, post};
use aogrid_grid_format::Source;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let (Some(model), Some(out)) = (args.next(), args.next()) else {
        return Err("usage: bake MODEL.obj OUT.ao.ktx2".into());
    };
    let loaded = mesh::load(model.as_ref())?;
    let (placement, options) = (Placement::default(), BakeOptions::recommended());
    let spec = placement.place(&loaded.mesh.bounds())?;
    let raw = aogrid_baker_cpu::bake(&loaded.mesh, spec, &options, UNOBSERVED)?;
    let source = Source::from(&loaded);
    let grid = post::finish(raw, &placement, &options, source)?;
    std::fs::write(out, grid.to_bytes())?;
    Ok(())
}
