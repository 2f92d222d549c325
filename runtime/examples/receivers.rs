//! Writes receivers around a grid with what the CPU twin gives for them, for those who shade in another
//! language and want to test that.
//!
//! ```sh
//! cargo xtask bake assets/robot.obj -o robot.ao.ktx2
//! cargo run -p aogrid-runtime --example receivers -- robot.ao.ktx2 receivers.f32
//! ```
//!
//! The file holds single floats, little-endian: the transform of the object in 16 columns, then for each
//! receiver its position, its normal, 1 − AO on another object, and 1 − AO on the object itself.

use aogrid_grid_format::Grid;
use aogrid_runtime::shading::{aogrid_cone, aogrid_cone_on_itself};
use aogrid_runtime::{AogridOccluder, CpuTexture, Instance};
use glam::{Mat4, Quat, Vec3};

/// The number of receivers.
const COUNT: usize = 65_536;

/// The receivers lie in the grid's box, grown by this factor: some of them in the far field.
const GROWTH: f32 = 3.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let (Some(grid), Some(out)) = (args.next(), args.next()) else {
        return Err("usage: receivers GRID.ao.ktx2 OUT.f32".into());
    };
    let grid = Grid::from_bytes(&std::fs::read(grid)?)?;
    let rotation = Quat::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 0.7);
    let position = Vec3::new(2.0, -1.0, 0.5);
    // A mirror image of another size.
    let scale = Vec3::new(-1.7, 1.7, 1.7);
    let transform = Mat4::from_scale_rotation_translation(scale, rotation, position);
    let occluder = AogridOccluder::new(&grid, &Instance::at(transform.to_cols_array_2d()))?;
    let texture = CpuTexture::of_grid(&grid);
    let table = CpuTexture::transmittance_table();
    let mut floats = transform.to_cols_array().to_vec();
    let (center, half_extents) = (grid.spec().center(), grid.spec().half_extents());
    for idx in 0..COUNT {
        let [x, y, z, u, v] = point(idx);
        let off_center = (2.0 * Vec3::new(x, y, z) - 1.0) * GROWTH * Vec3::from(half_extents);
        let position = transform
            .transform_point3(Vec3::from(center) + off_center)
            .to_array();
        let normal = direction(u, v).to_array();
        let other = aogrid_cone(&occluder, &texture, &table, position, normal);
        let itself = aogrid_cone_on_itself(&occluder, &texture, &table, position, normal);
        floats.extend(position);
        floats.extend(normal);
        floats.extend([other, itself]);
    }
    let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(out, bytes)?;
    Ok(())
}

/// Returns a point of a sequence that fills the unit cube of five dimensions evenly.
fn point(idx: usize) -> [f32; 5] {
    /// The real root of x⁶ = x + 1.
    const ROOT: f64 = 1.134_724_138_401_519_4;
    std::array::from_fn(|axis| {
        let step = ROOT.powi(-(axis as i32 + 1));
        (0.5 + step * idx as f64).fract() as f32
    })
}

/// Returns a unit vector, evenly distributed for even u and v.
fn direction(u: f32, v: f32) -> Vec3 {
    let z = 2.0 * u - 1.0;
    let (sin, cos) = (v * std::f32::consts::TAU).sin_cos();
    let radius = (1.0 - z * z).sqrt();
    Vec3::new(radius * cos, radius * sin, z)
}
