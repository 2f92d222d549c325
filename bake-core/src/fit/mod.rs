//! The near-surface fit: the values of cells near the surface, chosen so that what a linear filter
//! returns between cells is right, rather than what the cells hold.
//!
//! # Theory
//!
//! A filter reads eight cells, and beside a surface some of them lie inside the object or across an
//! edge, where nothing is right to store for all the points around. The exact values are known on a
//! finer lattice of points, which costs about as much to bake as the grid itself, with fewer
//! directions a point. Stored values x = (v, √a) of the cells near the surface minimize
//!
//! Σ w |interpolated(x) − exact|² + Σ l |x − x₀|²
//!
//! over the points of the lattice: x₀ are the baked values, w falls with the distance to the
//! surface, and l keeps cells outside close to what was baked and leaves cells inside free. The
//! sum is a sparse least-squares problem of a few thousand unknowns.

mod closest;
mod lattice;
mod overlap;
mod stored;
mod surface;
mod system;

use aogrid_grid_format::{GridSpec, Sampling};
use rayon::prelude::*;

pub(crate) use lattice::lattice;

use crate::classification::class_of;
use crate::layers::CellClass;
use crate::{BakeOptions, Classification, RawGrid, TriangleMesh};
use stored::Stored;
use surface::Surface;
use system::System;

/// The face size of the lattice's points. Their errors average out over the points of a cell; 4 is
/// too coarse, and 16 gains nothing.
const FACE_SIZE: u32 = 8;

/// The weight that holds an exterior cell at its baked value, where a point of the lattice at one
/// cell from the surface has weight 1.
const EXTERIOR_HOLD: f64 = 3.0;

/// The same for an interior cell, which holds no exact value.
const INTERIOR_HOLD: f64 = 0.1;

/// The distance to the surface, in cells, below which the weight of a point no longer grows.
const MIN_DISTANCE: f64 = 0.25;

/// The distance to the surface, in cells, above which it no longer falls. Far from the surface the
/// field is smooth, and weights hardly matter; near it they do.
const MAX_DISTANCE: f64 = 1.0;

/// The largest occluded fraction of a point inside the object that is still seen: in a bowl, a pipe,
/// a box without a lid. Inside a solid with small holes it is nearer to 1.
const MAX_CAVITY_FRACTION: f32 = 0.95;

/// The weight of such a point, where one outside has weight 1: little, since beside a thin wall one
/// side must give way, but all that there is in the middle of the cavity.
const CAVITY_TRUST: f64 = 0.05;

/// The finer lattice of points around a mesh, baked.
#[derive(Clone, Debug)]
pub struct NearSurface<'a> {
    /// The mesh that was baked.
    pub mesh: &'a TriangleMesh,
    /// The moments at the lattice's points.
    pub points: RawGrid,
}

/// Returns the options with which the points of the lattice are baked.
pub(crate) fn point_options(options: &BakeOptions) -> BakeOptions {
    BakeOptions {
        sampling: Sampling::CubeFaces { size: FACE_SIZE },
        ..*options
    }
}

/// Returns `[x, y, z, a]` of all cells with v for the moment encoding, x fastest: of `raw`, whose
/// interior is filled, but for cells near the surface, which are fitted to `near`.
pub(crate) fn fit(
    raw: &RawGrid,
    classification: &Classification,
    near: &NearSurface<'_>,
) -> Vec<[f32; 4]> {
    let mut values: Vec<Stored> = raw.moments.par_iter().map(Stored::of).collect();
    let surface = Surface::new(near.mesh, &raw.spec);
    let classes = classification.classes();
    let unknowns = unknowns(raw, classes, &surface);
    let mut system = System::new(&raw.spec, &values, &unknowns, |cell| {
        match classes[cell].is_interior {
            true => INTERIOR_HOLD,
            false => EXTERIOR_HOLD,
        }
    });
    let points = &near.points;
    let [xs, ys, zs] = positions(&points.spec, &raw.spec);
    let position = |idx: usize| {
        let [i, j, k] = points.spec.cell_at(idx).map(|at| at as usize);
        [xs[i], ys[j], zs[k]]
    };
    system.add(points.moments.len(), position, |idx| value(points, idx));
    system.weigh(|position| {
        let distance = surface.distance(position, MAX_DISTANCE);
        1.0 / distance.max(MIN_DISTANCE)
    });
    let fitted: Vec<_> = system.solve().collect();
    for (cell, value) in fitted {
        values[cell] = value;
    }
    values.into_iter().map(Stored::cell).collect()
}

/// Returns the cells whose values are fitted, in ascending order: those inside, those that the
/// surface crosses, and the 26 neighbors of these.
fn unknowns(raw: &RawGrid, classes: &[CellClass], surface: &Surface) -> Vec<usize> {
    let resolution = raw.spec.resolution();
    let mut is_unknown: Vec<bool> = classes.iter().map(|class| class.is_interior).collect();
    for cell in (0..classes.len()).filter(|&idx| surface.crosses(raw.spec.cell_at(idx))) {
        let [i, j, k] = raw.spec.cell_at(cell);
        let around = |at: u32, n: u32| at.saturating_sub(1)..=(at + 1).min(n - 1);
        for k in around(k, resolution[2]) {
            for j in around(j, resolution[1]) {
                for i in around(i, resolution[0]) {
                    is_unknown[raw.spec.cell_idx([i, j, k])] = true;
                }
            }
        }
    }
    (0..is_unknown.len())
        .filter(|&idx| is_unknown[idx])
        .collect()
}

/// Returns the positions of the lattice's points along each axis, in cells of the grid: cell i has
/// its center at i + ½.
fn positions(points: &GridSpec, grid: &GridSpec) -> [Vec<f64>; 3] {
    let [of_points, of_grid] = [points, grid].map(GridSpec::center);
    let size = grid.cell_size();
    [0, 1, 2].map(|x| {
        let middle = (f64::from(of_points[x]) - f64::from(of_grid[x])) / size[x]
            + 0.5 * f64::from(grid.resolution()[x]);
        let n = points.resolution()[x];
        let step = points.cell_size()[x] / size[x];
        let from_middle = |i: u32| (f64::from(i) - 0.5 * f64::from(n - 1)) * step;
        (0..n).map(|i| middle + from_middle(i)).collect()
    })
}

/// Returns the exact value of a point and its weight; `None` for a point inside a solid.
fn value(points: &RawGrid, idx: usize) -> Option<(Stored, f64)> {
    let moments = &points.moments[idx];
    let weight = match class_of(points, idx).is_interior {
        _ if points.is_enclosed(idx) => return None,
        false => 1.0,
        true if moments.a <= MAX_CAVITY_FRACTION => CAVITY_TRUST,
        true => return None,
    };
    Some((Stored::of(moments), weight))
}
