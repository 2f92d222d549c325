//! The contact sheet of a grid: rows of slices across an axis, occlusion above, directions below.

use aogrid_grid_format::{Encoding, Grid};
use image::RgbImage;

use crate::commands::info::{interior_line, triple};
use crate::pictures::baked_model::BakedModel;
use crate::pictures::canvas::{Canvas, DIM, GLYPH_HEIGHT, GLYPH_WIDTH, INK};
use crate::pictures::scales::{SCALES_HEIGHT, draw_marks, draw_scales};
use crate::pictures::slice::{AXES, Plane, Quantity, SliceView};

/// The longer side of a slice, in pixels.
const TILE_SIDE: f64 = 160.0;
/// The minimum of the shorter side in pixels, so that a slice of a rod is visible.
const MIN_TILE_SIDE: u32 = 16;
const COLUMNS: u32 = 8;
/// The maximum number of slices.
const MAX_SLICES: u32 = 32;
const GAP: u32 = 8;
/// The distance between lines of text, in pixels.
const LINE_HEIGHT: u32 = GLYPH_HEIGHT + 2;
const MARGIN: u32 = 16;
/// The minimum width of the picture in pixels, so that its legends fit.
const MIN_WIDTH: u32 = 780;
/// The characters of the longest label of a slice.
const LABEL_LEN: u32 = 12;

/// The layout of the sheet.
struct Layout {
    /// The width and height of a slice in pixels.
    tile: [u32; 2],
    /// The indices of the slices drawn.
    slices: Vec<u32>,
    /// The distance between two of them.
    step: u32,
}

impl Layout {
    fn new(view: &SliceView<'_>) -> Self {
        let n = view.count();
        let step = n.div_ceil(MAX_SLICES);
        Self {
            tile: view.size,
            slices: (step / 2..n).step_by(step as usize).collect(),
            step,
        }
    }

    /// The width of a slice with its label and the gap to the next.
    fn column_width(&self) -> u32 {
        self.tile[0].max(LABEL_LEN * GLYPH_WIDTH) + GAP
    }

    fn width(&self) -> u32 {
        let columns = COLUMNS.min(self.slices.len() as u32);
        (columns * self.column_width() - GAP).max(MIN_WIDTH) + 2 * MARGIN
    }

    /// Returns the height of a block of slices with its heading.
    fn block_height(&self) -> u32 {
        let rows = (self.slices.len() as u32).div_ceil(COLUMNS);
        2 * LINE_HEIGHT + rows * (self.tile[1] + LINE_HEIGHT + GAP)
    }

    /// Returns the upper left corner of a slice in a block.
    fn slice_origin(&self, slice: u32) -> [u32; 2] {
        let (row, column) = (slice / COLUMNS, slice % COLUMNS);
        [
            column * self.column_width(),
            LINE_HEIGHT + row * (self.tile[1] + LINE_HEIGHT + GAP),
        ]
    }

    /// Tells which slices are drawn.
    fn caption(&self, view: &SliceView<'_>) -> String {
        let (n, axis) = (view.count(), AXES[view.plane.across]);
        match self.step {
            1 => format!("all {n} slices across {axis}"),
            step => format!("every {} of {n} slices across {axis}", ordinal(step)),
        }
    }
}

/// Returns "2nd", "3rd", "4th" and so on.
fn ordinal(n: u32) -> String {
    let ending = match (n % 10, n % 100) {
        (1, tens) if tens != 11 => "st",
        (2, tens) if tens != 12 => "nd",
        (3, tens) if tens != 13 => "rd",
        _ => "th",
    };
    format!("{n}{ending}")
}

/// Draws the sheet of `grid`, which is called `name`, with slices across an axis.
pub(super) fn draw(grid: &Grid, model: Option<&BakedModel>, axis: usize, name: &str) -> RgbImage {
    let plane = Plane::across(axis, 1);
    let view = SliceView::new(grid, model, plane, TILE_SIDE, MIN_TILE_SIDE);
    let layout = Layout::new(&view);
    let directions = directions(grid);
    let header = headings(grid, name);
    let top = MARGIN + header.len() as u32 * LINE_HEIGHT + 2 * LINE_HEIGHT;
    let blocks = 1 + u32::from(directions.is_some());
    let height = top + blocks * layout.block_height() + SCALES_HEIGHT + MARGIN;
    let mut canvas = Canvas::new(layout.width(), height);
    for (line, text) in (0..).zip(&header) {
        let color = if line == 0 { INK } else { DIM };
        canvas.text(MARGIN, MARGIN + line * LINE_HEIGHT, text, color);
    }
    if model.is_some() {
        draw_marks(&mut canvas, [MARGIN, top - LINE_HEIGHT - LINE_HEIGHT / 2]);
    }
    let title = format!(
        "a, the hidden share of all directions: {}; {}",
        layout.caption(&view),
        plane.directions()
    );
    let mut origin = [MARGIN, top];
    draw_block(
        &mut canvas,
        &layout,
        &view,
        origin,
        (&title, Quantity::Occlusion),
    );
    origin[1] += layout.block_height();
    if let Some((_, title)) = directions {
        let block = (&*format!("{title}; the same slices"), Quantity::Direction);
        draw_block(&mut canvas, &layout, &view, origin, block);
        origin[1] += layout.block_height();
    }
    draw_scales(&mut canvas, origin, directions.map(|(symbol, _)| symbol));
    canvas.into_image()
}

/// Returns the symbol and the title of a grid's directions, if it has any.
fn directions(grid: &Grid) -> Option<(&'static str, &'static str)> {
    match grid.encoding() {
        Encoding::Occlusion => None,
        Encoding::Moment => Some((
            "v",
            "v, the direction towards the object, gray where occlusion is spread out",
        )),
        _ => Some(("d", "d, the direction towards the object")),
    }
}

/// Returns the lines of text at the top of the sheet.
fn headings(grid: &Grid, name: &str) -> Vec<String> {
    let (spec, record) = (grid.spec(), grid.record());
    let [nx, ny, nz] = spec.resolution();
    let part = record.source.part.as_ref();
    vec![
        name.to_owned(),
        format!(
            "{}{}, {} triangles",
            record.source.name,
            part.map(|part| format!(" ({part})")).unwrap_or_default(),
            record.source.triangles
        ),
        format!(
            "{nx}×{ny}×{nz} cells, half-extents {}",
            triple(spec.half_extents())
        ),
        format!(
            "boundary {:?}, V_M {:.4}; mean a {:.4}, largest {:.4}",
            record.boundary.applied,
            record.boundary.v_m,
            grid.statistics().mean,
            grid.statistics().largest
        ),
        interior_line(record),
    ]
}

/// Draws a block of slices under its title.
fn draw_block(
    canvas: &mut Canvas,
    layout: &Layout,
    view: &SliceView<'_>,
    [left, top]: [u32; 2],
    (title, quantity): (&str, Quantity),
) {
    canvas.text(left, top, title, INK);
    for (slice, &k) in (0..).zip(&layout.slices) {
        let [x, y] = layout.slice_origin(slice);
        let origin = [left + x, top + y];
        view.draw(canvas, origin, k, quantity);
        let at = view.coordinate(k);
        let axis = AXES[view.plane.across];
        let label = match at.abs() == 0.0 || (1e-2..1e5).contains(&at.abs()) {
            true => format!("{axis} {at:.3}"),
            false => format!("{axis} {at:.1e}"),
        };
        canvas.text(origin[0], origin[1] + layout.tile[1], &label, DIM);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordinals_end_as_they_are_spoken() {
        let spoken = [2, 3, 4, 11, 12, 13, 21, 22].map(ordinal);
        let expected = ["2nd", "3rd", "4th", "11th", "12th", "13th", "21st", "22nd"];
        assert_eq!(spoken, expected);
    }
}
