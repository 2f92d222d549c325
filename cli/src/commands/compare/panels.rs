//! Panels side by side: truth and the modes as 1 − AO, and below each mode its signed difference.

use std::io::Cursor;

use anyhow::Context;
use aogrid_scene::GBuffer;
use image::ImageFormat;

use super::Compared;
use crate::canvas::{Canvas, Color, DIM, GLYPH_SIZE, INK};

/// The gap between panels, and the height of a line of text, in pixels.
const GAP: u32 = 8;
const LINE: u32 = GLYPH_SIZE + 6;

/// The difference at the ends of the color scale.
const MAX_DIFFERENCE: f32 = 0.25;

/// The colors of no difference, and of too dark and too light a shade.
const EQUAL: [f32; 3] = [245.0, 245.0, 245.0];
const TOO_DARK: [f32; 3] = [178.0, 24.0, 43.0];
const TOO_LIGHT: [f32; 3] = [33.0, 102.0, 172.0];

/// The color of pixels without a surface.
const NO_SURFACE: Color = [60, 60, 66];

/// The height of a color scale.
const SCALE_HEIGHT: u32 = 10;

/// Returns the panels as PNG.
pub(super) fn png(
    compared: &Compared<'_>,
    (gbuffer, pixels): &(GBuffer, Vec<usize>),
) -> anyhow::Result<Vec<u8>> {
    let [width, height] = gbuffer.size;
    let columns = compared.modes.len() as u32 + 1;
    let (top, bottom) = (LINE, 2 * LINE + height);
    let mut canvas = Canvas::new(
        columns * (width + GAP) - GAP,
        bottom + height + LINE + SCALE_HEIGHT,
    );
    let mut panel = Panel {
        canvas: &mut canvas,
        width,
        pixels,
    };
    panel.clear([0, top], [255; 3], height);
    panel.fill([0, top], &compared.truth.occlusion, gray);
    panel.canvas.text(0, 2, "truth", INK);
    let pairs = compared.modes.iter().zip(compared.errors);
    for (column, ((mode, shaded), errors)) in (1..).zip(pairs) {
        let x = column * (width + GAP);
        let truth = &compared.truth.occlusion;
        let differences = shaded.occlusion.iter().zip(truth).map(|(a, b)| a - b);
        panel.clear([x, top], [255; 3], height);
        panel.fill([x, top], &shaded.occlusion, gray);
        panel.clear([x, bottom], NO_SURFACE, height);
        panel.fill([x, bottom], &differences.collect::<Vec<_>>(), signed);
        panel.canvas.text(x, 2, mode.name, INK);
        if let Some(all) = &errors.all {
            let text = format!("less truth: RMSE {:.4}, bias {:+.4}", all.rmse, all.bias);
            panel.canvas.text(x, bottom - LINE + 2, &text, INK);
        }
        panel.scale([x, bottom + height + 2]);
    }
    let mut png = Cursor::new(Vec::new());
    let image = canvas.into_image();
    image
        .write_to(&mut png, ImageFormat::Png)
        .context("cannot encode the panels")?;
    Ok(png.into_inner())
}

/// A canvas that panels are drawn on.
struct Panel<'a> {
    canvas: &'a mut Canvas,
    /// The width of a panel.
    width: u32,
    /// The pixel of each receiver.
    pixels: &'a [usize],
}

impl Panel<'_> {
    fn clear(&mut self, [x, y]: [u32; 2], color: Color, height: u32) {
        for idx in 0..self.width * height {
            self.canvas
                .set(x + idx % self.width, y + idx / self.width, color);
        }
    }

    fn fill(&mut self, [x, y]: [u32; 2], values: &[f32], color: fn(f32) -> Color) {
        for (&pixel, &value) in self.pixels.iter().zip(values) {
            let pixel = pixel as u32;
            let at = [x + pixel % self.width, y + pixel / self.width];
            self.canvas.set(at[0], at[1], color(value));
        }
    }

    /// Draws the scale of differences, with its ends and its middle named.
    fn scale(&mut self, [x, y]: [u32; 2]) {
        for i in 0..self.width {
            let value = MAX_DIFFERENCE * (2.0 * i as f32 / (self.width - 1) as f32 - 1.0);
            (0..SCALE_HEIGHT).for_each(|j| self.canvas.set(x + i, y + j, signed(value)));
        }
        let labels = [
            (format!("-{MAX_DIFFERENCE} too light"), 0.0),
            ("0".to_owned(), 0.5),
            (format!("too dark +{MAX_DIFFERENCE}"), 1.0),
        ];
        for (text, along) in labels {
            let free = self.width.saturating_sub(text.len() as u32 * GLYPH_SIZE);
            let start = x + (along * free as f32) as u32;
            self.canvas.text(start, y + SCALE_HEIGHT + 2, &text, DIM);
        }
    }
}

fn gray(occlusion: f32) -> Color {
    [(255.0 * (1.0 - occlusion).clamp(0.0, 1.0)).round() as u8; 3]
}

fn signed(difference: f32) -> Color {
    let end = if difference > 0.0 {
        TOO_DARK
    } else {
        TOO_LIGHT
    };
    let t = (difference.abs() / MAX_DIFFERENCE).min(1.0);
    std::array::from_fn(|c| (EQUAL[c] + t * (end[c] - EQUAL[c])).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_dark_is_red_and_too_light_is_blue() {
        let [r, _, b] = signed(0.1);
        assert!(r > b);
        let [r, _, b] = signed(-0.1);
        assert!(r < b);
        assert_eq!(signed(0.0), [245; 3]);
        assert_eq!(signed(9.0), [178, 24, 43]);
    }
}
