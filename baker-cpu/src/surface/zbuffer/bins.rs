//! The projected points of a direction, sorted into the cells of a grid.

use std::ops::Range;

/// Points that are tested at once.
pub(super) const LANES: usize = 8;

/// The mean number of points of a cell, half of them of each side. Measured on the bunny's 69,451 faces:
/// 3 and 8 take a third longer.
const POINTS_PER_CELL: f32 = 5.0;

/// The largest number of cells along a side.
const MAX_CELLS: f32 = 4096.0;

/// The rounding of coordinates and of cells' edges, by which boxes grow: some steps of single floats.
pub(super) const PADDING: f32 = 8.0 / 16_777_216.0;

/// A projected vertex.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    pub position: [f32; 3],
    /// The cells that are the first and the last of a box which ends at the vertex. Cells never decrease
    /// with the coordinate, so that those of a triangle's box are the extremes of its corners'.
    pub first: [u16; 2],
    pub last: [u16; 2],
}

/// Points in the order of their cells, x fastest, those above which the direction is before those above
/// which its opposite is. Each array has [`LANES`] elements more than points.
#[derive(Default)]
pub(super) struct Bins {
    unsorted: Vec<Projected>,
    cell_of: Vec<u32>,
    indices: Vec<u32>,
    pub x: Vec<f32>,
    pub y: Vec<f32>,
    pub z: Vec<f32>,
    pub state: Vec<u32>,
    /// The first point of each cell, and the end of the last.
    starts: Vec<u32>,
    /// The smallest depth of the points of each cell, with the sign of their side.
    min_z: Vec<f32>,
    pub grid: Grid,
}

/// A point before it is sorted.
struct Projected {
    idx: u32,
    /// The depth has the sign of its side.
    position: [f32; 3],
    is_opposite: bool,
}

/// The cells of the plane.
#[derive(Clone, Copy, Default)]
pub(super) struct Grid {
    min: [f32; 2],
    max: [f32; 2],
    per_unit: f32,
    /// The width of a cell.
    pub size: f32,
    pub n: [usize; 2],
}

impl Grid {
    fn new(points: &[Projected]) -> Self {
        let (mut min, mut max) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for Projected { position: p, .. } in points {
            for axis in 0..2 {
                min[axis] = if p[axis] < min[axis] {
                    p[axis]
                } else {
                    min[axis]
                };
                max[axis] = if p[axis] > max[axis] {
                    p[axis]
                } else {
                    max[axis]
                };
            }
        }
        let [w, h] = [max[0] - min[0], max[1] - min[1]];
        let n_cells = points.len() as f32 / POINTS_PER_CELL;
        // Square cells; of points on a line as many as in a plane would be too wide.
        let of_area = (w * h / n_cells).sqrt();
        let size = of_area.max(w.max(h) / n_cells.min(MAX_CELLS));
        let size = if size > 0.0 { size } else { 1.0 };
        let per_unit = 1.0 / size;
        let n = [w, h].map(|extent| (extent * per_unit) as usize + 1);
        Self {
            min,
            max,
            per_unit,
            size,
            n,
        }
    }

    /// Returns the cell along an axis; those outside belong to the outermost. It never decreases with
    /// the coordinate, rounding included.
    #[inline(always)]
    fn cell(&self, axis: usize, at: f32) -> usize {
        (((at - self.min[axis]) * self.per_unit) as usize).min(self.n[axis] - 1)
    }

    /// Returns the cells along an axis that an interval covers, if it covers any.
    #[inline(always)]
    pub(super) fn range(&self, axis: usize, lo: f32, hi: f32) -> Option<[usize; 2]> {
        let meets = lo <= self.max[axis] && hi >= self.min[axis];
        meets.then(|| [self.cell(axis, lo), self.cell(axis, hi)])
    }

    /// Whether a box has cells.
    #[inline(always)]
    pub(super) fn meets(&self, lo: [f32; 3], hi: [f32; 3]) -> bool {
        (lo[0] - PADDING <= self.max[0] && hi[0] + PADDING >= self.min[0])
            & (lo[1] - PADDING <= self.max[1] && hi[1] + PADDING >= self.min[1])
    }

    /// Returns a vertex with the cells of its triangles' boxes.
    #[inline(always)]
    pub(super) fn vertex(&self, [x, y, z]: [f32; 3]) -> Vertex {
        Vertex {
            position: [x, y, z],
            first: [
                self.cell(0, x - PADDING) as u16,
                self.cell(1, y - PADDING) as u16,
            ],
            last: [
                self.cell(0, x + PADDING) as u16,
                self.cell(1, y + PADDING) as u16,
            ],
        }
    }

    /// Returns the interval of a row of cells.
    #[inline(always)]
    pub(super) fn row(&self, row: usize) -> [f32; 2] {
        let at = |row: usize| self.min[1] + row as f32 * self.size;
        [at(row), at(row + 1)]
    }
}

impl Bins {
    pub(super) fn clear(&mut self) {
        self.unsorted.clear();
    }

    #[inline(always)]
    pub(super) fn push(&mut self, idx: u32, [x, y, z]: [f32; 3], is_opposite: bool) {
        self.unsorted.push(Projected {
            idx,
            position: [x, y, if is_opposite { -z } else { z }],
            is_opposite,
        });
    }

    /// Sorts the points by counting.
    pub(super) fn sort(&mut self) {
        let grid = Grid::new(&self.unsorted);
        let n = self.unsorted.len();
        let n_plane = grid.n[0] * grid.n[1];
        let n_cells = 2 * n_plane;
        self.grid = grid;
        self.starts.clear();
        self.starts.resize(n_cells + 1, 0);
        self.min_z.clear();
        self.min_z.resize(n_cells, f32::INFINITY);
        self.cell_of.clear();
        for point in &self.unsorted {
            let [x, y, z] = point.position;
            let side = if point.is_opposite { n_plane } else { 0 };
            let cell = side + grid.cell(1, y) * grid.n[0] + grid.cell(0, x);
            self.cell_of.push(cell as u32);
            self.starts[cell] += 1;
            if z < self.min_z[cell] {
                self.min_z[cell] = z;
            }
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        for lanes in [&mut self.x, &mut self.y, &mut self.z] {
            lanes.resize(n + LANES, 0.0);
        }
        self.indices.resize(n, 0);
        self.state.clear();
        self.state.resize(n + LANES, 0);
        // Backward, which turns each cell's end into its start and keeps the order.
        for (point, &cell) in self.unsorted.iter().zip(&self.cell_of).rev() {
            self.starts[cell as usize] -= 1;
            let to = self.starts[cell as usize] as usize;
            self.indices[to] = point.idx;
            [self.x[to], self.y[to], self.z[to]] = point.position;
        }
    }

    /// Returns the points of a row of cells, from `first` to `last`, of one side; without the cells at the
    /// ends all of whose points are in front of `max_z`.
    #[inline(always)]
    pub(super) fn row_points(
        &self,
        row: usize,
        [mut first, mut last]: [usize; 2],
        is_opposite: bool,
        max_z: f32,
    ) -> Range<usize> {
        let [n_x, n_y] = self.grid.n;
        let base = if is_opposite { n_y + row } else { row } * n_x;
        while first < last && self.min_z[base + first] > max_z {
            first += 1;
        }
        while last > first && self.min_z[base + last] > max_z {
            last -= 1;
        }
        match self.min_z[base + first] > max_z {
            true => 0..0,
            false => self.starts[base + first] as usize..self.starts[base + last + 1] as usize,
        }
    }

    /// Returns the index and state of each point.
    pub(super) fn states(&self) -> impl Iterator<Item = (usize, u32)> {
        let indices = self.indices.iter().map(|idx| *idx as usize);
        indices.zip(self.state.iter().copied())
    }

    /// Whether there are no points.
    pub(super) fn is_empty(&self) -> bool {
        self.unsorted.is_empty()
    }
}
