//! Panels of a picture: AO and its signed difference from the truth, as colors.

use super::canvas::{Canvas, Color, DIM, GLYPH_HEIGHT, GLYPH_WIDTH};

/// The gap between panels, and the height of a line of text, in pixels.
pub(crate) const GAP: u32 = 8;
pub(crate) const LINE: u32 = GLYPH_HEIGHT + 4;

/// The difference at the ends of the color scale.
const MAX_DIFFERENCE: f32 = 0.25;

/// The colors of no difference, and of too dark and too light a shade.
const EQUAL: [f32; 3] = [245.0, 245.0, 245.0];
const TOO_DARK: [f32; 3] = [178.0, 24.0, 43.0];
const TOO_LIGHT: [f32; 3] = [33.0, 102.0, 172.0];

/// The color of pixels without a surface.
pub(crate) const NO_SURFACE: Color = [60, 60, 66];

/// The height of a color scale.
pub(crate) const SCALE_HEIGHT: u32 = 10;

/// A canvas that panels are drawn on.
pub(crate) struct Panel<'a> {
    pub(crate) canvas: &'a mut Canvas,
    /// The width of a panel.
    pub(crate) width: u32,
    /// The pixel of each receiver.
    pub(crate) pixels: &'a [usize],
}

impl Panel<'_> {
    /// Fills a panel of this height with a color.
    pub(crate) fn clear(&mut self, [x, y]: [u32; 2], color: Color, height: u32) {
        for idx in 0..self.width * height {
            self.canvas
                .set(x + idx % self.width, y + idx / self.width, color);
        }
    }

    /// Sets the pixels of the receivers to the colors of their values.
    pub(crate) fn fill(&mut self, origin: [u32; 2], values: &[f32], color: impl Fn(f32) -> Color) {
        self.paint(origin, values.iter().map(|&value| color(value)));
    }

    /// Sets the pixels of the receivers to their colors.
    pub(crate) fn paint(&mut self, [x, y]: [u32; 2], colors: impl Iterator<Item = Color>) {
        for (&pixel, color) in self.pixels.iter().zip(colors) {
            let pixel = pixel as u32;
            self.canvas
                .set(x + pixel % self.width, y + pixel / self.width, color);
        }
    }

    /// Draws the scale of differences, with its ends and its middle named.
    pub(crate) fn scale(&mut self, [x, y]: [u32; 2]) {
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
            let free = self.width.saturating_sub(text.len() as u32 * GLYPH_WIDTH);
            let start = x + (along * free as f32) as u32;
            self.canvas.text(start, y + SCALE_HEIGHT + 2, &text, DIM);
        }
    }
}

/// Returns the gray of 1 − AO.
pub(crate) fn gray(occlusion: f32) -> Color {
    [(255.0 * (1.0 - occlusion).clamp(0.0, 1.0)).round() as u8; 3]
}

/// Returns the color of a difference of AO: red for too dark, blue for too light.
pub(crate) fn signed(difference: f32) -> Color {
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
