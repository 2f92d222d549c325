//! Placement of the grid around the object: RR-5779 eq. 4, with margins where it gives none, and
//! with cells that meet the object's faces.

use aogrid_grid_format::{GridSpec, SpecError};

use crate::mesh::Bounds;

/// Minimum margin on each side of the object, in cells.
const MARGIN_CELLS: f64 = 2.0;

/// Minimum half-extent of the box, as a fraction of the object's largest half-extent. Eq. 4 gives a
/// rod no width at all; cells 16 times finer across the rod than along it are fine enough.
const MIN_RELATIVE_EXTENT: f64 = 1.0 / 16.0;

/// The distance of a snapped layer of cell centers from the face of the bounding box, in cells:
/// outside despite all rounding, and near enough to be the sample that a receiver on the face sees.
const SNAP_DISTANCE: f64 = 0.02;

/// The smallest factor by which snapping may shrink cells, and the box with them, which the far field
/// needs to be large. A plate thinner than that has both of its layers outside already.
const MIN_SNAP_FACTOR: f64 = 0.55;

/// The resolution and the size of a grid around an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Number of cells along x, y and z.
    pub resolution: [u32; 3],
    /// The size of the box.
    pub extent: Extent,
    /// Whether a box that is computed from ε is stretched or shrunk until a layer of cell centers
    /// lies just outside each face of the object's bounding box, so that what touches the object
    /// meets a sample of free space. Given half-extents are kept.
    pub snap: bool,
}

/// The size of a grid's box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// The box ends where the occlusion by the object's bounding box is about ε > 0 (RR-5779 eq.
    /// 4).
    Epsilon(f32),
    /// The box has these half-extents, in object units.
    HalfExtents([f32; 3]),
}

/// The reason that no grid can be placed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlacementError {
    /// ε is not positive and finite.
    #[error("epsilon {0} must be greater than zero and finite")]
    Epsilon(f32),
    /// The object is a point.
    #[error("the mesh has no extent: all its vertices are at one point")]
    NoExtent,
    /// The resolution or the resulting box is invalid.
    #[error("the grid's box is invalid")]
    Spec(#[from] SpecError),
}

impl Placement {
    /// Returns the placement of the papers: 32³ cells and ε = 0.1.
    pub fn paper() -> Self {
        Self {
            resolution: [32; 3],
            extent: Extent::Epsilon(0.1),
            snap: false,
        }
    }

    /// Returns the grid around an object with these bounds, centered on the bounding box.
    ///
    /// # Errors
    ///
    /// ε is not positive and finite, the object has no extent, or the resolution or the box is not
    /// valid for a grid.
    pub fn place(&self, bounds: &Bounds) -> Result<GridSpec, PlacementError> {
        let half_extents = match self.extent {
            Extent::HalfExtents(given) => given,
            Extent::Epsilon(epsilon) if epsilon > 0.0 && epsilon.is_finite() => {
                self.half_extents(bounds.half_extents(), f64::from(epsilon))?
            }
            Extent::Epsilon(epsilon) => return Err(PlacementError::Epsilon(epsilon)),
        };
        Ok(
            GridSpec::new(self.resolution, bounds.center(), half_extents)?
                .with_origin(bounds.origin)?,
        )
    }

    /// Returns the box's half-extents by RR-5779 eq. 4, around an object with half-extents `r`.
    fn half_extents(&self, r: [f64; 3], epsilon: f64) -> Result<[f32; 3], PlacementError> {
        let largest = r.into_iter().fold(0.0, f64::max);
        if largest == 0.0 {
            return Err(PlacementError::NoExtent);
        }
        Ok(std::array::from_fn(|i| {
            let area = 4.0 * r[(i + 1) % 3] * r[(i + 2) % 3];
            let eq_4 = r[i] + (area / (4.0 * std::f64::consts::PI * epsilon)).sqrt();
            let n = f64::from(self.resolution[i]);
            let with_margin = r[i] / (1.0 - 2.0 * MARGIN_CELLS / n);
            let extent = eq_4.max(with_margin).max(MIN_RELATIVE_EXTENT * largest);
            match self.snap {
                true => snapped(extent, r[i], self.resolution[i]) as f32,
                false => extent as f32,
            }
        }))
    }
}

/// Returns the half-extent nearest to `extent` with which a layer of the `n` cells' centers lies
/// just outside a face at `r`; `extent` itself around a plate thinner than its cells.
fn snapped(extent: f64, r: f64, n: u32) -> f64 {
    let n = f64::from(n);
    let (size, half) = (2.0 * extent / n, if n % 2.0 == 0.0 { 0.5 } else { 0.0 });
    // Centers lie at (layer + half) cells from the middle, and the first of them around a thin plate.
    let first = 1.0 - 2.0 * half;
    let snapped_to = |layer: f64| r / (layer + half - SNAP_DISTANCE);
    let nearest = (r / size - half).round().max(first);
    // The neighboring layer may change the cells less.
    let candidates = [nearest, nearest + 1.0].map(snapped_to);
    let change = |snapped: f64| (snapped / size).ln().abs();
    let snapped_size = match change(candidates[1]) < change(candidates[0]) {
        true => candidates[1],
        false => candidates[0],
    };
    match snapped_size >= MIN_SNAP_FACTOR * size {
        true => 0.5 * n * snapped_size,
        false => extent,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn half_extents(r: [f32; 3]) -> [f32; 3] {
        let bounds = Bounds {
            min: r.map(|v| 5.0 - v),
            max: r.map(|v| 5.0 + v),
            origin: [0.0; 3],
        };
        let spec = Placement::paper().place(&bounds).unwrap();
        assert_eq!(spec.center(), [5.0; 3]);
        spec.half_extents()
    }

    #[test]
    fn the_box_of_a_cube_follows_eq_4() {
        // e = r + √(4 r² / (4π · 0.1)) = r (1 + 1/√(0.1π)) = 2.784 r.
        let e = half_extents([0.5; 3]);
        let expected = 0.5 * (1.0 + (0.1 * std::f32::consts::PI).sqrt().recip());
        for v in e {
            assert!((v - expected).abs() < 1e-6, "{v}");
        }
    }

    #[test]
    fn the_box_is_relative_to_the_origin_of_the_bounds() {
        let bounds = Bounds {
            min: [-1.0; 3],
            max: [1.0; 3],
            origin: [5e5, 4.5e6, 0.1],
        };
        let spec = Placement::paper().place(&bounds).unwrap();
        assert_eq!((spec.center(), spec.origin()), ([0.0; 3], bounds.origin));
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
    fn snapped_layers_lie_just_outside_the_faces() {
        for (r, resolution) in [
            ([1.0, 1.0, 1.0], [32, 33, 48]),
            ([3.0, 0.5, 0.11], [16, 8, 9]),
            ([1.0, 0.02, 0.07], [32; 3]),
        ] {
            let bounds = Bounds {
                origin: [0.0; 3],
                min: r.map(|v: f32| -v),
                max: r,
            };
            let placed = |snap| {
                let extent = Extent::Epsilon(0.8);
                let placement = Placement {
                    resolution,
                    extent,
                    snap,
                };
                placement.place(&bounds).unwrap()
            };
            let (free, snapped) = (placed(false), placed(true));
            for x in 0..3 {
                let n = resolution[x];
                let centers = (0..n).map(|i| f64::from(2 * i + 1) - f64::from(n));
                let size = snapped.cell_size()[x];
                let outside = centers
                    .map(|twice| 0.5 * twice - f64::from(r[x]) / size)
                    .find(|beyond| *beyond > 0.0)
                    .unwrap();
                assert!(
                    (outside - SNAP_DISTANCE).abs() < 1e-4,
                    "{r:?} {x}: {outside}"
                );
                let change = snapped.half_extents()[x] / free.half_extents()[x];
                assert!((0.55..1.9).contains(&change), "{r:?} {x}: {change}");
            }
        }
        // A sheet has no faces to meet along its normal.
        let sheet = Bounds {
            origin: [0.0; 3],
            min: [-1.0, 0.0, -1.0],
            max: [1.0, 0.0, 1.0],
        };
        let placement = Placement {
            snap: true,
            ..Placement::paper()
        };
        let [_, y, _] = placement.place(&sheet).unwrap().half_extents();
        assert!((y - 1.0 / (0.1 * std::f32::consts::PI).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn points_and_invalid_numbers_are_refused() {
        let bounds = |min, max| Bounds {
            min,
            max,
            origin: [0.0; 3],
        };
        let place = |extent, bounds: &Bounds| {
            Placement {
                extent,
                ..Placement::paper()
            }
            .place(bounds)
        };
        let point = bounds([1.0; 3], [1.0; 3]);
        let unit = bounds([0.0; 3], [1.0; 3]);
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
        let huge = bounds([-3e38; 3], [3e38; 3]);
        assert!(matches!(
            place(Extent::Epsilon(0.1), &huge),
            Err(PlacementError::Spec(_))
        ));
        // A point is valid if the box is given.
        assert!(place(Extent::HalfExtents([1.0; 3]), &point).is_ok());
    }
}
