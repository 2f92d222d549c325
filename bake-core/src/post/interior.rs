//! The interior fill: cells inside the object take the values of cells around it, so that
//! interpolation across the surface is right outside, where it is seen (RR-5779, 3.3.3).

use crate::{Classification, Moments, RawGrid};

use super::PostError;

/// Replaces the moments of every interior cell by the average over those of its six neighbors that
/// are exterior or have been filled. Jacobi iterations: each one reads only results of the one
/// before, so the result does not depend on the order of the cells.
pub(super) fn fill(raw: &mut RawGrid, classification: &Classification) -> Result<(), PostError> {
    let classes = classification.classes();
    let mut known: Vec<bool> = classes.iter().map(|class| !class.is_interior).collect();
    let mut pending: Vec<usize> = (0..classes.len()).filter(|&idx| !known[idx]).collect();
    if pending.len() == classes.len() {
        return Err(PostError::AllInterior(raw.spec.half_extents()));
    }
    // The grid is connected, so that each iteration fills at least one more cell.
    while !pending.is_empty() {
        let mut filled = Vec::new();
        pending.retain(|&idx| {
            let average = average_of_known(raw, &known, idx);
            filled.extend(average.map(|moments| (idx, moments)));
            average.is_none()
        });
        for (idx, moments) in filled {
            raw.moments[idx] = moments;
            known[idx] = true;
        }
    }
    Ok(())
}

fn average_of_known(raw: &RawGrid, known: &[bool], idx: usize) -> Option<Moments> {
    let (mut n, mut sum) = (0, [0.0_f64; 4]);
    for neighbor in neighbors(raw, idx).filter(|&idx| known[idx]) {
        let Moments { a, m: [x, y, z] } = raw.moments[neighbor];
        for (sum, value) in sum.iter_mut().zip([x, y, z, a]) {
            *sum += f64::from(value);
        }
        n += 1;
    }
    let [x, y, z, a] = sum.map(|v| (v / f64::from(n)) as f32);
    (n > 0).then_some(Moments { a, m: [x, y, z] })
}

/// Returns the indices of the up to six cells that share a face with the one at `idx`.
fn neighbors(raw: &RawGrid, idx: usize) -> impl Iterator<Item = usize> + '_ {
    let cell = raw.spec.cell_at(idx);
    (0..3).flat_map(move |axis| {
        [-1, 1].into_iter().filter_map(move |step| {
            let mut neighbor = cell;
            neighbor[axis] = neighbor[axis].checked_add_signed(step)?;
            (neighbor[axis] < raw.spec.resolution()[axis]).then(|| raw.spec.cell_idx(neighbor))
        })
    })
}

#[cfg(test)]
mod tests {
    use aogrid_grid_format::GridSpec;

    use super::PostError;
    use crate::{Classification, Moments, RawGrid};

    /// Returns 8³ cells; those of `interior` are fully occluded, the others have a = x/16.
    fn raw(interior: impl Fn([u32; 3]) -> bool) -> RawGrid {
        let spec = GridSpec::new([8; 3], [0.0; 3], [1.0; 3]).unwrap();
        let cells = (0..spec.cell_count()).map(|idx| spec.cell_at(idx));
        let (moments, counts) = cells
            .map(|cell| {
                let a = cell[0] as f32 / 16.0;
                let outside = Moments {
                    a,
                    m: [a * (1.0 - a), 0.0, 0.0],
                };
                let inside = Moments {
                    a: 1.0,
                    m: [0.0; 3],
                };
                match interior(cell) {
                    true => (inside, 10),
                    false => (outside, 9),
                }
            })
            .unzip();
        RawGrid {
            spec,
            moments,
            counts,
            directions: 10,
            layers: None,
        }
    }

    /// Fills the interior cells, and returns their number.
    fn fill(raw: &mut RawGrid) -> Result<usize, PostError> {
        let classification = Classification::of(raw);
        super::fill(raw, &classification)?;
        Ok(classification.interior_cells())
    }

    #[test]
    fn a_single_interior_cell_takes_the_average_of_its_six_neighbors() {
        let mut grid = raw(|cell| cell == [3, 4, 5]);
        assert_eq!(fill(&mut grid), Ok(1));
        let filled = grid.moments[grid.spec.cell_idx([3, 4, 5])];
        // Neighbors at x = 2, 4 and four at 3: the average of a is that at 3.
        assert_eq!(filled.a, 3.0 / 16.0);
        let m = |x: f32| x / 16.0 * (1.0 - x / 16.0);
        assert!((filled.m[0] - (m(2.0) + m(4.0) + 4.0 * m(3.0)) / 6.0).abs() < 1e-7);
    }

    #[test]
    fn exterior_cells_stay_bit_identical() {
        let inside = |cell: [u32; 3]| cell.iter().all(|&x| (1..6).contains(&x));
        let before = raw(inside);
        let mut after = before.clone();
        assert_eq!(fill(&mut after), Ok(125));
        for idx in 0..before.counts.len() {
            let was_inside = inside(before.spec.cell_at(idx));
            let bits = |m: Moments| [m.a, m.m[0], m.m[1], m.m[2]].map(f32::to_bits);
            assert_eq!(
                bits(before.moments[idx]) == bits(after.moments[idx]),
                !was_inside
            );
            assert!(after.moments[idx].a < 1.0);
        }
    }

    #[test]
    fn deep_cells_are_filled_iteration_by_iteration() {
        // The interior is a slab from x = 3 on: layer 3 is filled from layer 2, layer 4 from 3, …
        let mut grid = raw(|cell| cell[0] >= 3);
        assert_eq!(fill(&mut grid), Ok(5 * 64));
        for x in 3..8 {
            let filled = grid.moments[grid.spec.cell_idx([x, 3, 3])];
            assert_eq!(filled.a, 2.0 / 16.0, "layer {x}");
        }
    }

    /// Mirroring the grid must mirror the result. The interior is a thick block, so that interior
    /// cells are neighbors, and the values outside are not symmetric, so that a wrong order shows.
    #[test]
    fn the_order_of_cells_does_not_matter() {
        let inside = |[x, y, z]: [u32; 3]| (6..14).contains(&(x + y + z));
        let value = |[x, y, z]: [u32; 3]| ((37 * x + 11 * y + 53 * z) % 64) as f32 / 128.0;
        let mirror = |cell: [u32; 3]| cell.map(|x| 7 - x);
        let filled = |map: &dyn Fn([u32; 3]) -> [u32; 3]| {
            let mut grid = raw(|cell| inside(map(cell)));
            for idx in 0..grid.counts.len() {
                if !grid.is_enclosed(idx) {
                    grid.moments[idx].a = value(map(grid.spec.cell_at(idx)));
                }
            }
            fill(&mut grid).unwrap();
            grid
        };
        let (one, other) = (filled(&|cell| cell), filled(&mirror));
        for idx in 0..one.counts.len() {
            let mirrored = one.spec.cell_idx(mirror(one.spec.cell_at(idx)));
            // Sums of neighbors in another order round differently.
            let difference = one.moments[idx].a - other.moments[mirrored].a;
            assert!(difference.abs() < 1e-6, "{difference}");
        }
    }

    #[test]
    fn the_error_of_an_all_interior_grid_names_its_box() {
        let error = fill(&mut raw(|_| true)).unwrap_err();
        assert_eq!(error, PostError::AllInterior([1.0; 3]));
        assert!(error.to_string().contains("[1.0, 1.0, 1.0]"), "{error}");
    }
}
