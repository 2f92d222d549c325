//! The picture of the grid itself: three slices through its middle.

use aogrid_grid_format::{Encoding, Grid};

use super::Previewed;
use crate::commands::info::interior_line;
use crate::pictures::baked_model::BakedModel;
use crate::pictures::canvas::{Canvas, DIM, GLYPH_HEIGHT, INK};
use crate::pictures::scales::{SCALES_HEIGHT, draw_marks, draw_scales};
use crate::pictures::slice::{AXES, Plane, Quantity, SliceView};

/// The longer side of a slice, and its minimum shorter side, in pixels.
const SIDE: f64 = 400.0;
const MIN_SIDE: u32 = 24;

const MARGIN: u32 = 16;
const LINE: u32 = GLYPH_HEIGHT + 4;

/// Returns the picture as PNG: occlusion above, directions below, one column an axis.
pub(super) fn png(previewed: &Previewed, model: &BakedModel) -> anyhow::Result<Vec<u8>> {
    let grid = &previewed.grid;
    let vertical = previewed.vertical;
    let views = [0, 1, 2].map(|axis| {
        SliceView::new(
            grid,
            Some(model),
            Plane::across(axis, vertical),
            SIDE,
            MIN_SIDE,
        )
    });
    let column = SIDE as u32 + MARGIN;
    let tallest = views.iter().map(|view| view.size[1]).max().unwrap_or(0);
    let row = tallest + 2 * LINE;
    let contents = contents(previewed);
    let top = MARGIN + (1 + contents.len() as u32) * LINE;
    let height = top + LINE + 2 * row + SCALES_HEIGHT + MARGIN;
    let mut canvas = Canvas::new(3 * column + MARGIN, height);
    canvas.text(MARGIN, MARGIN, &previewed.title, INK);
    for (line, text) in (1..).zip(&contents) {
        canvas.text(MARGIN, MARGIN + line * LINE, text, DIM);
    }
    draw_marks(&mut canvas, [MARGIN, top]);
    let symbol = direction_symbol(grid);
    let quantities = [
        ("a, hidden share", Quantity::Occlusion),
        (symbol, Quantity::Direction),
    ];
    for (line, (title, quantity)) in (0..).zip(quantities) {
        for (idx, view) in (0..).zip(&views) {
            let k = view.count() / 2;
            let [x, y] = [MARGIN + idx * column, top + LINE + line * row];
            let axis = AXES[view.plane.across];
            let label = format!(
                "{title}, across {axis} at {:.3}: {}",
                view.coordinate(k),
                view.plane.directions()
            );
            canvas.text(x, y, &label, INK);
            view.draw(&mut canvas, [x, y + LINE], k, quantity);
        }
    }
    draw_scales(&mut canvas, [MARGIN, top + LINE + 2 * row], Some(symbol));
    crate::pictures::png(&canvas.into_image())
}

/// Returns the symbol of a grid's directions.
fn direction_symbol(grid: &Grid) -> &'static str {
    match grid.encoding() {
        Encoding::Moment => "v",
        _ => "d",
    }
}

/// Returns lines that tell what the grid holds.
fn contents(previewed: &Previewed) -> Vec<String> {
    let grid = &previewed.grid;
    let (spec, statistics) = (grid.spec(), grid.statistics());
    let [nx, ny, nz] = spec.resolution();
    let [ex, ey, ez] = spec.half_extents().map(|e| 2.0 * e);
    vec![
        format!(
            "{nx}×{ny}×{nz} cells, box {ex:.3} × {ey:.3} × {ez:.3}; encoding {}, {}, {} KiB",
            grid.encoding().name(),
            grid.format().name(),
            previewed.bytes.div_ceil(1024)
        ),
        format!(
            "mean a {:.4}, largest {:.4}; {}",
            statistics.mean,
            statistics.largest,
            interior_line(grid.record())
        ),
    ]
}
