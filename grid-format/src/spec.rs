//! The box of a grid and its division into cells.

/// The minimum number of cells along an axis. With fewer, the two-cell margins of the placement
/// (RR-5779 eq. 4, padded) would leave no cells for the object itself.
pub const MIN_RESOLUTION: u32 = 8;

/// The maximum number of cells along an axis: the 3D texture size that WebGPU guarantees.
pub const MAX_RESOLUTION: u32 = 2048;

/// The maximum number of cells of a grid, 512³: at 16 bytes per cell a 32-bit machine
/// (WebAssembly) can address all of it.
pub const MAX_CELLS: u64 = 1 << 27;

/// An axis-aligned box in object space, divided into `resolution` cells.
///
/// Cell (i, j, k) has its center at `((i + ½)/nx, (j + ½)/ny, (k + ½)/nz)` of the box, as a
/// texture of that size has its texel centers. Cells are stored x fastest.
///
/// The box of a model far from zero, as at map coordinates, is relative to an
/// [origin](GridSpec::origin): single floats there are too coarse for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridSpec {
    resolution: [u32; 3],
    center: [f32; 3],
    half_extents: [f32; 3],
    origin: [f64; 3],
}

/// The reason that a resolution and a box do not describe a grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpecError {
    /// Too few or too many cells along one axis.
    #[error("resolution {0} is outside {MIN_RESOLUTION}..={MAX_RESOLUTION} cells per axis")]
    Resolution(u32),
    /// Too many cells in all.
    #[error("{} × {} × {} cells exceed the maximum of {MAX_CELLS} per grid", .0[0], .0[1], .0[2])]
    TooManyCells([u32; 3]),
    /// The box reaches beyond the range of a single-precision float.
    #[error("the box is not finite along {0}")]
    NotFinite(&'static str),
    /// The box has no size along an axis.
    #[error("half-extent {1} along {0} must be greater than zero")]
    HalfExtent(&'static str, f32),
}

impl GridSpec {
    /// Creates a grid of `resolution` cells over `center ± half_extents` (object units).
    ///
    /// # Errors
    ///
    /// A resolution is outside [`MIN_RESOLUTION`]..=[`MAX_RESOLUTION`], there are more than
    /// [`MAX_CELLS`] cells in all, the center is not finite, or a half-extent is not positive and
    /// finite.
    pub fn new(
        resolution: [u32; 3],
        center: [f32; 3],
        half_extents: [f32; 3],
    ) -> Result<Self, SpecError> {
        if let Some(&n) = resolution
            .iter()
            .find(|n| !(MIN_RESOLUTION..=MAX_RESOLUTION).contains(n))
        {
            return Err(SpecError::Resolution(n));
        }
        let cells: u64 = resolution.iter().map(|&n| u64::from(n)).product();
        if cells > MAX_CELLS {
            return Err(SpecError::TooManyCells(resolution));
        }
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let (c, e) = (center[axis], half_extents[axis]);
            // Both ends must be finite, too: renderers compute with them.
            if !((c - e).is_finite() && (c + e).is_finite()) {
                return Err(SpecError::NotFinite(name));
            }
            if e < f32::MIN_POSITIVE {
                return Err(SpecError::HalfExtent(name, e));
            }
        }
        Ok(Self {
            resolution,
            center,
            half_extents,
            origin: [0.0; 3],
        })
    }

    /// Returns the same grid with its center relative to `origin`, in object units.
    ///
    /// # Errors
    ///
    /// The origin is not finite.
    pub fn with_origin(self, origin: [f64; 3]) -> Result<Self, SpecError> {
        for (v, name) in origin.into_iter().zip(["x", "y", "z"]) {
            if !v.is_finite() {
                return Err(SpecError::NotFinite(name));
            }
        }
        Ok(Self { origin, ..self })
    }

    /// Returns the number of cells along x, y and z.
    pub fn resolution(&self) -> [u32; 3] {
        self.resolution
    }

    /// Returns the point in object space that the box's center is relative to, in object units. It is
    /// zero but for models far from zero.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// Returns the box's center, in object units and relative to the [origin](GridSpec::origin).
    pub fn center(&self) -> [f32; 3] {
        self.center
    }

    /// Returns half the box's size along each axis, in object units.
    pub fn half_extents(&self) -> [f32; 3] {
        self.half_extents
    }

    /// Returns the number of cells, `nx · ny · nz`.
    pub fn cell_count(&self) -> usize {
        self.resolution.iter().map(|&n| n as usize).product()
    }

    /// Returns the index of cell `(i, j, k)` in memory, x fastest.
    pub fn cell_idx(&self, [i, j, k]: [u32; 3]) -> usize {
        let [nx, ny, _] = self.resolution.map(|n| n as usize);
        (k as usize * ny + j as usize) * nx + i as usize
    }

    /// Returns the cell with index `idx`: the inverse of [`GridSpec::cell_idx`].
    pub fn cell_at(&self, idx: usize) -> [u32; 3] {
        let [nx, ny, _] = self.resolution.map(|n| n as usize);
        [
            (idx % nx) as u32,
            (idx / nx % ny) as u32,
            (idx / (nx * ny)) as u32,
        ]
    }

    /// Returns the size of one cell along each axis, in object units.
    pub fn cell_size(&self) -> [f64; 3] {
        std::array::from_fn(|x| {
            2.0 * f64::from(self.half_extents[x]) / f64::from(self.resolution[x])
        })
    }

    /// Returns the sample point of cell `(i, j, k)` relative to the box's center, in object units:
    /// the cell's center plus `offset` cells. If `offset` is zero, mirrored cells have exactly
    /// opposite coordinates.
    pub fn sample_from_center(&self, cell: [u32; 3], offset: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|x| {
            let n = f64::from(self.resolution[x]);
            let twice = f64::from(2 * cell[x] + 1) - n + 2.0 * offset[x];
            f64::from(self.half_extents[x]) * (twice / n)
        })
    }

    /// Whether `cell` lies at the grid's boundary: first or last along some axis.
    pub fn is_outer(&self, cell: [u32; 3]) -> bool {
        (0..3).any(|x| cell[x] == 0 || cell[x] + 1 == self.resolution[x])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_cell_centers() {
        let spec = GridSpec::new([8, 16, 32], [9.0; 3], [4.0, 8.0, 32.0]).unwrap();
        assert_eq!(spec.cell_size(), [1.0, 1.0, 2.0]);
        assert_eq!(
            spec.sample_from_center([0, 0, 31], [0.0; 3]),
            [-3.5, -7.5, 31.0]
        );
        assert_eq!(
            spec.sample_from_center([4, 8, 16], [0.25, 0.0, -0.5]),
            [0.75, 0.5, 0.0]
        );
    }

    #[test]
    fn mirrored_cells_have_exactly_opposite_samples() {
        let spec = GridSpec::new([11, 32, 9], [0.1; 3], [0.3, 1.7, 2.9]).unwrap();
        for idx in 0..spec.cell_count() {
            let cell = spec.cell_at(idx);
            assert_eq!(spec.cell_idx(cell), idx);
            let mirrored = std::array::from_fn(|x| spec.resolution()[x] - 1 - cell[x]);
            let opposite = spec.sample_from_center(mirrored, [0.0; 3]);
            assert_eq!(
                spec.sample_from_center(cell, [0.0; 3]),
                opposite.map(|v| -v),
                "{cell:?}"
            );
        }
    }

    #[test]
    fn invalid_sizes_are_refused() {
        let new = |n, c, e| GridSpec::new([n, 32, 32], [c, 0.0, 0.0], [1.0, e, 1.0]);
        assert_eq!(new(7, 0.0, 1.0), Err(SpecError::Resolution(7)));
        assert_eq!(new(2049, 0.0, 1.0), Err(SpecError::Resolution(2049)));
        assert_eq!(new(8, f32::NAN, 1.0), Err(SpecError::NotFinite("x")));
        assert_eq!(new(8, 0.0, f32::INFINITY), Err(SpecError::NotFinite("y")));
        assert_eq!(new(8, 0.0, 0.0), Err(SpecError::HalfExtent("y", 0.0)));
        assert_eq!(new(8, 0.0, -1.0), Err(SpecError::HalfExtent("y", -1.0)));
        assert_eq!(
            GridSpec::new([2048, 2048, 33], [0.0; 3], [1.0; 3]),
            Err(SpecError::TooManyCells([2048, 2048, 33]))
        );
    }
}
