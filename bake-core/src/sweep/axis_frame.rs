//! The grid seen along one axis: which axis is which, and the slopes of directions in cells.

use aogrid_grid_format::GridSpec;

use super::LANES;

/// A box of cells of a grid, seen along an axis w. Rows of cells run along u; u, v, w follow each
/// other cyclically, so that (u, v, w) is right-handed. Directions are (a, b, 1) in this frame, and
/// their opposites.
#[derive(Clone, Copy, Debug)]
pub struct AxisFrame {
    /// The indices of the axes u, v and w: 0 is x, 1 is y, 2 is z.
    pub axes: [usize; 3],
    /// The first cell of the box along u, v and w.
    pub first: [u32; 3],
    /// The number of cells of the box along u, v and w.
    pub cells: [u32; 3],
    /// Texels along a face's side.
    pub size: u32,
    /// Cells along u, and along v, per cell along w, of a direction of slope 1 in object space.
    pub shear: [f64; 2],
}

impl AxisFrame {
    /// Returns the frame of a whole grid along the axis `w`, for faces of `size`² texels.
    pub fn new(spec: &GridSpec, w: usize, size: u32) -> Self {
        Self::of_box(spec, [0; 3], spec.resolution(), w, size)
    }

    /// Returns the frame of a box of cells, given by its first cell and its numbers of cells along
    /// x, y and z.
    pub fn of_box(spec: &GridSpec, first: [u32; 3], cells: [u32; 3], w: usize, size: u32) -> Self {
        let axes = [(w + 1) % 3, (w + 2) % 3, w];
        let cell = spec.cell_size();
        let [u, v, w] = axes;
        Self {
            axes,
            first: axes.map(|x| first[x]),
            cells: axes.map(|x| cells[x]),
            size,
            shear: [cell[w] / cell[u], cell[w] / cell[v]],
        }
    }

    /// Returns the number of blocks of [`LANES`] directions in a texel row.
    #[inline]
    pub fn blocks(&self) -> usize {
        (self.size as usize).div_ceil(LANES)
    }

    /// Returns the mask of a block's lanes that are directions.
    #[inline(always)]
    pub fn lanes(&self, block: usize) -> u16 {
        let n = (self.size as usize - block * LANES).min(LANES);
        u16::MAX >> (LANES - n)
    }

    /// Returns cells along u per cell along w of the directions of a block. Lanes beyond the end of
    /// the texel row continue the sequence and are never counted.
    #[inline]
    pub fn slopes(&self, block: usize) -> [f32; LANES] {
        std::array::from_fn(|lane| self.column_slope((block * LANES + lane) as u32) as f32)
    }

    /// Returns cells along u per cell along w of the directions through texel `z` of a texel row.
    #[inline]
    pub fn column_slope(&self, z: u32) -> f64 {
        self.slope(0, z)
    }

    /// Returns cells along v per cell along w of all directions of texel row `b`.
    #[inline]
    pub fn row_slope(&self, b: u32) -> f64 {
        self.slope(1, b)
    }

    #[inline]
    fn slope(&self, across: usize, texel: u32) -> f64 {
        let size = f64::from(self.size);
        self.shear[across] * ((f64::from(2 * texel + 1) - size) / size)
    }
}
