//! Warnings about a grid that is valid but perhaps not what the user wanted.

use aogrid_grid_format::{Grid, GridSpec, Interior};

use crate::TriangleMesh;
use crate::mesh::{Bounds, MeshReport, Part};

/// The doubt above which a warning is due: more cells are guessed than known to be inside.
pub(crate) const MAX_DOUBT: f32 = 0.5;

/// The offset of self look-ups, in cells, from which a sheet sees its own side alone.
const OWN_SIDE_OFFSET: f32 = 0.5;

/// The occlusion fraction from which a cell is taken to lie inside the model.
const NEARLY_ENCLOSED: f32 = 0.99;

/// The occlusion below which a grid shades nothing: the smallest value of 8 bits.
const MIN_OCCLUSION: f32 = 1.0 / 255.0;

/// The share of a cell that a coordinate's rounding in the model's file may have.
const MAX_ROUNDING: f64 = 0.01;

/// The size in cells below which the shape of what is left without one part is lost.
const MIN_CELLS: f64 = 8.0;

/// The mean occlusion from which a grid lies inside its model.
const FULL: f64 = 0.99;

/// Returns warnings about a mesh in its grid, before the bake. `rounding` is the error of the
/// coordinates in the model's file, in object units.
pub fn mesh_warnings(mesh: &TriangleMesh, spec: &GridSpec, rounding: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    let cell = spec.cell_size();
    let smallest = cell.into_iter().fold(f64::INFINITY, f64::min);
    if rounding > MAX_ROUNDING * smallest {
        warnings.push(format!(
            "coordinates in its file are rounded by {:.2} cells, because it is far from zero: save it \
             near zero, or as OBJ with all digits",
            rounding / smallest
        ));
    }
    if let Some((name, cells)) = outlier(mesh, cell) {
        warnings.push(format!(
            "without its part `{name}` it would be {cells:.1} cells large, too small to have a shape: \
             leave it out with --without, or bake it with --parts"
        ));
    }
    warnings
}

/// Returns the name of a part without which the rest is smaller than [`MIN_CELLS`], and its size in
/// cells of these sizes. Of two such parts it is the one of fewer triangles.
fn outlier(mesh: &TriangleMesh, cell: [f64; 3]) -> Option<(&str, f64)> {
    let parts = mesh.parts();
    let bounds = |idx: usize| {
        let triangles = &mesh.triangles()[parts[idx].triangles.clone()];
        Bounds::of_triangles(mesh.positions(), triangles)
    };
    let each: Vec<Option<Bounds>> = (0..parts.len()).map(bounds).collect();
    // The bounds of all parts after each one.
    let mut after = vec![None; parts.len() + 1];
    for idx in (0..parts.len()).rev() {
        after[idx] = union(after[idx + 1], each[idx]);
    }
    let mut before = None;
    let mut found: Option<(&Part, f64)> = None;
    for (idx, part) in parts.iter().enumerate() {
        if let Some(rest) = union(before, after[idx + 1]) {
            let size = |x: usize| f64::from(rest.max[x] - rest.min[x]) / cell[x];
            let cells = (0..3).map(size).fold(0.0, f64::max);
            let is_smaller =
                |(other, _): (&Part, f64)| part.triangles.len() < other.triangles.len();
            if cells < MIN_CELLS && found.is_none_or(is_smaller) {
                found = Some((part, cells));
            }
        }
        before = union(before, each[idx]);
    }
    found.map(|(part, cells)| (part.name.as_str(), cells))
}

fn union(a: Option<Bounds>, b: Option<Bounds>) -> Option<Bounds> {
    let (Some(a), Some(b)) = (a, b) else {
        return a.or(b);
    };
    Some(Bounds {
        min: std::array::from_fn(|x| a.min[x].min(b.min[x])),
        max: std::array::from_fn(|x| a.max[x].max(b.max[x])),
        ..a
    })
}

/// Returns warnings about a fresh grid of the mesh that `report` describes.
pub fn warnings(grid: &Grid, report: &MeshReport) -> Vec<String> {
    let record = grid.record();
    let mut warnings = Vec::new();
    if let Some(inside) = &record.inside
        && inside.doubt > MAX_DOUBT
        && record.self_offset < OWN_SIDE_OFFSET
    {
        warnings.push(format!(
            "it is a sheet, or wide open: which side is inside is a guess for {} cells, and one \
             side of it may shade itself too dark: look it up half a cell along normals (self offset \
             0.5), or give it a thickness",
            inside.doubtful_cells
        ));
    }
    let largest = grid.statistics().largest;
    if largest < MIN_OCCLUSION {
        warnings.push(format!(
            "it is empty: the largest occlusion is {largest:.4}, so that it shades nothing; its box is \
             too large for the model, or its cells are"
        ));
    }
    if grid.statistics().mean >= FULL {
        warnings.push(
            "it is full: all of its cells lie inside the model; raise its half-extents".into(),
        );
    }
    if record.interior == Interior::Enclosed && !report.is_closed() && largest >= NEARLY_ENCLOSED {
        warnings.push(format!(
            "it has holes, so that cells inside see some sky and are not filled (the largest \
             occlusion is {largest:.3}): its own surface will be too dark; bake it with interior \
             `signed`"
        ));
    }
    if record.boundary.requested != record.boundary.applied {
        warnings.push(format!(
            "occlusion at the grid's boundary is {:.3}, too much for boundary `jgt`; `rr` was \
             used: a larger grid would help",
            record.boundary.v_m
        ));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Placement;

    /// Returns a mesh with a triangle a part, each at a distance along x.
    fn mesh(distances: &[f32]) -> TriangleMesh {
        let corners = |x: f32| [[x, 0.0, 0.0], [x + 1.0, 0.0, 1.0], [x, 1.0, 0.0]];
        let n = distances.len() as u32;
        TriangleMesh::new(
            distances.iter().flat_map(|x| corners(*x)).collect(),
            (0..n).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            (0..n as usize)
                .map(|t| Part {
                    name: format!("part {t}"),
                    triangles: t..t + 1,
                })
                .collect(),
        )
        .unwrap()
    }

    fn warned(mesh: &TriangleMesh, rounding: f64) -> Vec<String> {
        let spec = Placement::paper().place(&mesh.bounds()).unwrap();
        mesh_warnings(mesh, &spec, rounding)
    }

    /// Report 29, with an area: a speck far away makes the grid's box a hundred times too large.
    #[test]
    fn a_part_far_away_is_named() {
        let found = warned(&mesh(&[0.0, 400.0, 1.0, 2.0]), 0.0);
        assert!(
            found.len() == 1 && found[0].contains("`part 1`"),
            "{found:?}"
        );
        for near in [&[0.0, 1.0, 2.0][..], &[0.0], &[0.0, 2.0, 3.0, 9.0]] {
            assert!(warned(&mesh(near), 0.0).is_empty(), "{near:?}");
        }
    }

    /// Report 02, for files whose coordinates are single floats: the shape is lost already.
    #[test]
    fn coarse_coordinates_are_a_warning() {
        let near = mesh(&[0.0]);
        assert!(warned(&near, 1e-6).is_empty());
        let found = warned(&near, 0.5);
        assert!(found[0].contains("rounded"), "{found:?}");
    }
}
