//! Look-ups in a grid with the runtime's CPU twin of its shader library.

use aogrid_grid_format::{Grid, GridSpec};
use aogrid_runtime::shading::{aogrid_cone, aogrid_grid_position, aogrid_occlusion_of_cone};
use aogrid_runtime::{AogridOccluder, CpuTexture, Instance};

/// A cone grid with the uniform and textures for shading.
pub struct Shaded {
    /// The occluder's uniform.
    pub occluder: AogridOccluder,
    /// The grid's texture.
    pub texture: CpuTexture,
    table: CpuTexture,
}

impl Shaded {
    /// Places the grid in world space.
    ///
    /// # Panics
    ///
    /// If the instance is invalid.
    pub fn new(grid: &Grid, instance: &Instance) -> Self {
        let occluder = AogridOccluder::new(grid, instance);
        Self {
            occluder: occluder.expect("the instance is valid"),
            texture: CpuTexture::of_grid(grid),
            table: CpuTexture::transmittance_table(),
        }
    }

    /// Places the grid in object space, with the identity as its transform.
    pub fn in_object_space(grid: &Grid) -> Self {
        let identity =
            std::array::from_fn(|c| std::array::from_fn(|r| f32::from(u8::from(c == r))));
        Self::new(grid, &Instance::at(identity))
    }

    /// Returns the interpolated texel at a point, or `None` outside the box.
    pub fn texel(&self, point: [f32; 3]) -> Option<[f32; 4]> {
        let p_grid = aogrid_grid_position(&self.occluder, point);
        let is_inside = p_grid.iter().all(|x| (0.0..=1.0).contains(x));
        is_inside.then(|| self.texture.sample(p_grid))
    }

    /// Returns the AO of the cone at a point with a normal.
    pub fn cone(&self, point: [f32; 3], normal: [f32; 3]) -> f32 {
        1.0 - aogrid_cone(&self.occluder, &self.texture, &self.table, point, normal)
    }

    /// Returns the AO at a point without regard to the cone's direction.
    pub fn occlusion(&self, point: [f32; 3], on_itself: bool) -> f32 {
        1.0 - aogrid_occlusion_of_cone(&self.occluder, &self.texture, point, on_itself)
    }
}

/// Returns the indices of the eight cells that a look-up at `point` (object space) reads, or `None`
/// outside the box.
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
        // Cell i has its center at (i + ½)/n; the border cells are clamped.
        let in_cells = (grid_space * n - 0.5).clamp(0.0, n - 1.0);
        base[x] = (in_cells.floor() as u32).min(spec.resolution()[x] - 2);
    }
    let corner = |c: usize, x: usize| base[x] + (c >> x & 1) as u32;
    Some(std::array::from_fn(|c| {
        spec.cell_idx(std::array::from_fn(|x| corner(c, x)))
    }))
}
