//! The tables as heat maps.

use std::io::Cursor;

use anyhow::Context;
use aogrid_tables::{ClipTable, MergeTable};
use image::ImageFormat;

use aogrid::pictures::canvas::{Canvas, Color, DIM, GLYPH_HEIGHT, GLYPH_WIDTH, INK};

/// Side of a map, in pixels.
const MAP_SIDE: u32 = 256;
const MARGIN: u32 = 24;
/// Gap between maps, with room for the labels of the axes.
const GAP: u32 = 48;
/// Height of the labels above and below a map.
const LABEL_HEIGHT: u32 = 2 * GLYPH_HEIGHT + 4;
const SCALE_HEIGHT: u32 = 12;

/// A map of a function of two variables in 0..=1, with its labels.
struct Map<'a> {
    title: String,
    /// Labels of the axes to the right and upwards.
    axes: [&'a str; 2],
    value: Box<dyn Fn(f32, f32) -> f32 + 'a>,
}

/// Draws AO, a' and f over a (to the right, 0 to 1) and cos β (upwards, −1 to 1).
pub(super) fn clip(table: &ClipTable) -> anyhow::Result<Vec<u8>> {
    let map = |title: &str, channel: fn(aogrid_tables::Clip<f32>) -> f32| Map {
        title: format!("T_clip: {title}"),
        axes: ["a, 0 to 1", "cos beta, -1 to 1"],
        value: Box::new(move |x, y| channel(table.sample(x, 2.0 * y - 1.0))),
    };
    let maps = [
        map("AO", |clip| clip.occlusion),
        map("a'", |clip| clip.fraction),
        map("f", |clip| clip.axis_weight),
    ];
    draw(&maps, 3)
}

/// Draws the union over a1 (to the right) and a2 (upwards) for six angles.
pub(super) fn merge(table: &MergeTable) -> anyhow::Result<Vec<u8>> {
    let maps = [0_u16, 30, 60, 90, 135, 180].map(|degrees| Map {
        title: format!("T_merge: gamma = {degrees} degrees"),
        axes: ["a1, 0 to 1", "a2, 0 to 1"],
        value: Box::new(move |x, y| table.sample(x, y, f32::from(degrees).to_radians())),
    });
    draw(&maps, 3)
}

fn draw(maps: &[Map<'_>], columns: u32) -> anyhow::Result<Vec<u8>> {
    let rows = (maps.len() as u32).div_ceil(columns);
    let (across, down) = (MAP_SIDE + GAP, MAP_SIDE + 2 * LABEL_HEIGHT + GAP / 2);
    let width = 2 * MARGIN + columns * across - GAP;
    let height = 2 * MARGIN + rows * down + SCALE_HEIGHT + LABEL_HEIGHT;
    let mut canvas = Canvas::new(width, height);
    for (idx, map) in (0..).zip(maps) {
        let left = MARGIN + idx % columns * across;
        draw_map(&mut canvas, [left, MARGIN + idx / columns * down], map);
    }
    draw_scale(&mut canvas, [MARGIN, MARGIN + rows * down]);
    let mut png = Cursor::new(Vec::new());
    canvas
        .into_image()
        .write_to(&mut png, ImageFormat::Png)
        .context("cannot encode the picture")?;
    Ok(png.into_inner())
}

fn draw_map(canvas: &mut Canvas, [left, top]: [u32; 2], map: &Map<'_>) {
    canvas.text(left, top, &map.title, INK);
    canvas.text(
        left,
        top + GLYPH_HEIGHT,
        &format!("up: {}", map.axes[1]),
        DIM,
    );
    let top = top + LABEL_HEIGHT;
    for row in 0..MAP_SIDE {
        for column in 0..MAP_SIDE {
            let (x, y) = (unit(column), unit(MAP_SIDE - 1 - row));
            canvas.set(left + column, top + row, color((map.value)(x, y)));
        }
    }
    let right = format!("right: {}", map.axes[0]);
    canvas.text(left, top + MAP_SIDE + 4, &right, DIM);
}

fn draw_scale(canvas: &mut Canvas, [left, top]: [u32; 2]) {
    for column in 0..MAP_SIDE {
        for row in 0..SCALE_HEIGHT {
            canvas.set(left + column, top + row, color(unit(column)));
        }
    }
    for (x, text) in [
        (0, "0"),
        (MAP_SIDE / 2 - 12, "0.5"),
        (MAP_SIDE - GLYPH_WIDTH, "1"),
    ] {
        canvas.text(left + x, top + SCALE_HEIGHT + 4, text, DIM);
    }
}

/// Maps a pixel's coordinate to 0..=1.
fn unit(pixel: u32) -> f32 {
    pixel as f32 / (MAP_SIDE - 1) as f32
}

/// Maps 0..=1 to the Viridis scale, dark blue to yellow.
fn color(value: f32) -> Color {
    let colorous::Color { r, g, b } = colorous::VIRIDIS.eval_continuous(value.into());
    [r, g, b]
}
