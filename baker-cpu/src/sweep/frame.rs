//! The grid seen along one axis: which axis is which, and the slopes of directions in cells.

use aogrid_bake_core::PreparedMesh;

/// The number of directions in a block, a part of a texel row: what one wide register holds.
pub(super) const LANES: usize = 16;

/// The grid seen along its axis w. Rows of cells run along u; u, v, w follow each other cyclically,
/// so that (u, v, w) is right-handed.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisFrame {
    pub u: usize,
    pub v: usize,
    pub w: usize,
    /// Cells along u, v and w.
    pub n: [u32; 3],
    /// Texels along a face's side.
    pub size: u32,
    /// Cells along u, and along v, per cell along w, of a direction of slope 1 in object space.
    pub shear: [f64; 2],
}

impl AxisFrame {
    pub(super) fn new(mesh: &PreparedMesh, w: usize, size: u32) -> Self {
        let (u, v) = ((w + 1) % 3, (w + 2) % 3);
        let (n, cell) = (mesh.spec().resolution(), mesh.spec().cell_size());
        Self {
            u,
            v,
            w,
            n: [n[u], n[v], n[w]],
            size,
            shear: [cell[w] / cell[u], cell[w] / cell[v]],
        }
    }

    /// Returns the number of blocks of [`LANES`] directions in a texel row.
    pub(super) fn blocks(&self) -> usize {
        (self.size as usize).div_ceil(LANES)
    }

    /// Returns the mask of a block's lanes that are directions.
    #[inline(always)]
    pub(super) fn lanes(&self, block: usize) -> u16 {
        let n = (self.size as usize - block * LANES).min(LANES);
        u16::MAX >> (LANES - n)
    }

    /// Returns cells along u per cell along w of the directions of a block. Lanes beyond the end of
    /// the texel row continue the sequence and are never counted.
    pub(super) fn slopes(&self, block: usize) -> [f32; LANES] {
        std::array::from_fn(|lane| self.column_slope((block * LANES + lane) as u32) as f32)
    }

    /// Returns cells along u per cell along w of the directions through texel `z` of a texel row.
    pub(super) fn column_slope(&self, z: u32) -> f64 {
        self.slope(0, z)
    }

    /// Returns cells along v per cell along w of all directions of texel row `b`.
    pub(super) fn row_slope(&self, b: u32) -> f64 {
        self.slope(1, b)
    }

    fn slope(&self, across: usize, texel: u32) -> f64 {
        let size = f64::from(self.size);
        self.shear[across] * ((f64::from(2 * texel + 1) - size) / size)
    }
}
