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
    let (size, n) = (spec.cell_size(), spec.resolution());
    let center = spec.center().map(f64::from);
    let axes = [0, 1, 2].map(|x| {
        let in_cells = |v: f32| (f64::from(v) - center[x]) / size[x] + 0.5 * f64::from(n[x]);
        let [first, last] = layers_around([bounds.min[x], bounds.max[x]].map(in_cells), n[x]);
        // A flat object has one cell between its layers: an odd number of steps has no points on it.
        let steps = (DENSITY * (last - first)).round().max(3.0);
        let step = (last - first) * size[x] / steps;
        let margin = (MARGIN_CELLS * size[x] / step).ceil();
        let points = steps + 1.0 + 2.0 * margin;
        let middle = 0.5 * (first + last) - 0.5 * f64::from(n[x]);
        let center = (center[x] + middle * size[x]) as f32;
        (points as u32, center, (0.5 * points * step) as f32)
    });
    GridSpec::new(
        axes.map(|(n, ..)| n),
        axes.map(|(_, center, _)| center),
        axes.map(|(.., half_extent)| half_extent),
    )
}

/// Returns the layers of cell centers just outside an object that reaches from `min` to `max`, along
/// an axis with `n` cells, all in cells; at most the outer layers.
fn layers_around([min, max]: [f64; 2], n: u32) -> [f64; 2] {
    let (mut first, mut last) = ((min - 0.5).floor(), (max - 0.5).ceil());
    if first == last {
        // A flat object in a layer.
        (first, last) = (first - 1.0, last + 1.0);
    }
    let outer = f64::from(n - 1);
    [
        first.clamp(0.0, outer - 1.0) + 0.5,
        last.clamp(1.0, outer) + 0.5,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Extent, Placement};

    #[test]
    fn layers_are_those_just_outside() {
        // Centers lie at ½, 1½, 2½ …
        for (reach, n, layers) in [
            ([13.52, 18.48], 32, [13.5, 18.5]),
            ([13.4, 18.6], 32, [12.5, 19.5]),
            ([16.0, 16.0], 32, [15.5, 16.5]),
            ([16.5, 16.5], 33, [15.5, 17.5]),
            ([-9.0, 99.0], 32, [0.5, 31.5]),
            ([40.0, 40.0], 32, [30.5, 31.5]),
        ] {
            assert_eq!(layers_around(reach, n), layers, "{reach:?} {n}");
        }
    }

    #[test]
    fn points_lie_on_the_layers_around_the_box() {
        let bounds = Bounds {
            origin: [0.0; 3],
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
            assert_eq!(points.center(), spec.center());
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
