//! Legends: the scales of a grid's quantities, and the marks of its cells.

use super::canvas::{Canvas, DIM, GLYPH_HEIGHT, GLYPH_WIDTH, INK};
use super::slice::{DOUBTFUL, INTERIOR, OUTLINE, direction_color, occlusion_color};

/// The height of the legends with their titles and numbers, in pixels.
pub(crate) const SCALES_HEIGHT: u32 = BALL_SIDE + GLYPH_HEIGHT + 8;

/// The side of the scale of directions, in pixels.
const BALL_SIDE: u32 = 72;

const BAR: [u32; 2] = [360, 20];

/// The occlusion fractions that the scale names.
const TICKS: [f32; 7] = [0.0, 0.01, 0.05, 0.1, 0.25, 0.5, 1.0];

/// Names the outline and the marks of cells, in their colors.
pub(crate) fn draw_marks(canvas: &mut Canvas, [left, top]: [u32; 2]) {
    let mut x = left;
    for (text, color) in [
        ("outline of the model", OUTLINE),
        ("dots: interior, filled from around", INTERIOR),
        ("hatched: inside or outside in doubt", DOUBTFUL),
    ] {
        canvas.text(x, top, text, color);
        x += (text.chars().count() as u32 + 3) * GLYPH_WIDTH;
    }
}

/// Draws the scale of occlusion, and the scales of directions `quantity` seen along an axis.
pub(crate) fn draw_scales(canvas: &mut Canvas, [left, top]: [u32; 2], directions: Option<&str>) {
    draw_occlusion(canvas, [left, top]);
    let Some(quantity) = directions else { return };
    for (i, (sign, title)) in (0..).zip([(1.0, "z > 0"), (-1.0, "z < 0")]) {
        let left = left + BAR[0] + 60 + i * (BALL_SIDE + 60);
        let title = format!("{quantity}, {title}");
        canvas.text(left, top, &title, INK);
        draw_ball(canvas, [left, top + GLYPH_HEIGHT + 4], sign);
    }
    let x = left + BAR[0] + 60 + 2 * (BALL_SIDE + 60);
    let lines = [
        "the more red, the more +x",
        "the more green, the more +y",
        "the more blue, the more +z",
    ];
    for (line, text) in (1..).zip(lines) {
        canvas.text(x, top + line * GLYPH_HEIGHT + 4, text, DIM);
    }
}

fn draw_occlusion(canvas: &mut Canvas, [left, top]: [u32; 2]) {
    canvas.text(left, top, "a, the hidden share of all directions", INK);
    let [width, height] = BAR;
    let top = top + GLYPH_HEIGHT + 4;
    for x in 0..width {
        let root = x as f32 / (width - 1) as f32;
        (0..height).for_each(|y| canvas.set(left + x, top + y, occlusion_color(root * root)));
    }
    for tick in TICKS {
        let x = (tick.sqrt() * (width - 1) as f32).round() as u32;
        (0..4).for_each(|y| canvas.set(left + x, top + height + y, DIM));
        let text = format!("{tick}");
        let half = text.len() as u32 * GLYPH_WIDTH / 2;
        canvas.text(left + x.saturating_sub(half), top + height + 4, &text, DIM);
    }
}

/// Draws the hemisphere of directions whose z has the sign of `sign`, seen from +z.
fn draw_ball(canvas: &mut Canvas, [left, top]: [u32; 2], sign: f32) {
    for row in 0..BALL_SIDE {
        for column in 0..BALL_SIDE {
            let centered = |i: u32| (2 * i + 1) as f32 / BALL_SIDE as f32 - 1.0;
            let (x, y) = (centered(column), -centered(row));
            let square = 1.0 - x * x - y * y;
            if square >= 0.0 {
                let color = direction_color([x, y, sign * square.sqrt()]);
                canvas.set(left + column, top + row, color);
            }
        }
    }
}
