//! Looking a grid up where it stands in object space, by the runtime's CPU twin.

use aogrid_grid_format::{Grid, GridSpec};
use aogrid_runtime::shading::{
    aogrid_cone, aogrid_grid_position, aogrid_is_inside, aogrid_occlusion_of_cone,
};
use aogrid_runtime::{AogridOccluder, Instance, LinearTexture};

/// A cone grid, ready to be shaded with.
pub struct Shaded {
    /// Its uniform.
    pub occluder: AogridOccluder,
    /// Its texture.
    pub texture: LinearTexture,
    table: LinearTexture,
}

impl Shaded {
    /// The grid in world space.
    ///
    /// # Panics
    ///
    /// If the instance is none.
    pub fn new(grid: &Grid, instance: &Instance) -> Self {
        let occluder = AogridOccluder::new(grid.spec(), grid.format(), instance);
        Self {
            occluder: occluder.expect("an instance"),
            texture: LinearTexture::of_grid(grid),
            table: LinearTexture::transmittance_table(),
        }
    }

    /// The grid in object space.
    pub fn in_object_space(grid: &Grid) -> Self {
        let identity =
            std::array::from_fn(|c| std::array::from_fn(|r| f32::from(u8::from(c == r))));
        Self::new(grid, &Instance::at(identity))
    }

    /// The texel at a point; nothing outside the box.
    pub fn texel(&self, point: [f32; 3]) -> Option<[f32; 4]> {
        let p_grid = aogrid_grid_position(&self.occluder, point);
        aogrid_is_inside(p_grid).then(|| self.texture.sample(p_grid))
    }

    /// AO of the cone.
    pub fn cone(&self, point: [f32; 3], normal: [f32; 3]) -> f32 {
        1.0 - aogrid_cone(&self.occluder, &self.texture, &self.table, point, normal)
    }

    /// AO without the direction.
    pub fn occlusion(&self, point: [f32; 3], on_itself: bool) -> f32 {
        1.0 - aogrid_occlusion_of_cone(&self.occluder, &self.texture, point, on_itself)
    }
}

/// The places in memory of the eight cells that a look-up at `point` reads; none outside.
pub fn cells_around(spec: &GridSpec, point: [f64; 3]) -> Option<[usize; 8]> {
    let mut base = [0; 3];
    for x in 0..3 {
        let (c, e) = (
            f64::from(spec.center()[x]),
            f64::from(spec.half_extents()[x]),
        );
        let grid_space = (point[x] - c) / (2.0 * e) + 0.5;
        if !(0.0..=1.0).contains(&grid_space) {
            return None;
        }
        let n = f64::from(spec.resolution()[x]);
        let in_cells = (grid_space * n - 0.5).clamp(0.0, n - 1.0);
        base[x] = (in_cells.floor() as u32).min(spec.resolution()[x] - 2);
    }
    let corner = |c: usize, x: usize| base[x] + (c >> x & 1) as u32;
    Some(std::array::from_fn(|c| {
        spec.cell_idx(std::array::from_fn(|x| corner(c, x)))
    }))
}
