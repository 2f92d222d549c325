//! Bakes a grid with the default preset:
//! `cargo run --release --example bake model.obj model.ao.ktx2`.

use aogrid_bake_core::{Preset, UNOBSERVED, mesh};
use aogrid_grid_format::Source;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let (Some(model), Some(out)) = (args.next(), args.next()) else {
        return Err("usage: bake MODEL.obj OUT.ao.ktx2".into());
    };
    let loaded = mesh::load(model.as_ref())?;
    let (placement, options) = (Preset::Default.placement(), Preset::Default.options());
    let source = Source::from(&loaded);
    let grid = aogrid_baker_cpu::bake_grid(&loaded.mesh, &placement, &options, source, UNOBSERVED)?;
    std::fs::write(out, grid.to_bytes())?;
    Ok(())
}
