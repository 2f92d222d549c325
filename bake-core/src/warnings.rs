//! Warnings about a grid that is valid but perhaps not what the user wanted.

use aogrid_grid_format::{Grid, Interior};

use crate::mesh::MeshReport;

/// The doubt above which a warning is due: more cells are guessed than known to be inside.
pub(crate) const MAX_DOUBT: f32 = 0.5;

/// The offset of self look-ups, in cells, from which a sheet sees its own side alone.
const OWN_SIDE_OFFSET: f32 = 0.5;

/// The occlusion fraction from which a cell is taken to lie inside the model.
const NEARLY_ENCLOSED: f32 = 0.99;

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
