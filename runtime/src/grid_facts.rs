//! The facts of a grid that an occluder's shader data depend on.

use aogrid_grid_format::{Encoding, Grid, GridSpec, TexelFormat};

use crate::wgsl::AOGRID_MAX_FLATNESS;

/// The facts of a grid besides its texels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GridFacts {
    pub(crate) spec: GridSpec,
    pub(crate) encoding: Encoding,
    pub(crate) format: TexelFormat,
    /// The largest AO of facing receivers far beyond the two faces of each axis, times their distance
    /// from the center in half-extents of the hull of the outer cells' centers, squared.
    pub(crate) distant_occlusion: [f64; 3],
    /// The object's flatness, see [`BakeRecord::flatness`](aogrid_grid_format::BakeRecord::flatness).
    pub(crate) flatness: [f32; 4],
    /// The distance along its normal, in cells, at which a receiver on the object itself looks up
    /// the grid.
    pub(crate) self_offset: f32,
}

impl GridFacts {
    pub(crate) fn of(grid: &Grid) -> Self {
        let record = grid.record();
        Self {
            spec: *grid.spec(),
            encoding: grid.encoding(),
            format: grid.format(),
            distant_occlusion: distant_occlusion(grid, record.flatness),
            flatness: record.flatness,
            self_offset: record.self_offset,
        }
    }
}

/// Returns [`GridFacts::distant_occlusion`] from the outer cells.
fn distant_occlusion(grid: &Grid, flatness: [f32; 4]) -> [f64; 3] {
    let spec = grid.spec();
    let last = spec.resolution().map(|n| n - 1);
    let mut largest = [0.0_f64; 3];
    let [nx, ny, nz] = spec.resolution();
    // Rows of cells along x: whole ones on the faces across y and z, the ends of the others.
    let rows = (0..nz).flat_map(|k| (0..ny).map(move |j| [j, k]));
    let cells = rows.flat_map(|[j, k]| {
        let is_whole = j == 0 || k == 0 || j == last[1] || k == last[2];
        let step = if is_whole { 1 } else { last[0] };
        (0..nx).step_by(step as usize).map(move |i| [i, j, k])
    });
    for cell in cells {
        // The cell's center in half-extents of the hull.
        let at = [0, 1, 2].map(|x| 2.0 * f64::from(cell[x]) / f64::from(last[x]) - 1.0);
        let squares = [at[0] * at[0], at[1] * at[1], at[2] * at[2], 1.0];
        let flat: f64 = (0..4).map(|x| squares[x] * f64::from(flatness[x])).sum();
        let occlusion = continued(grid.cell(spec.cell_idx(cell))[3], flat);
        for axis in (0..3).filter(|&x| cell[x] == 0 || cell[x] == last[x]) {
            largest[axis] = largest[axis].max(occlusion);
        }
    }
    largest
}

/// Returns the limit of sin²α times the squared distance for an object that occludes the fraction `a`
/// at distance 1.
fn continued(a: f32, flatness: f64) -> f64 {
    let a = f64::from(a).min(0.5);
    let at_hull = 4.0 * a * (1.0 - a);
    at_hull / (1.0 - (flatness * at_hull).min(f64::from(AOGRID_MAX_FLATNESS)))
}
