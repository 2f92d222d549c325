//! The picture that compares a grid with ray tracing: two rows of three panels.

use anyhow::Context;
use aogrid_scene::suite::Area;
use glam::DVec3;

use super::Previewed;
use crate::pictures::canvas::{Canvas, DIM, GLYPH_HEIGHT, INK};
use crate::pictures::panels::{GAP, LINE, NO_SURFACE, Panel, SCALE_HEIGHT, gray, signed};

/// The colors of a lit surface: its ambient light, and a lamp from the upper right.
const AMBIENT: f32 = 0.5;
const LAMP: f32 = 0.5;

/// The colors of the model, and of floor and wall.
const MODEL: [f32; 3] = [0.72, 0.42, 0.22];
const GROUND: [f32; 3] = [0.55, 0.57, 0.6];

/// Returns the picture as PNG.
pub(super) fn png(previewed: &Previewed) -> anyhow::Result<Vec<u8>> {
    let (gbuffer, pixels) = previewed
        .target
        .picture
        .as_ref()
        .context("a preview has a camera")?;
    let [width, height] = gbuffer.size;
    let row = height + 2 * LINE + SCALE_HEIGHT;
    let mut canvas = Canvas::new(3 * (width + GAP) + GAP, LINE + 2 * row + GAP);
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
    crate::pictures::png(&canvas.into_image())
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
    let panels = [
        ("ray tracing: 1 - AO, white is unoccluded", truth),
        ("aogrid: 1 - AO, white is unoccluded", shaded),
    ];
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
        let colors = lit.iter().zip(&previewed.target.ids).map(|(light, id)| {
            let albedo = if *id == previewed.model_id {
                MODEL
            } else {
                GROUND
            };
            // Displays expect the root of light, nearly.
            albedo.map(|c| (255.0 * (c * light).powf(1.0 / 2.2)).round() as u8)
        });
        panel.paint([x, y], colors);
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
                "grid   {nx} × {ny} × {nz} cells, {} KiB",
                previewed.bytes.div_ceil(1024)
            ),
            INK,
        ),
        (
            format!("box    {ex:.3} × {ey:.3} × {ez:.3} in the model's units"),
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
        "95 %    error that 95 of 100 pixels stay below",
        "near    within a cell of the papers' grid",
        "rest    farther away, in the papers' box",
        "beyond  outside it",
        "itself  the model's own surface",
    ];
    lines.extend(notes.map(|note| (note.to_owned(), DIM)));
    for (line, (text, color)) in (0..).zip(lines) {
        canvas.text(x, y + line * (GLYPH_HEIGHT + 2), &text, color);
    }
}
