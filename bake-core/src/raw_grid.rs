//! The output of a baker: the moments of every cell.

use aogrid_grid_format::GridSpec;

use crate::SignedLayers;

/// The moments of the occluded directions of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// Moment 0: the occluded fraction of the sphere, 0..1 (RR-5779 eq. 5).
    pub a: f32,
    /// Moment 1: (1/4π) ∫ ω dω over the occluded directions ω, in object axes. Its length is
    /// a(1 − a) for a circular cone, and never more.
    pub m: [f32; 3],
}

impl Moments {
    /// Returns the axis d = m/|m|, from the cell toward the object; zero if m is zero.
    pub fn axis(&self) -> [f32; 3] {
        let m = self.m.map(f64::from);
        let length = m.iter().map(|v| v * v).sum::<f64>().sqrt();
        if length == 0.0 {
            return [0.0; 3];
        }
        m.map(|v| (v / length).clamp(-1.0, 1.0) as f32)
    }

    /// Returns v = m/(a(1 − a)), the moment in units of that of a cone with the same fraction: its
    /// length is 1 for a cone, less for directions that are spread out, and never more. Where
    /// nothing or everything is occluded, it is the axis, or zero if m is zero.
    pub fn normalized_moment(&self) -> [f32; 3] {
        let a = f64::from(self.a);
        let of_cone = a * (1.0 - a);
        if of_cone <= 0.0 {
            return self.axis();
        }
        let v = self.m.map(|m| f64::from(m) / of_cone);
        // Directions are sampled, so that a moment may exceed the bound by a little.
        let length = v.iter().map(|v| v * v).sum::<f64>().sqrt().max(1.0);
        v.map(|v| (v / length) as f32)
    }
}

/// The occlusion of every cell in single precision, before post-processing.
#[derive(Clone, Debug, PartialEq)]
pub struct RawGrid {
    /// The grid's box and resolution.
    pub spec: GridSpec,
    /// The moments of each cell, x fastest.
    pub moments: Vec<Moments>,
    /// The number of occluded directions of each cell, x fastest. It tells interior cells:
    /// `count == directions` is exact, whereas a float sum need not reach 1.
    pub counts: Vec<u32>,
    /// The number of directions tested per cell.
    pub directions: u32,
    /// The signed layers around the cells, which tell the interior of an open mesh. `None` for a
    /// mesh without unbalanced edges and if the options do not need them: then only
    /// [enclosed](RawGrid::is_enclosed) cells are interior.
    pub layers: Option<SignedLayers>,
}

impl RawGrid {
    /// Whether every direction of the cell at `idx` is occluded.
    pub fn is_enclosed(&self, idx: usize) -> bool {
        self.counts[idx] == self.directions
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_is_a_unit_vector_or_zero() {
        let moments = |m| Moments { a: 0.5, m };
        assert_eq!(moments([0.0; 3]).axis(), [0.0; 3]);
        assert_eq!(moments([0.0, -0.25, 0.0]).axis(), [0.0, -1.0, 0.0]);
        // Squares of these underflow in f32.
        assert_eq!(moments([3e-30, 0.0, 4e-30]).axis(), [0.6, 0.0, 0.8]);
    }

    #[test]
    fn the_normalized_moment_is_one_for_a_cone_and_never_more() {
        let v = |a, m| Moments { a, m }.normalized_moment();
        assert_eq!(v(0.5, [0.0, 0.25, 0.0]), [0.0, 1.0, 0.0]);
        assert_eq!(v(0.5, [0.0, 0.125, 0.0]), [0.0, 0.5, 0.0]);
        assert_eq!(v(0.5, [0.0, 0.0, -0.3]), [0.0, 0.0, -1.0]);
        assert_eq!(v(0.0, [0.0; 3]), [0.0; 3]);
        assert_eq!(v(1.0, [0.0; 3]), [0.0; 3]);
        assert_eq!(v(1.0, [0.0, 1e-9, 0.0]), [0.0, 1.0, 0.0]);
    }
}
