//! Where the grid lies around the object: RR-5779 eq. 4, with margins where it gives none.

use aogrid_grid_format::{GridSpec, SpecError};

use crate::mesh::Bounds;

/// Cells of margin on each side of the object, at least.
const MARGIN_CELLS: f64 = 2.0;

/// The thinnest the box may be, as a fraction of the object's largest half-extent. Eq. 4 gives
/// a rod no width at all; cells 16 times finer across than along are fine enough.
const THINNEST: f64 = 1.0 / 16.0;

/// How a grid is laid around an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Cells along x, y and z.
    pub resolution: [u32; 3],
    /// How far the box reaches.
    pub extent: Extent,
}

/// How far a grid's box reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// To where the occlusion of the object's bounding box is about ε (RR-5779 eq. 4), above 0.
    Epsilon(f32),
    /// By these half-extents, in object units.
    HalfExtents([f32; 3]),
}

/// Why no grid can be placed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlacementError {
    /// Not a usable ε.
    #[error("epsilon {0} is not above zero and finite")]
    Epsilon(f32),
    /// The object is a point.
    #[error("the mesh has no extent: all its vertices are at one point")]
    NoExtent,
    /// What comes out is no grid.
    #[error("the grid's box is impossible")]
    Spec(#[from] SpecError),
}

impl Default for Placement {
    /// 32³ cells and ε = 0.1, the papers' choice.
    fn default() -> Self {
        Self {
            resolution: [32; 3],
            extent: Extent::Epsilon(0.1),
        }
    }
}

impl Placement {
    /// The grid around an object with these bounds, centred on the bounding box.
    ///
    /// # Errors
    ///
    /// An ε that is not positive, an object without extent, or numbers that are no grid.
    pub fn place(&self, bounds: &Bounds) -> Result<GridSpec, PlacementError> {
        let half_extents = match self.extent {
            Extent::HalfExtents(given) => given,
            Extent::Epsilon(epsilon) if epsilon > 0.0 && epsilon.is_finite() => {
                self.formula(bounds.half_extents(), f64::from(epsilon))?
            }
            Extent::Epsilon(epsilon) => return Err(PlacementError::Epsilon(epsilon)),
        };
        Ok(GridSpec::new(
            self.resolution,
            bounds.center(),
            half_extents,
        )?)
    }

    fn formula(&self, r: [f64; 3], epsilon: f64) -> Result<[f32; 3], PlacementError> {
        let largest = r.into_iter().fold(0.0, f64::max);
        if largest == 0.0 {
            return Err(PlacementError::NoExtent);
        }
        Ok(std::array::from_fn(|i| {
            let area = 4.0 * r[(i + 1) % 3] * r[(i + 2) % 3];
            let printed = r[i] + (area / (4.0 * std::f64::consts::PI * epsilon)).sqrt();
            let n = f64::from(self.resolution[i]);
            let with_margin = r[i] / (1.0 - 2.0 * MARGIN_CELLS / n);
            printed.max(with_margin).max(THINNEST * largest) as f32
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn half_extents(r: [f32; 3]) -> [f32; 3] {
        let bounds = Bounds {
            min: r.map(|v| 5.0 - v),
            max: r.map(|v| 5.0 + v),
        };
        let spec = Placement::default().place(&bounds).unwrap();
        assert_eq!(spec.center(), [5.0; 3]);
        spec.half_extents()
    }

    #[test]
    fn a_cube_gets_the_papers_three_radii() {
        // e = r + √(4 r² / (4π · 0.1)) = r (1 + 1/√(0.1π)) = 2.784 r.
        let e = half_extents([0.5; 3]);
        let expected = 0.5 * (1.0 + (0.1 * std::f32::consts::PI).sqrt().recip());
        for v in e {
            assert!((v - expected).abs() < 1e-6, "{v}");
        }
    }

    #[test]
    fn the_long_axis_gets_the_thinner_margin() {
        let [x, y, z] = half_extents([2.0, 0.5, 0.5]);
        assert!(x - 2.0 < y - 0.5);
        assert_eq!(y, z);
    }

    #[test]
    fn sheets_and_rods_get_margins() {
        let [x, y, z] = half_extents([1.0, 0.0, 1.0]);
        assert!((x - 1.0 / (1.0 - 4.0 / 32.0)).abs() < 1e-6);
        assert_eq!(x, z);
        assert!((y - 1.0 / (0.1 * std::f32::consts::PI).sqrt()).abs() < 1e-6);

        let [x, y, z] = half_extents([1.0, 0.0, 0.0]);
        assert!(x > 1.0);
        assert_eq!([y, z], [1.0 / 16.0; 2]);
    }

    #[test]
    fn refuses_points_and_senseless_numbers() {
        let at = |min, max| Bounds { min, max };
        let place = |extent, bounds: &Bounds| {
            Placement {
                extent,
                ..Placement::default()
            }
            .place(bounds)
        };
        let point = at([1.0; 3], [1.0; 3]);
        let unit = at([0.0; 3], [1.0; 3]);
        assert_eq!(
            place(Extent::Epsilon(0.1), &point),
            Err(PlacementError::NoExtent)
        );
        assert_eq!(
            place(Extent::Epsilon(0.0), &unit),
            Err(PlacementError::Epsilon(0.0))
        );
        assert!(matches!(
            place(Extent::Epsilon(f32::NAN), &unit),
            Err(PlacementError::Epsilon(_))
        ));
        assert!(matches!(
            place(Extent::HalfExtents([1.0, 0.0, 1.0]), &unit),
            Err(PlacementError::Spec(SpecError::HalfExtent("y", _)))
        ));
        let huge = at([-3e38; 3], [3e38; 3]);
        assert!(matches!(
            place(Extent::Epsilon(0.1), &huge),
            Err(PlacementError::Spec(_))
        ));
        // A point is fine where the box is given.
        assert!(place(Extent::HalfExtents([1.0; 3]), &point).is_ok());
    }
}
