//! The sparse least-squares problem of the fit, and its solution by conjugate gradients.

use aogrid_grid_format::GridSpec;
use rayon::prelude::*;

use super::stored::Stored;

/// The residual, relative to that of the baked values, at which the solution is good enough: far
/// below a step of 8 bits.
const RELATIVE_RESIDUAL: f64 = 1e-3;

/// The maximum number of iterations; the fit needs 3 to 7.
const MAX_ITERATIONS: usize = 100;

/// The minimum number of rows that a thread takes at once.
const MIN_ROWS: usize = 256;

/// No unknown: the cell keeps its value.
const KNOWN: u32 = u32::MAX;

/// The problem: unknown cells with their holds, and points whose interpolated values are given.
pub(super) struct System<'a> {
    resolution: [usize; 3],
    values: &'a [Stored],
    /// The unknown that stands for a cell, or [`KNOWN`].
    unknown_of: Vec<u32>,
    /// The cell of each unknown, ascending.
    cells: &'a [usize],
    /// The weight that holds each unknown at its baked value.
    holds: Vec<f64>,
    points: Vec<Point>,
}

/// A row of the normal equations: the factors of the unknowns among a cell and its 26 neighbors, x
/// fastest.
struct Row {
    factors: [f64; 27],
    /// The unknowns, or [`KNOWN`], whose factors do not count.
    unknowns: [u32; 27],
}

/// The slot of a row that stands for the cell itself.
const SELF: usize = 13;

/// A point with a given value.
struct Point {
    position: [f64; 3],
    /// The eight unknowns that the filter reads, or [`KNOWN`], x fastest.
    unknowns: [u32; 8],
    /// The filter's weights.
    filter: [f64; 8],
    /// The given values less those that the filter returns from the baked values.
    residual: [f64; 4],
    weight: f64,
}

impl<'a> System<'a> {
    /// Begins a problem with the baked `values`, the unknown `cells` in ascending order, and the
    /// weight that holds a cell at its value.
    pub(super) fn new(
        spec: &GridSpec,
        values: &'a [Stored],
        cells: &'a [usize],
        hold: impl Fn(usize) -> f64,
    ) -> Self {
        let mut unknown_of = vec![KNOWN; values.len()];
        for (unknown, &cell) in (0..).zip(cells) {
            unknown_of[cell] = unknown;
        }
        Self {
            resolution: spec.resolution().map(|n| n as usize),
            values,
            unknown_of,
            cells,
            holds: cells.iter().map(|&cell| hold(cell)).collect(),
            points: Vec::new(),
        }
    }

    /// Adds those of `count` points for which the filter reads an unknown: `position` gives the
    /// position of a point in cells, and `value` that which shall be interpolated there, with its
    /// weight.
    pub(super) fn add(
        &mut self,
        count: usize,
        position: impl Fn(usize) -> [f64; 3] + Sync,
        value: impl Fn(usize) -> Option<(Stored, f64)> + Sync,
    ) {
        let point = |idx: usize| self.point(position(idx), || value(idx));
        let read: Vec<Point> = (0..count).into_par_iter().filter_map(point).collect();
        self.points.extend(read);
    }

    fn point(
        &self,
        position: [f64; 3],
        value: impl Fn() -> Option<(Stored, f64)>,
    ) -> Option<Point> {
        let (cells, filter) = self.stencil(position)?;
        let unknowns = cells.map(|cell| self.unknown_of[cell]);
        if unknowns == [KNOWN; 8] {
            return None;
        }
        let (exact, weight) = value()?;
        let mut residual = exact.0;
        for (&cell, t) in cells.iter().zip(filter) {
            (0..4).for_each(|c| residual[c] -= t * self.values[cell].0[c]);
        }
        Some(Point {
            position,
            unknowns,
            filter,
            residual,
            weight,
        })
    }

    /// Multiplies the weights of all points by a function of their position, in parallel.
    pub(super) fn weigh(&mut self, weight: impl Fn([f64; 3]) -> f64 + Sync) {
        let points = self.points.par_iter_mut();
        points.for_each(|point| point.weight *= weight(point.position));
    }

    /// Solves the problem and returns the unknown cells with their new values.
    pub(super) fn solve(&self) -> impl Iterator<Item = (usize, Stored)> {
        let change = self.conjugate_gradients();
        let value = move |(&cell, change): (&usize, [f64; 4])| {
            let baked = self.values[cell].0;
            let fitted = Stored([0, 1, 2, 3].map(|c| baked[c] + change[c]));
            (cell, fitted.clamped())
        };
        self.cells.iter().zip(change).map(value)
    }

    /// Returns the cells that a linear filter reads at a position, and their weights; `None`
    /// outside the hull of the cells' centers, where it clamps.
    fn stencil(&self, position: [f64; 3]) -> Option<([usize; 8], [f64; 8])> {
        let from_first = position.map(|p| p - 0.5);
        let base = from_first.map(f64::floor);
        let inside = (0..3).all(|x| base[x] >= 0.0 && base[x] + 1.0 < self.resolution[x] as f64);
        if !inside {
            return None;
        }
        let [nx, ny, _] = self.resolution;
        let first = base.map(|b| b as usize);
        let at = |corner: usize| [corner & 1, corner >> 1 & 1, corner >> 2];
        let cells = [0, 1, 2, 3, 4, 5, 6, 7].map(|corner| {
            let [i, j, k] = at(corner);
            ((first[2] + k) * ny + first[1] + j) * nx + first[0] + i
        });
        let filter = [0, 1, 2, 3, 4, 5, 6, 7].map(|corner| {
            let towards = at(corner);
            let along = |x: usize| {
                let t = from_first[x] - base[x];
                if towards[x] == 1 { t } else { 1.0 - t }
            };
            along(0) * along(1) * along(2)
        });
        Some((cells, filter))
    }

    /// Returns the changes of the unknowns that minimize the sum, by Jacobi-preconditioned
    /// conjugate gradients from zero, each channel by itself. Every sum has a fixed order.
    fn conjugate_gradients(&self) -> Vec<[f64; 4]> {
        let normal = self.normal();
        let diagonal: Vec<f64> = normal.iter().map(|row| row.factors[SELF]).collect();
        let mut residual = self.right_hand_side();
        let mut change = vec![[0.0; 4]; self.cells.len()];
        let mut direction: Vec<[f64; 4]> = precondition(&residual, &diagonal);
        let mut rho = dots(&residual, &direction);
        let enough = dots(&residual, &residual).map(|v| v * RELATIVE_RESIDUAL.powi(2));
        for _ in 0..MAX_ITERATIONS {
            let left = dots(&residual, &residual);
            if (0..4).all(|c| left[c] <= enough[c]) {
                break;
            }
            let product = multiply(&normal, &direction);
            let curvature = dots(&direction, &product);
            let step = [0, 1, 2, 3].map(|c| ratio(rho[c], curvature[c]));
            for (idx, product) in product.iter().enumerate() {
                for c in 0..4 {
                    change[idx][c] += step[c] * direction[idx][c];
                    residual[idx][c] -= step[c] * product[c];
                }
            }
            let preconditioned = precondition(&residual, &diagonal);
            let next = dots(&residual, &preconditioned);
            let turn = [0, 1, 2, 3].map(|c| ratio(next[c], rho[c]));
            for (direction, z) in direction.iter_mut().zip(&preconditioned) {
                (0..4).for_each(|c| direction[c] = z[c] + turn[c] * direction[c]);
            }
            rho = next;
        }
        change
    }

    /// Returns the matrix of the normal equations, a row for each unknown.
    fn normal(&self) -> Vec<Row> {
        let [nx, ny, nz] = self.resolution.map(|n| n as isize);
        let neighbor = |cell: usize, slot: usize| {
            let cell = cell as isize;
            let at = [cell % nx, cell / nx % ny, cell / (nx * ny)];
            let step = [slot % 3, slot / 3 % 3, slot / 9].map(|s| s as isize - 1);
            let [i, j, k] = [0, 1, 2].map(|x| at[x] + step[x]);
            let inside = (0..nx).contains(&i) && (0..ny).contains(&j) && (0..nz).contains(&k);
            match inside {
                true => self.unknown_of[((k * ny + j) * nx + i) as usize],
                false => KNOWN,
            }
        };
        let rows = self.cells.par_iter().zip(&self.holds);
        let mut rows: Vec<Row> = rows
            .map(|(&cell, &hold)| Row {
                factors: std::array::from_fn(|slot| if slot == SELF { hold } else { 0.0 }),
                unknowns: std::array::from_fn(|slot| neighbor(cell, slot)),
            })
            .collect();
        for point in &self.points {
            for (a, unknown) in point.unknowns.into_iter().enumerate() {
                if unknown != KNOWN {
                    let row = &mut rows[unknown as usize];
                    let t = point.weight * point.filter[a];
                    for (b, u) in point.filter.iter().enumerate() {
                        row.factors[slot(a, b)] += t * u;
                    }
                }
            }
        }
        rows
    }

    /// Returns the right-hand side of the normal equations.
    fn right_hand_side(&self) -> Vec<[f64; 4]> {
        let mut sums = vec![[0.0; 4]; self.cells.len()];
        for point in &self.points {
            point.spread(point.residual, &mut sums);
        }
        sums
    }
}

impl Point {
    /// Returns the unknowns that the filter reads, with its weights.
    fn read(&self) -> impl Iterator<Item = (usize, f64)> {
        let read = self.unknowns.iter().zip(self.filter);
        read.filter(|(unknown, _)| **unknown != KNOWN)
            .map(|(&unknown, t)| (unknown as usize, t))
    }

    /// Adds a value of the point to the unknowns that it is interpolated from.
    fn spread(&self, value: [f64; 4], sums: &mut [[f64; 4]]) {
        for (unknown, t) in self.read() {
            (0..4).for_each(|c| sums[unknown][c] += self.weight * t * value[c]);
        }
    }
}

/// Returns the slot in the row of the cell at corner `a` of a filter's eight that stands for the cell
/// at corner `b`.
fn slot(a: usize, b: usize) -> usize {
    let along = |bit: usize| 1 + (b >> bit & 1) - (a >> bit & 1);
    along(2) * 9 + along(1) * 3 + along(0)
}

/// Multiplies a vector by the matrix of the normal equations.
fn multiply(rows: &[Row], vector: &[[f64; 4]]) -> Vec<[f64; 4]> {
    let product = |row: &Row| {
        let mut sum = [0.0; 4];
        for (factor, &unknown) in row.factors.iter().zip(&row.unknowns) {
            if unknown != KNOWN {
                (0..4).for_each(|c| sum[c] += factor * vector[unknown as usize][c]);
            }
        }
        sum
    };
    rows.par_iter()
        .with_min_len(MIN_ROWS)
        .map(product)
        .collect()
}

/// Returns a/b, or 0 where a channel has nothing left to solve.
fn ratio(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 0.0 }
}

fn precondition(residual: &[[f64; 4]], diagonal: &[f64]) -> Vec<[f64; 4]> {
    let rows = residual.iter().zip(diagonal);
    rows.map(|(r, d)| r.map(|r| r / d)).collect()
}

/// Returns the scalar product of each channel.
fn dots(a: &[[f64; 4]], b: &[[f64; 4]]) -> [f64; 4] {
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        (0..4).for_each(|c| sums[c] += a[c] * b[c]);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec() -> GridSpec {
        GridSpec::new([8; 3], [0.0; 3], [4.0; 3]).unwrap()
    }

    /// The interpolated value at a position.
    fn interpolated(system: &System<'_>, values: &[Stored], position: [f64; 3]) -> [f64; 4] {
        let (cells, filter) = system.stencil(position).unwrap();
        let mut sum = [0.0; 4];
        for (cell, t) in cells.into_iter().zip(filter) {
            (0..4).for_each(|c| sum[c] += t * values[cell].0[c]);
        }
        sum
    }

    #[test]
    fn filters_are_those_of_a_texture() {
        let values: Vec<Stored> = (0..512).map(|i| Stored([f64::from(i); 4])).collect();
        let system = System::new(&spec(), &values, &[], |_| 1.0);
        // A function that is linear in the position is interpolated exactly.
        let at = [2.75, 4.5, 6.1];
        let expected = (at[0] - 0.5) + 8.0 * (at[1] - 0.5) + 64.0 * (at[2] - 0.5);
        assert!((interpolated(&system, &values, at)[0] - expected).abs() < 1e-9);
        assert!(system.stencil([0.4, 4.0, 4.0]).is_none());
        assert!(system.stencil([4.0, 7.6, 4.0]).is_none());
    }

    /// Unknown cells whose values lie in the space of the interpolation are found again.
    #[test]
    fn values_that_interpolation_can_represent_are_recovered() {
        let truth: Vec<Stored> = (0..512_u32)
            .map(|i| {
                let h = f64::from(i.wrapping_mul(2_654_435_761) >> 16) / 65536.0;
                Stored([0.5 * h, -0.3 * h, 0.2, h])
            })
            .collect();
        let unknown = |i: usize| {
            [i % 8, i / 8 % 8, i / 64]
                .iter()
                .all(|c| (3..5).contains(c))
        };
        let cells: Vec<usize> = (0..512).filter(|&i| unknown(i)).collect();
        let mut values = truth.clone();
        cells
            .iter()
            .for_each(|&cell| values[cell] = Stored([0.0; 4]));
        let mut system = System::new(&spec(), &values, &cells, |_| 1e-9);
        let steps = (0..22).map(|i| 0.51 + f64::from(i) * 0.31);
        let steps: Vec<f64> = steps.collect();
        let n = steps.len();
        let positions = (0..n * n * n).map(|i| [i % n, i / n % n, i / (n * n)].map(|s| steps[s]));
        let positions: Vec<[f64; 3]> = positions.collect();
        let exact = positions.iter().map(|&p| interpolated(&system, &truth, p));
        let exact: Vec<_> = exact.collect();
        let value = |idx: usize| Some((Stored(exact[idx]), 1.0));
        system.add(positions.len(), |idx| positions[idx], value);
        assert!(system.points.len() < n * n * n);
        system.weigh(|_| 1.0);
        let mut largest = 0.0_f64;
        for (cell, value) in system.solve() {
            for c in 0..4 {
                largest = largest.max((value.0[c] - truth[cell].0[c]).abs());
            }
        }
        // The residual falls to 1e-3 of the values, which are below 1, times a condition below 10.
        assert!(largest < 1e-2 && largest > 0.0, "{largest}");
    }

    #[test]
    fn a_strong_hold_keeps_the_baked_value() {
        let values = vec![Stored([0.0; 4]); 512];
        let cells = [4 * 73];
        let mut system = System::new(&spec(), &values, &cells, |_| 1e12);
        system.add(1, |_| [4.5; 3], |_| Some((Stored([1.0; 4]), 1.0)));
        let (cell, value) = system.solve().next().unwrap();
        assert_eq!(cell, 292);
        assert!(value.0.iter().all(|v| v.abs() < 1e-9), "{value:?}");
    }
}
