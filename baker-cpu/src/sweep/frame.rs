//! One axis' view of the grid: which axis is which, and how steep the directions are in cells.

use aogrid_bake_core::PreparedMesh;

/// Directions along a face's row are handled in blocks of this many: a machine's register.
pub(super) const LANES: usize = 16;

/// The grid seen along its axis w. Rows of cells run along u; u, v, w follow each other
/// cyclically, so that (u, v, w) is right-handed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub u: usize,
    pub v: usize,
    pub w: usize,
    /// Cells along u, v and w.
    pub n: [u32; 3],
    /// Texels along a face's side.
    pub size: u32,
    /// Cells along u, and v, per cell along w of a direction of slope 1 in object space.
    pub shear: [f64; 2],
}

impl Frame {
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

    /// Blocks of [`LANES`] directions in a face's row.
    pub(super) fn blocks(&self) -> usize {
        (self.size as usize).div_ceil(LANES)
    }

    /// The lanes of a block that are directions.
    #[inline(always)]
    pub(super) fn lanes(&self, block: usize) -> u16 {
        let n = (self.size as usize - block * LANES).min(LANES);
        u16::MAX >> (LANES - n)
    }

    /// Cells along u per cell along w of the directions of a block. Lanes beyond the face's
    /// side go on in the same manner; nobody counts them.
    pub(super) fn slopes(&self, block: usize) -> [f32; LANES] {
        std::array::from_fn(|lane| self.column_slope((block * LANES + lane) as u32) as f32)
    }

    /// Cells along u per cell along w of the directions through the texel `z` of a row.
    pub(super) fn column_slope(&self, z: u32) -> f64 {
        self.slope(0, z)
    }

    /// Cells along v per cell along w of all directions of the face's row `b`.
    pub(super) fn row_slope(&self, b: u32) -> f64 {
        self.slope(1, b)
    }

    fn slope(&self, across: usize, texel: u32) -> f64 {
        let size = f64::from(self.size);
        self.shear[across] * ((f64::from(2 * texel + 1) - size) / size)
    }
}
