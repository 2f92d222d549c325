//! The picture of a preview: three rows of three panels.

use std::io::Cursor;

use anyhow::Context;
use aogrid_grid_format::Grid;
use aogrid_scene::suite::Area;
use glam::DVec3;
use image::ImageFormat;

use super::Previewed;
use crate::canvas::{Canvas, Color, DIM, GLYPH_SIZE, INK};
use crate::commands::slices::outline;
use crate::panels::{GAP, LINE, NO_SURFACE, Panel, SCALE_HEIGHT, gray, signed};

/// The colors of a lit surface: its ambient light, and a lamp from the upper right.
const AMBIENT: f32 = 0.55;
const LAMP: f32 = 0.45;

/// The model's outline in slices.
const OUTLINE: Color = [255, 120, 0];

/// The width of the frame that remains around a slice.
const MARGIN: f64 = 4.0;

/// Returns the picture as PNG.
pub(super) fn png(previewed: &Previewed) -> anyhow::Result<Vec<u8>> {
    let (gbuffer, pixels) = previewed
        .target
        .picture
        .as_ref()
        .context("a preview has a camera")?;
    let [width, height] = gbuffer.size;
    let row = height + 2 * LINE + SCALE_HEIGHT;
    let mut canvas = Canvas::new(3 * (width + GAP) + GAP, LINE + 3 * row + GAP);
    canvas.text(GAP, 2, &previewed.title, INK);
    let mut panel = Panel {
        canvas: &mut canvas,
        width,
        pixels,
    };
    let at = |column: u32, line: u32| [GAP + column * (width + GAP), 2 * LINE + line * row];
    occlusion(&mut panel, previewed, height, &at);
    light(&mut panel, previewed, height, &at);
    errors(panel.canvas, previewed, at(2, 1));
    for axis in 0..3 {
        let [x, y] = at(axis as u32, 2);
        let label = format!("the grid, cut across {}", ["x", "y", "z"][axis]);
        panel.canvas.text(x, y - LINE + 2, &label, INK);
        slice(panel.canvas, previewed, axis, [x, y], [width, height]);
    }
    let mut png = Cursor::new(Vec::new());
    canvas
        .into_image()
        .write_to(&mut png, ImageFormat::Png)
        .context("cannot encode the picture")?;
    Ok(png.into_inner())
}

/// Draws the first row: truth, the grid, and their difference.
fn occlusion(
    panel: &mut Panel<'_>,
    previewed: &Previewed,
    height: u32,
    at: &impl Fn(u32, u32) -> [u32; 2],
) {
    let Previewed { truth, shaded, .. } = previewed;
    let [truth, shaded] = [truth, shaded].map(|shaded| &shaded.occlusion);
    let panels = [("ray tracing: 1 - AO", truth), ("aogrid: 1 - AO", shaded)];
    for (column, (label, values)) in (0..).zip(panels) {
        let [x, y] = at(column, 0);
        panel.canvas.text(x, y - LINE + 2, label, INK);
        panel.clear([x, y], NO_SURFACE, height);
        panel.fill([x, y], values, gray);
    }
    let [x, y] = at(2, 0);
    let rmse = previewed.errors.all.as_ref().map_or(0.0, |all| all.rmse);
    let label = format!("aogrid less ray tracing: RMSE {rmse:.3}");
    panel.canvas.text(x, y - LINE + 2, &label, INK);
    panel.clear([x, y], NO_SURFACE, height);
    let differences: Vec<_> = shaded.iter().zip(truth).map(|(a, b)| a - b).collect();
    panel.fill([x, y], &differences, signed);
    panel.scale([x, y + height + 2]);
}

/// Draws the lit scene without and with the grid.
fn light(
    panel: &mut Panel<'_>,
    previewed: &Previewed,
    height: u32,
    at: &impl Fn(u32, u32) -> [u32; 2],
) {
    let receivers = &previewed.target.receivers;
    let up = previewed.up;
    let lamp = (up + DVec3::new(0.6, 0.5, 0.4) * (DVec3::ONE - up)).normalize();
    let facing = receivers
        .iter()
        .map(|receiver| DVec3::from(receiver.normal).dot(lamp).max(0.0) as f32);
    let facing: Vec<f32> = facing.collect();
    let open = vec![0.0; receivers.len()];
    let panels = [
        ("lit, without the grid", &open),
        ("lit, with the grid", &previewed.shaded.occlusion),
    ];
    for (column, (label, occlusion)) in (0..).zip(panels) {
        let [x, y] = at(column, 1);
        panel.canvas.text(x, y - LINE + 2, label, INK);
        panel.clear([x, y], NO_SURFACE, height);
        let pairs = facing.iter().zip(occlusion);
        let lit: Vec<f32> = pairs
            .map(|(facing, ao)| AMBIENT * (1.0 - ao) + LAMP * facing)
            .collect();
        // Displays expect the root of light, nearly.
        panel.fill([x, y], &lit, |light| gray(1.0 - light.powf(1.0 / 2.2)));
    }
}

/// Writes the errors by area, and the facts of the grid.
fn errors(canvas: &mut Canvas, previewed: &Previewed, [x, y]: [u32; 2]) {
    let spec = previewed.grid.spec();
    let [nx, ny, nz] = spec.resolution();
    let [ex, ey, ez] = spec.half_extents().map(|e| 2.0 * e);
    let mut lines = vec![
        (
            format!(
                "grid   {nx} x {ny} x {nz} cells, {} KiB",
                previewed.bytes.div_ceil(1024)
            ),
            INK,
        ),
        (
            format!("box    {ex:.3} x {ey:.3} x {ez:.3}, the model's units"),
            INK,
        ),
        (
            format!("mesh   {} triangles", previewed.mesh.triangles().len()),
            INK,
        ),
        (String::new(), INK),
        ("error of AO   RMSE    95 %    pixels".to_owned(), INK),
    ];
    let areas = Area::ALL.iter().zip(&previewed.errors.areas);
    let mut row = |name: &str, stats: &aogrid_scene::suite::ErrorStats| {
        let text = format!(
            "{name:11}{:7.3}{:8.3}{:10}",
            stats.rmse, stats.p95, stats.receivers
        );
        lines.push((text, INK));
    };
    for (area, stats) in areas.filter_map(|(area, stats)| Some((area, stats.as_ref()?))) {
        row(area.name(), stats);
    }
    if let Some(all) = &previewed.errors.all {
        row("all", all);
    }
    let notes = [
        "",
        "near    within a cell of the papers' grid",
        "rest    farther away, in the papers' box",
        "beyond  outside it",
        "itself  the model's own surface",
        "",
        "Below, the share of all directions that the",
        "model hides: white none, black all.",
    ];
    lines.extend(notes.map(|note| (note.to_owned(), DIM)));
    for (line, (text, color)) in (0..).zip(lines) {
        canvas.text(x, y + line * (GLYPH_SIZE + 5), &text, color);
    }
}

/// Draws the middle of the grid across an axis, with the model's outline.
fn slice(
    canvas: &mut Canvas,
    previewed: &Previewed,
    axis: usize,
    [x, y]: [u32; 2],
    [width, height]: [u32; 2],
) {
    let grid = &previewed.grid;
    let spec = grid.spec();
    // The next two axes go right and up, unless the first of them is the model's own up.
    let next = [(axis + 1) % 3, (axis + 2) % 3];
    let is_turned = previewed.up[next[0]] == 1.0;
    let [right, up] = if is_turned { [next[1], next[0]] } else { next };
    let e = spec.half_extents().map(f64::from);
    let free = [width, height].map(|side| f64::from(side) - 2.0 * MARGIN);
    let scale = (free[0] / (2.0 * e[right])).min(free[1] / (2.0 * e[up]));
    let [w, h] = [right, up].map(|a| ((2.0 * e[a] * scale) as u32).max(1));
    let [x, y] = [x + (width - w) / 2, y + (height - h) / 2];
    let n = spec.resolution();
    for j in 0..h {
        for i in 0..w {
            let mut cell = n.map(|n| n / 2);
            cell[right] = (u64::from(i) * u64::from(n[right]) / u64::from(w)) as u32;
            cell[up] = (u64::from(h - 1 - j) * u64::from(n[up]) / u64::from(h)) as u32;
            canvas.set(x + i, y + j, color(grid, spec.cell_idx(cell)));
        }
    }
    let center = spec.center().map(f64::from);
    for segment in outline::cut(&previewed.mesh, axis, center[axis]) {
        let pixel = |[p, q]: [f64; 2]| {
            let p = if is_turned { [q, p] } else { [p, q] };
            let [u, v] = [p[0] - center[right] + e[right], p[1] - center[up] + e[up]];
            [u * scale, f64::from(h) - v * scale]
        };
        canvas.line([x, y], [w, h], segment.map(pixel), OUTLINE);
    }
}

/// Returns the color of a cell: the root of what is open, so that little occlusion is seen, too.
fn color(grid: &Grid, idx: usize) -> Color {
    let [.., a] = grid.cell(idx);
    gray(a.max(0.0).sqrt())
}
