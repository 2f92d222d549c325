//! A slice of a grid: one layer of its cells, with the model's outline.

use aogrid_grid_format::Grid;

use super::baked_model::BakedModel;
use super::canvas::{BACKGROUND, Canvas, Color};
use super::outline::outline;
use super::panels::gray;

pub(crate) const OUTLINE: Color = [255, 96, 0];
const OUTLINE_ON_COLORS: Color = [255, 255, 255];

/// The colors of the marks of interior and of doubtful cells.
pub(crate) const INTERIOR: Color = [0, 140, 255];
pub(crate) const DOUBTFUL: Color = [225, 40, 190];

/// The distance between hatching lines, in pixels.
const HATCH_SPACING: u32 = 3;

/// The minimum distance between dots, in pixels, and the maximum side of a dot.
const DOT_SPACING: u32 = 5;
const MAX_DOT: u32 = 2;

/// The occlusion fraction below which directions fade into the background, being of little weight.
const FADE_OCCLUSION: f32 = 0.05;

/// The names of the axes.
pub(crate) const AXES: [&str; 3] = ["x", "y", "z"];

/// The quantity that a slice shows.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Quantity {
    Occlusion,
    Direction,
}

impl Quantity {
    /// Returns the color of a cell's value.
    pub(crate) fn color(self, [x, y, z, a]: [f32; 4]) -> Color {
        match self {
            Self::Occlusion => occlusion_color(a),
            Self::Direction => {
                let strength = (a / FADE_OCCLUSION).min(1.0);
                let mut color = direction_color([x, y, z]);
                for (c, background) in color.iter_mut().zip(BACKGROUND) {
                    let mixed = f32::from(*c) * strength + f32::from(background) * (1.0 - strength);
                    *c = mixed.round() as u8;
                }
                color
            }
        }
    }

    fn outline(self) -> Color {
        match self {
            Self::Occlusion => OUTLINE,
            Self::Direction => OUTLINE_ON_COLORS,
        }
    }
}

/// Returns the gray of an occlusion fraction. Its brightness falls with the square root of the fraction:
/// most cells hide less than a tenth, and would all look white otherwise.
pub(crate) fn occlusion_color(a: f32) -> Color {
    gray(a.max(0.0).sqrt())
}

/// Maps a direction to a color: −1..1 along x, y, z to dark..bright red, green, blue.
pub(crate) fn direction_color(d: [f32; 3]) -> Color {
    d.map(|v| ((v * 0.5 + 0.5).clamp(0.0, 1.0) * 255.0).round() as u8)
}

/// The orientation of a slice: the axis across it, and the axes that point right and up.
#[derive(Clone, Copy)]
pub(crate) struct Plane {
    pub(crate) across: usize,
    pub(crate) right: usize,
    pub(crate) up: usize,
}

impl Plane {
    /// Returns the plane across an axis in which `vertical`, or else the later axis, points up.
    pub(crate) fn across(axis: usize, vertical: usize) -> Self {
        let (a, b) = match axis {
            0 => (1, 2),
            1 => (0, 2),
            _ => (0, 1),
        };
        let (right, up) = if a == vertical { (b, a) } else { (a, b) };
        Self {
            across: axis,
            right,
            up,
        }
    }

    /// Tells the axes: "x right, y up".
    pub(crate) fn directions(self) -> String {
        format!("{} right, {} up", AXES[self.right], AXES[self.up])
    }
}

/// The slices of a grid in one orientation.
pub(crate) struct SliceView<'a> {
    pub(crate) grid: &'a Grid,
    pub(crate) model: Option<&'a BakedModel>,
    pub(crate) plane: Plane,
    /// The width and height of a slice in pixels.
    pub(crate) size: [u32; 2],
}

impl<'a> SliceView<'a> {
    /// Returns a view whose pixels are square and whose longer side has this many.
    pub(crate) fn new(
        grid: &'a Grid,
        model: Option<&'a BakedModel>,
        plane: Plane,
        longer_side: f64,
        min_side: u32,
    ) -> Self {
        let e = grid.spec().half_extents().map(f64::from);
        let (right, up) = (e[plane.right], e[plane.up]);
        let pixels = longer_side / right.max(up);
        Self {
            grid,
            model,
            plane,
            size: [right, up].map(|e| ((e * pixels).round() as u32).max(min_side)),
        }
    }

    /// The number of slices.
    pub(crate) fn count(&self) -> u32 {
        self.grid.spec().resolution()[self.plane.across]
    }

    /// Returns the coordinate of a slice in object units, relative to the grid's origin.
    pub(crate) fn coordinate(&self, k: u32) -> f64 {
        let axis = self.plane.across;
        let mut cell = [0; 3];
        cell[axis] = k;
        let spec = self.grid.spec();
        f64::from(spec.center()[axis]) + spec.sample_from_center(cell, [0.0; 3])[axis]
    }

    /// Returns the index of the cell of a pixel: pixels count downwards, `up` upwards.
    fn cell_idx(&self, [x, y]: [u32; 2], k: u32) -> usize {
        let spec = self.grid.spec();
        let n = spec.resolution();
        let [width, height] = self.size;
        let mut cell = [k; 3];
        cell[self.plane.right] = x * n[self.plane.right] / width;
        cell[self.plane.up] = (height - 1 - y) * n[self.plane.up] / height;
        spec.cell_idx(cell)
    }

    fn pixels(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let [width, height] = self.size;
        (0..height).flat_map(move |y| (0..width).map(move |x| [x, y]))
    }

    /// Draws slice `k` with its upper left corner at `origin`.
    pub(crate) fn draw(&self, canvas: &mut Canvas, origin: [u32; 2], k: u32, quantity: Quantity) {
        for [x, y] in self.pixels() {
            let color = quantity.color(self.grid.cell(self.cell_idx([x, y], k)));
            canvas.set(origin[0] + x, origin[1] + y, color);
        }
        let Some(model) = self.model else { return };
        if quantity == Quantity::Occlusion {
            self.draw_classes(canvas, origin, model, k);
        }
        self.draw_outline(canvas, origin, model, k, quantity.outline());
    }

    /// Hatches doubtful cells, and draws a dot in each interior cell, or in every few where cells are
    /// too small for one each.
    fn draw_classes(&self, canvas: &mut Canvas, [left, top]: [u32; 2], model: &BakedModel, k: u32) {
        let classes = model.cells.classes();
        for [x, y] in self.pixels() {
            let is_hatched = (x + y) % HATCH_SPACING == 0;
            if is_hatched && classes[self.cell_idx([x, y], k)].is_doubtful {
                canvas.set(left + x, top + y, DOUBTFUL);
            }
        }
        // Dots come last, so that they stay visible.
        let n = self.grid.spec().resolution();
        let [width, height] = self.size;
        let [columns, rows] = [n[self.plane.right], n[self.plane.up]];
        let cell = (width / columns).min(height / rows).max(1);
        let side = ((cell + DOT_SPACING / 2) / DOT_SPACING).clamp(1, MAX_DOT);
        let every = DOT_SPACING.div_ceil(cell) as usize;
        let cells = (0..rows).step_by(every);
        for (j, i) in cells.flat_map(|j| (0..columns).step_by(every).map(move |i| (j, i))) {
            let x = (2 * i + 1) * width / (2 * columns);
            let y = height - 1 - (2 * j + 1) * height / (2 * rows);
            if classes[self.cell_idx([x, y], k)].is_interior {
                for [right, down] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
                    if right < side && down < side {
                        canvas.set(left + x + right, top + y + down, INTERIOR);
                    }
                }
            }
        }
    }

    fn draw_outline(
        &self,
        canvas: &mut Canvas,
        origin: [u32; 2],
        model: &BakedModel,
        k: u32,
        color: Color,
    ) {
        let spec = self.grid.spec();
        let Plane { across, right, up } = self.plane;
        let (center, e) = (spec.center(), spec.half_extents());
        let relative =
            |p: f64, axis: usize| 0.5 + 0.5 * (p - f64::from(center[axis])) / f64::from(e[axis]);
        // The outline has the axes after the one across in cyclic order.
        let is_cyclic = right == (across + 1) % 3;
        let pixel = |[p, q]: [f64; 2]| {
            let [u, v] = if is_cyclic { [p, q] } else { [q, p] };
            let [width, height] = self.size.map(f64::from);
            [relative(u, right) * width, (1.0 - relative(v, up)) * height]
        };
        let thickness = spec.cell_size()[across];
        for segment in outline(&model.mesh, across, self.coordinate(k), thickness) {
            canvas.line(origin, self.size, segment.map(pixel), color);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vertical_axis_points_up() {
        let axes = |axis, vertical| {
            let plane = Plane::across(axis, vertical);
            [plane.right, plane.up]
        };
        assert_eq!(
            [axes(0, 1), axes(1, 1), axes(2, 1)],
            [[2, 1], [0, 2], [0, 1]]
        );
        assert_eq!(
            [axes(0, 2), axes(1, 2), axes(2, 2)],
            [[1, 2], [0, 2], [0, 1]]
        );
    }
}
