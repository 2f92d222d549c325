//! Looking a grid up as a texture unit does.

use aogrid_grid_format::{Grid, GridSpec};

/// `[dx, dy, dz, a]` at a point in object space: linear between cell centres, clamped at the
/// edges, 0 outside the grid's box.
pub fn cone_at(grid: &Grid, point: [f64; 3]) -> [f64; 4] {
    let mut sum = [0.0; 4];
    let Some((base, weight)) = cell_and_weight(grid.spec(), point) else {
        return sum;
    };
    for corner in 0..8 {
        let share: f64 = (0..3)
            .map(|x| match upper(corner, x) {
                0 => 1.0 - weight[x],
                _ => weight[x],
            })
            .product();
        let cone = grid.cone(neighbour(grid.spec(), base, corner));
        for (sum, value) in sum.iter_mut().zip(cone) {
            *sum += share * f64::from(value);
        }
    }
    sum
}

/// The places in memory of the eight cells that a look-up at `point` reads; none outside.
pub fn cells_around(spec: &GridSpec, point: [f64; 3]) -> Option<[usize; 8]> {
    let (base, _) = cell_and_weight(spec, point)?;
    Some(std::array::from_fn(|corner| neighbour(spec, base, corner)))
}

/// 1 if corner number `corner` of eight is the upper one along axis `x`, else 0.
fn upper(corner: usize, x: usize) -> u32 {
    (corner >> x & 1) as u32
}

fn neighbour(spec: &GridSpec, base: [u32; 3], corner: usize) -> usize {
    spec.cell_idx(std::array::from_fn(|x| base[x] + upper(corner, x)))
}

/// The lowest of the eight cells around a point, and how far towards the others it is, 0..1.
fn cell_and_weight(spec: &GridSpec, point: [f64; 3]) -> Option<([u32; 3], [f64; 3])> {
    let (mut base, mut weight) = ([0; 3], [0.0; 3]);
    for x in 0..3 {
        let (c, e) = (
            f64::from(spec.center()[x]),
            f64::from(spec.half_extents()[x]),
        );
        let grid_space = (point[x] - c) / (2.0 * e) + 0.5;
        if !(0.0..=1.0).contains(&grid_space) {
            return None;
        }
        let n = f64::from(spec.resolution()[x]);
        let in_cells = (grid_space * n - 0.5).clamp(0.0, n - 1.0);
        base[x] = (in_cells.floor() as u32).min(spec.resolution()[x] - 2);
        weight[x] = in_cells - f64::from(base[x]);
    }
    Some((base, weight))
}
