//! Warnings about options that are valid but can hardly be meant.

use aogrid_grid_format::{GridSpec, Sampling};

use crate::{BakeOptions, TriangleMesh};

/// The size of a model in cells below which hardly a cell is near its surface.
const MIN_SIZE: f64 = 2.0;

/// The rays a cell below which noise is stronger than most shadows: the standard error of an occlusion
/// of a half is half the inverse root of their number, at this number an eighth.
const MIN_RAYS: u32 = 16;

/// Returns warnings about options that can hardly be meant for a mesh in its grid, before the bake.
pub fn option_warnings(mesh: &TriangleMesh, spec: &GridSpec, options: &BakeOptions) -> Vec<String> {
    let mut warnings = Vec::new();
    let (bounds, cell) = (mesh.bounds(), spec.cell_size());
    let half = bounds.half_extents().map(f64::from);
    let size = (0..3).map(|x| 2.0 * half[x] / cell[x]).fold(0.0, f64::max);
    if size < MIN_SIZE {
        warnings.push(format!(
            "it is {size:.2} cells large, too small to have a shape: the box is too large for it (raise \
             --epsilon, or lower --half-extents)"
        ));
    }
    let given = spec.half_extents();
    if let Some(x) = (0..3).find(|&x| f64::from(given[x]) < half[x]) {
        warnings.push(format!(
            "the box ends inside the model along {}, at {} of {}: raise --half-extents",
            ["x", "y", "z"][x],
            given[x],
            half[x]
        ));
    }
    let smallest = cell.into_iter().fold(f64::INFINITY, f64::min);
    if let Some(distance) = options.max_distance
        && f64::from(distance) < smallest
    {
        warnings.push(format!(
            "the maximum distance {distance} is less than a cell, {smallest:.4}: most cells see nothing \
             within it; raise --max-distance"
        ));
    }
    if let Sampling::MonteCarlo { count, .. } = options.sampling
        && count < MIN_RAYS
    {
        warnings.push(format!(
            "with {count} rays a cell the noise of an occlusion is up to {:.2}: raise --rays",
            0.5 / f64::from(count).sqrt()
        ));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Part;
    use crate::{Extent, Placement};

    /// Options that can hardly be meant are each named once, and those that are usual are not.
    #[test]
    fn options_that_can_hardly_be_meant_are_warned_of() {
        let corners = vec![[0.0; 3], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
        let part = Part {
            name: "part".into(),
            triangles: 0..1,
        };
        let mesh = TriangleMesh::new(corners, vec![[0, 1, 2]], vec![part]).unwrap();
        let usual = BakeOptions::paper();
        let warned = |half: f32, options: &BakeOptions| {
            let placement = Placement {
                extent: Extent::HalfExtents([half; 3]),
                ..Placement::paper()
            };
            let spec = placement.place(&mesh.bounds()).unwrap();
            option_warnings(&mesh, &spec, options)
        };
        assert!(warned(1.0, &usual).is_empty());
        let near = BakeOptions {
            max_distance: Some(0.01),
            ..usual
        };
        let few = BakeOptions {
            sampling: Sampling::MonteCarlo { count: 4, seed: 0 },
            ..usual
        };
        for (half, options, part) in [
            (20.0, &usual, "0.80 cells"),
            (0.4, &usual, "along x"),
            (1.0, &near, "--max-distance"),
            (1.0, &few, "up to 0.25"),
        ] {
            let found = warned(half, options);
            assert!(found.len() == 1 && found[0].contains(part), "{found:?}");
        }
    }
}
