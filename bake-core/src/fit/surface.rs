//! The surface of a mesh in a grid's cells: the cells that it crosses, and its distance.

use aogrid_grid_format::GridSpec;
use rayon::prelude::*;

use crate::TriangleMesh;

use super::closest::{closest_point, squared_distance};
use super::overlap::overlaps_cube;

/// The side of a bin, in cells.
const BIN: f64 = 0.5;

/// The maximum number of a bin's triangles that are searched for its point. Where there are more,
/// they are small, and some of them, evenly spread, are as good as all.
const MAX_SEARCHED: usize = 8;

/// The index of a bin without a point.
const NONE: u32 = u32::MAX;

/// A mesh in coordinates of a grid's cells: cell (i, j, k) reaches from (i, j, k) to (i + 1, j + 1,
/// k + 1).
pub(super) struct Surface {
    /// The number of bins along x, y and z.
    bins: [usize; 3],
    /// The index of a bin's point, x fastest, or [`NONE`] where the surface does not cross the bin.
    indices: Vec<u32>,
    /// A point of the surface in each bin that it crosses, near the bin's center.
    points: Vec<[f64; 3]>,
}

impl Surface {
    /// Finds the bins that a mesh crosses in the box of `spec`.
    pub(super) fn new(mesh: &TriangleMesh, spec: &GridSpec) -> Self {
        let (center, size) = (spec.center().map(f64::from), spec.cell_size());
        let half = spec.resolution().map(|n| 0.5 * f64::from(n));
        let in_cells =
            |p: [f32; 3]| [0, 1, 2].map(|x| (f64::from(p[x]) - center[x]) / size[x] + half[x]);
        let triangles: Vec<_> = mesh.corners().map(|t| t.map(in_cells)).collect();
        let bins = spec
            .resolution()
            .map(|n| (f64::from(n) / BIN).round() as usize);
        let bins_of = |idx: usize| bins_of(&triangles[idx], bins).map(move |bin| (bin, idx as u32));
        let pairs: Vec<(u32, u32)> = (0..triangles.len())
            .into_par_iter()
            .flat_map_iter(bins_of)
            .collect();
        let members = Members::sort(&pairs, bins.iter().product());
        let point = |bin: usize| {
            let members = members.of(bin);
            let center = [
                bin % bins[0],
                bin / bins[0] % bins[1],
                bin / (bins[0] * bins[1]),
            ]
            .map(|at| (at as f64 + 0.5) * BIN);
            let searched = members.len().min(MAX_SEARCHED);
            let candidates = (0..searched).map(|nth| {
                let member = members[nth * members.len() / searched];
                closest_point(center, triangles[member as usize])
            });
            let nearer = |p, q| match squared_distance(center, q) < squared_distance(center, p) {
                true => q,
                false => p,
            };
            candidates
                .reduce(nearer)
                .expect("a crossed bin has a triangle")
        };
        let crossed: Vec<usize> = (0..members.ends.len())
            .filter(|&bin| !members.of(bin).is_empty())
            .collect();
        let mut indices = vec![NONE; members.ends.len()];
        for (idx, &bin) in (0..).zip(&crossed) {
            indices[bin] = idx;
        }
        Self {
            bins,
            indices,
            points: crossed.into_par_iter().map(point).collect(),
        }
    }

    /// Whether the surface crosses a cell.
    pub(super) fn crosses(&self, cell: [u32; 3]) -> bool {
        let per_cell = (1.0 / BIN) as usize;
        let first = cell.map(|at| at as usize * per_cell);
        let around = (0..per_cell.pow(3)).map(|idx| {
            let offset = [
                idx % per_cell,
                idx / per_cell % per_cell,
                idx / per_cell.pow(2),
            ];
            [0, 1, 2].map(|x| first[x] + offset[x])
        });
        around
            .into_iter()
            .any(|[i, j, k]| self.indices[(k * self.bins[1] + j) * self.bins[0] + i] != NONE)
    }

    /// Returns the distance between a position and the surface, in cells, as far as the points of
    /// the bins tell: too large by up to a bin's diagonal. `max` if it is farther.
    pub(super) fn distance(&self, position: [f64; 3], max: f64) -> f64 {
        let reach = (max / BIN).ceil() as usize;
        let [xs, ys, zs] = [0, 1, 2].map(|x| {
            let home = bin_at(position[x], self.bins[x]);
            home.saturating_sub(reach)..(home + reach + 1).min(self.bins[x])
        });
        let mut nearest = max * max;
        for (k, j) in zs.flat_map(|k| ys.clone().map(move |j| (k, j))) {
            let row = (k * self.bins[1] + j) * self.bins[0];
            for &idx in &self.indices[row + xs.start..row + xs.end] {
                if idx != NONE {
                    let point = self.points[idx as usize];
                    nearest = nearest.min(squared_distance(position, point));
                }
            }
        }
        nearest.sqrt()
    }
}

/// Triangles, bin by bin.
struct Members {
    triangles: Vec<u32>,
    /// The end of each bin's triangles; a bin's start is the end of the one before it.
    ends: Vec<u32>,
}

impl Members {
    /// Sorts pairs of a bin and a triangle by bins, and keeps their order within a bin.
    fn sort(pairs: &[(u32, u32)], bins: usize) -> Self {
        let mut ends = vec![0; bins];
        pairs.iter().for_each(|&(bin, _)| ends[bin as usize] += 1);
        let mut total = 0;
        for end in &mut ends {
            // The start for now; filling the bin moves it to the end.
            (*end, total) = (total, total + *end);
        }
        let mut triangles = vec![0; pairs.len()];
        for &(bin, triangle) in pairs {
            let at = &mut ends[bin as usize];
            triangles[*at as usize] = triangle;
            *at += 1;
        }
        Self { triangles, ends }
    }

    fn of(&self, bin: usize) -> &[u32] {
        let start = if bin == 0 { 0 } else { self.ends[bin - 1] };
        &self.triangles[start as usize..self.ends[bin] as usize]
    }
}

/// Returns the bin that contains a coordinate; the nearest for one outside.
fn bin_at(coordinate: f64, bins: usize) -> usize {
    // The cast saturates.
    ((coordinate / BIN) as usize).min(bins - 1)
}

/// Returns the indices of the bins that a triangle overlaps.
fn bins_of(corners: &[[f64; 3]; 3], bins: [usize; 3]) -> impl Iterator<Item = u32> {
    let corners = *corners;
    let ranges = [0, 1, 2].map(|x| {
        let [a, b, c] = corners.map(|p| p[x]);
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        match max < 0.0 || min > bins[x] as f64 * BIN {
            true => 0..0,
            // A triangle in the face between two bins belongs to both.
            false => bin_at((min / BIN).ceil() * BIN - BIN, bins[x])..bin_at(max, bins[x]) + 1,
        }
    });
    let is_in_one = ranges.iter().all(|range| range.len() == 1);
    let [xs, ys, zs] = ranges;
    let boxes = zs.flat_map(move |k| {
        let xs = xs.clone();
        ys.clone()
            .flat_map(move |j| xs.clone().map(move |i| [i, j, k]))
    });
    boxes
        .filter(move |bin| is_in_one || overlaps_cube(&corners, bin.map(|i| i as f64 * BIN), BIN))
        .map(move |[i, j, k]| ((k * bins[1] + j) * bins[0] + i) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Placement;
    use crate::models::Model;

    #[test]
    fn cells_are_those_crossed_and_distances_are_near_those_to_all_triangles() {
        for model in [Model::Robot, Model::Torus, Model::Sheet] {
            let mesh = model.mesh(None).unwrap();
            let spec = Placement::paper().place(&mesh.bounds()).unwrap();
            let surface = Surface::new(&mesh, &spec);
            let (center, size) = (spec.center().map(f64::from), spec.cell_size());
            let in_cells =
                |p: [f32; 3]| [0, 1, 2].map(|x| (f64::from(p[x]) - center[x]) / size[x] + 16.0);
            let triangles: Vec<_> = mesh.corners().map(|t| t.map(in_cells)).collect();
            let mut crossed = 0;
            for idx in (0..spec.cell_count()).step_by(23) {
                let cell = spec.cell_at(idx);
                let p = [0, 1, 2].map(|x| f64::from(cell[x]) + [0.3, 0.6, 0.1][x]);
                let to_all = triangles
                    .iter()
                    .map(|&t| squared_distance(p, closest_point(p, t)));
                let nearest = to_all.fold(f64::INFINITY, f64::min).sqrt();
                let found = surface.distance(p, 3.0);
                let nearest = nearest.min(3.0);
                // The nearest point shares its bin with one that is found.
                let diagonal = 3.0_f64.sqrt() * BIN;
                assert!(
                    found >= nearest - 1e-9 && found <= nearest + diagonal,
                    "{model:?} {cell:?}: {found} {nearest}"
                );
                let corner = cell.map(f64::from);
                let expected = triangles.iter().any(|t| overlaps_cube(t, corner, 1.0));
                assert_eq!(surface.crosses(cell), expected, "{model:?} {cell:?}");
                crossed += usize::from(expected);
            }
            assert!(crossed > 10, "{crossed}");
        }
    }
}
