//! The finer lattice of points near the surface.

use aogrid_grid_format::{GridSpec, SpecError};

use crate::mesh::Bounds;

/// The points a cell along each axis. Twice as many leave no points in the planes of the bounding
/// box's faces, where much of what is seen lies; three times as many gain nothing.
const DENSITY: f64 = 2.25;

/// The cells that the lattice reaches beyond the layers around the bounding box: the look-ups that
/// read a neighbor of a cell that the surface crosses end two cells outside.
const MARGIN_CELLS: f64 = 2.0;

/// Returns the lattice for the grid `spec` around an object with these bounds, as a grid whose
/// cells' centers are its points. Along each axis its points include the two layers of cell centers
/// just outside the bounding box.
///
/// # Errors
///
/// The lattice has more points than a grid may have cells.
pub(crate) fn lattice(spec: &GridSpec, bounds: &Bounds) -> Result<GridSpec, SpecError> {
    let size = spec.cell_size();
    let half_extents = bounds.half_extents();
    let axes = [0, 1, 2].map(|x| {
        let layers = layers_apart(half_extents[x] / size[x], spec.resolution()[x]);
        // A flat object has one cell between its layers: an odd number of steps has no points on it.
        let steps = (DENSITY * layers).round().max(3.0);
        let step = layers * size[x] / steps;
        let margin = (MARGIN_CELLS * size[x] / step).ceil();
        let points = steps + 1.0 + 2.0 * margin;
        (points as u32, (0.5 * points * step) as f32)
    });
    GridSpec::new(axes.map(|(n, _)| n), spec.center(), axes.map(|(_, e)| e))
}

/// Returns the number of cells between the two layers of cell centers just outside an object with
/// half-extent `half` in cells, along an axis with `n` cells; at most between the outer layers.
fn layers_apart(half: f64, n: u32) -> f64 {
    // Centers lie at odd multiples of half a cell from the middle for even n, at even ones for odd.
    let parity = f64::from(1 - n % 2);
    let from_middle = ((half - 0.5 * parity).ceil() + 0.5 * parity).max(0.5 * parity);
    let apart = 2.0 * if from_middle == 0.0 { 1.0 } else { from_middle };
    apart.min(f64::from(n - 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Extent, Placement};

    #[test]
    fn layers_are_those_just_outside() {
        // Even: centers at ½, 1½, 2½ …; odd: at 0, 1, 2 …
        for (half, n, apart) in [
            (2.48, 32, 5.0),
            (2.6, 32, 7.0),
            (0.0, 32, 1.0),
            (0.4, 32, 1.0),
            (1.98, 33, 4.0),
            (0.0, 33, 2.0),
            (99.0, 32, 31.0),
        ] {
            assert_eq!(layers_apart(half, n), apart, "{half} {n}");
        }
    }

    #[test]
    fn points_lie_on_the_layers_around_the_box() {
        let bounds = Bounds {
            min: [-1.0, -0.5, -0.25],
            max: [1.0, 0.5, 0.25],
        };
        for resolution in [[32; 3], [17, 24, 33]] {
            let placement = Placement {
                resolution,
                extent: Extent::Epsilon(0.8),
                snap: true,
            };
            let spec = placement.place(&bounds).unwrap();
            let points = lattice(&spec, &bounds).unwrap();
            for x in 0..3 {
                let (size, step) = (spec.cell_size()[x], points.cell_size()[x]);
                let n = points.resolution()[x];
                let coordinates: Vec<f64> = (0..n)
                    .map(|i| step * (f64::from(i) - 0.5 * f64::from(n - 1)))
                    .collect();
                // The layer is 0.02 cells outside; half-extents are rounded to single floats.
                let layer = bounds.half_extents()[x] + 0.02 * size;
                let nearest = |at: f64| {
                    let distances = coordinates.iter().map(|c| (c - at).abs());
                    distances.fold(f64::INFINITY, f64::min)
                };
                assert!(nearest(layer) < 1e-5 * size && nearest(-layer) < 1e-5 * size);
                let beyond = (coordinates[n as usize - 1] - layer) / size;
                assert!((2.0..2.6).contains(&beyond), "{beyond}");
                assert!((2.0..2.5).contains(&(size / step)), "{}", size / step);
            }
        }
    }
}
