//! The integer lattice of a prepared mesh's vertices.

use aogrid_grid_format::GridSpec;

use super::PrepareError;
use crate::mesh::Bounds;

/// Maximum number of fractional bits: 2⁻¹⁹ of a cell is far below the resolution of an image of a
/// few hundred texels across, and such that 32 cells fit [`COORDINATE_BITS`].
const MAX_BITS: u32 = 19;

/// Limits on the size of a mesh relative to a grid, and on the shape of the cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Minimum number of fractional bits: the lattice spacing is at most 2^-`min_bits` of a cell.
    /// It bounds the distance of a mesh from the first sample: see [`COORDINATE_BITS`].
    pub min_bits: u32,
    /// Maximum ratio of a cell's length to its width.
    pub max_stretch: f64,
}

impl Limits {
    /// The limits of the direction sweep. At 2⁻¹³ of a cell a mesh may reach 2048 cells, the size
    /// of the largest grid; a coarser lattice would be visible. Slopes in cells grow with the
    /// stretch, and the precision of the sweep's single-precision floats falls in proportion.
    pub(crate) const SWEEP: Self = Self {
        min_bits: 13,
        max_stretch: 64.0,
    };

    /// The limits of signed layers, which are exact integers and classify whole cells.
    pub(crate) const LAYERS: Self = Self {
        min_bits: 4,
        max_stretch: 65_536.0,
    };
}

/// Bits of a coordinate's magnitude, which is at most 2²⁴: a single-precision float holds it
/// exactly, and products of two differences of coordinates, as in orientation tests, stay below
/// 2⁵².
const COORDINATE_BITS: u32 = 24;

/// 1.5 · 2⁵²: added to a number of magnitude below 2⁵¹, it rounds off the fraction, ties to even.
const ROUNDING_BIAS: f64 = 1.5 * (1_u64 << 52) as f64;

/// An integer lattice in which the sample of cell (i, j, k) is at (i, j, k) · 2^bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    bits: u32,
    /// The transform from object space to the lattice is `(v − from) · per_unit + to`.
    from: [f64; 3],
    per_unit: [f64; 3],
    to: [f64; 3],
}

impl Lattice {
    pub(super) fn new(
        spec: &GridSpec,
        sample_offset: [f32; 3],
        bounds: &Bounds,
        limits: Limits,
    ) -> Result<Self, PrepareError> {
        let size = spec.cell_size();
        let [smallest, largest] = [f64::min, f64::max].map(|f| f(f(size[0], size[1]), size[2]));
        if largest > limits.max_stretch * smallest {
            return Err(PrepareError::Stretched(largest / smallest));
        }
        let from = spec.center().map(f64::from);
        // Cell 0 has its center half a cell from the box's side.
        let center: [f64; 3] = std::array::from_fn(|x| {
            (f64::from(spec.resolution()[x]) - 1.0) / 2.0 - f64::from(sample_offset[x])
        });
        let in_cells = |v: f32, x: usize| (f64::from(v) - from[x]) / size[x] + center[x];
        let reach = (0..3)
            .flat_map(|x| [in_cells(bounds.min[x], x), in_cells(bounds.max[x], x)])
            .fold(0.0, |reach: f64, v| reach.max(v.abs()));
        // The finest lattice on which all vertices fit `COORDINATE_BITS`.
        let max_reach = |bits: u32| f64::from(1_u32 << (COORDINATE_BITS - bits));
        let bits = (limits.min_bits..=MAX_BITS)
            .rev()
            .find(|&bits| reach <= max_reach(bits));
        let bits = bits.ok_or(PrepareError::TooFar(reach))?;
        let scale = f64::from(1_u32 << bits);
        Ok(Self {
            bits,
            from,
            per_unit: size.map(|size| scale / size),
            to: center.map(|v| v * scale),
        })
    }

    /// Returns the number of fractional bits: a cell is 2^bits lattice steps long along every axis.
    /// It is 19 unless the mesh reaches farther than 32 cells from the first sample.
    pub fn bits(&self) -> u32 {
        self.bits
    }

    /// Returns the maximum distance of a triangle's vertex from the first sample along any axis, in
    /// cells.
    pub fn reach(&self) -> f64 {
        f64::from(1_u32 << (COORDINATE_BITS - self.bits))
    }

    /// Returns the lattice point nearest to a position in object space. Ties are rounded to even,
    /// so that a mesh that is symmetric in the box stays so.
    pub(super) fn snap(&self, position: [f32; 3]) -> [i32; 3] {
        std::array::from_fn(|x| {
            let v = (f64::from(position[x]) - self.from[x]) * self.per_unit[x] + self.to[x];
            // `round_ties_even` would be a library call on machines without an instruction for it.
            // An unused vertex may be anywhere; casts of values that do not fit saturate.
            ((v + ROUNDING_BIAS) - ROUNDING_BIAS) as i32
        })
    }

    /// Returns a coordinate in cells, exactly.
    pub fn in_cells(&self, coordinate: i32) -> f32 {
        coordinate as f32 / (1_u32 << self.bits) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(n: u32, extents: [f32; 3], reach: f32) -> Result<Lattice, PrepareError> {
        let spec = GridSpec::new([n, 8, 8], [1.0, 2.0, 3.0], extents).unwrap();
        let bounds = Bounds {
            min: [1.0 - reach, 2.0, 3.0],
            max: [1.0 + reach, 2.0, 3.0],
            origin: [0.0; 3],
        };
        Lattice::new(&spec, [0.25, 0.0, -0.25], &bounds, Limits::SWEEP)
    }

    #[test]
    fn samples_are_whole_cells() {
        let spec = GridSpec::new([32, 8, 16], [1.0, 2.0, 3.0], [4.0, 2.0, 2.0]).unwrap();
        let offset = [0.25, 0.5, -0.5];
        let bounds = Bounds {
            min: [0.0, 1.0, 2.0],
            max: [2.0, 3.0, 4.0],
            origin: [0.0; 3],
        };
        let lattice = Lattice::new(&spec, offset, &bounds, Limits::SWEEP).unwrap();
        assert_eq!(lattice.bits(), 19);
        for cell in [[0, 0, 0], [31, 7, 15], [3, 4, 5]] {
            let sample = spec.sample_from_center(cell, offset.map(f64::from));
            let position = std::array::from_fn(|x| spec.center()[x] + sample[x] as f32);
            assert_eq!(lattice.snap(position), cell.map(|i| (i as i32) << 19));
        }
        assert_eq!(lattice.in_cells(5 << 18), 2.5);
    }

    #[test]
    fn ties_are_rounded_to_even_and_what_does_not_fit_saturates() {
        let lattice = Lattice {
            bits: 19,
            from: [0.0; 3],
            per_unit: [1.0; 3],
            to: [0.0; 3],
        };
        let snap = |v: f32| lattice.snap([v; 3])[0];
        let tied = [-2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 8_388_607.5];
        assert_eq!(tied.map(snap), [-2, -2, 0, 0, 2, 2, 8_388_608]);
        assert_eq!([0.49, -0.51, 7.0].map(snap), [0, -1, 7]);
        let far = [1e10, -1e10, 1e30, f32::INFINITY, f32::NAN].map(snap);
        assert_eq!(far, [i32::MAX, i32::MIN, i32::MAX, i32::MAX, 0]);
    }

    #[test]
    fn a_mesh_that_reaches_farther_gets_a_coarser_lattice() {
        let bits = |n, reach| lattice(n, [n as f32 / 8.0, 1.0, 1.0], reach);
        let bits = |n, reach| bits(n, reach).unwrap().bits();
        assert_eq!(
            (bits(32, 3.0), bits(64, 7.0), bits(2048, 255.0)),
            (19, 18, 13)
        );
        assert_eq!((bits(8, 1.0), bits(8, 8.0)), (19, 18));
        let far = lattice(8, [1.0; 3], 600.0);
        assert!(matches!(far, Err(PrepareError::TooFar(cells)) if cells > 2048.0));
    }

    #[test]
    fn elongated_cells_are_refused() {
        assert!(lattice(8, [63.0, 1.0, 1.0], 1.0).is_ok());
        let stretched = lattice(8, [65.0, 1.0, 1.0], 1.0);
        assert!(matches!(stretched, Err(PrepareError::Stretched(_))));
    }
}
