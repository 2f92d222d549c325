//! The integer lattice on which a prepared mesh lies.

use aogrid_grid_format::GridSpec;

use super::PrepareError;
use crate::mesh::Bounds;

/// The lattice is at most this fine: 2⁻¹⁹ of a cell, far below what an image of a few hundred
/// texels across can show, and such that 32 cells fit [`COORDINATE_BITS`].
const FINEST: u32 = 19;

/// How far a mesh and a grid may differ in size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// The lattice is at least as fine as 2^-`coarsest` of a cell. It bounds the distance that a
    /// mesh may reach from the first sample: see [`COORDINATE_BITS`].
    pub coarsest: u32,
    /// A cell may be this many times longer than wide.
    pub max_stretch: f64,
}

impl Limits {
    /// Of the direction sweep. At 2⁻¹³ of a cell a mesh may reach 2048 cells, which is the
    /// largest grid; coarser would be visible. Slopes in cells grow with the stretch, and the
    /// sweep's single floats become as many times coarser.
    pub(crate) const SWEEP: Self = Self {
        coarsest: 13,
        max_stretch: 64.0,
    };

    /// Of signed layers, which are exact integers and decide about whole cells.
    pub(crate) const LAYERS: Self = Self {
        coarsest: 4,
        max_stretch: 65_536.0,
    };
}

/// A coordinate's magnitude is at most 2²⁴: a single float holds it exactly, and products of
/// two differences of coordinates, of which orientation tests are made, stay below 2⁵².
const COORDINATE_BITS: u32 = 24;

/// Points of the lattice: the sample of cell (i, j, k) is at (i, j, k) · 2^bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    bits: u32,
    /// From object space to the lattice: `(v − from) · per_unit + to`.
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
        // Cell 0 has its centre half a cell from the box's side.
        let center: [f64; 3] = std::array::from_fn(|x| {
            (f64::from(spec.resolution()[x]) - 1.0) / 2.0 - f64::from(sample_offset[x])
        });
        let in_cells = |v: f32, x: usize| (f64::from(v) - from[x]) / size[x] + center[x];
        let reach = (0..3)
            .flat_map(|x| [in_cells(bounds.min[x], x), in_cells(bounds.max[x], x)])
            .fold(0.0, |reach: f64, v| reach.max(v.abs()));
        let most = |bits: u32| f64::from(1_u32 << (COORDINATE_BITS - bits));
        let bits = (limits.coarsest..=FINEST)
            .rev()
            .find(|&bits| reach <= most(bits));
        let bits = bits.ok_or(PrepareError::TooFar(reach))?;
        let scale = f64::from(1_u32 << bits);
        Ok(Self {
            bits,
            from,
            per_unit: size.map(|size| scale / size),
            to: center.map(|v| v * scale),
        })
    }

    /// A cell is 2^bits lattice steps long, along every axis: 2¹⁹ unless the mesh reaches
    /// farther than 32 cells from the first sample.
    pub fn bits(&self) -> u32 {
        self.bits
    }

    /// No vertex of a triangle is farther from the first sample along any axis, in cells.
    pub fn reach(&self) -> f64 {
        f64::from(1_u32 << (COORDINATE_BITS - self.bits))
    }

    /// The lattice's point nearest to a position in object space. Of two equally near the even
    /// one, so that a mesh that mirrors itself in the box still does so.
    pub(super) fn snap(&self, position: [f32; 3]) -> [i32; 3] {
        std::array::from_fn(|x| {
            let v = (f64::from(position[x]) - self.from[x]) * self.per_unit[x] + self.to[x];
            // A vertex of no triangle may be anywhere; casts of what does not fit saturate.
            v.round_ties_even() as i32
        })
    }

    /// A coordinate in cells, exactly.
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
    fn a_mesh_that_reaches_farther_lies_on_a_coarser_lattice() {
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
    fn needles_are_no_cells() {
        assert!(lattice(8, [63.0, 1.0, 1.0], 1.0).is_ok());
        let stretched = lattice(8, [65.0, 1.0, 1.0], 1.0);
        assert!(matches!(stretched, Err(PrepareError::Stretched(_))));
    }
}
