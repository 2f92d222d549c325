//! A raster image with lines and text.

use font8x8::{BASIC_FONTS, LATIN_FONTS, UnicodeFonts};
use image::{Rgb, RgbImage};

/// The width and height of a character, in pixels.
pub const GLYPH_SIZE: u32 = 8;

pub type Color = [u8; 3];

pub const BACKGROUND: Color = [24, 24, 28];
pub const INK: Color = [225, 225, 225];
pub const DIM: Color = [150, 150, 155];

/// An RGB image to draw on.
pub struct Canvas(RgbImage);

impl Canvas {
    pub fn new(width: u32, height: u32) -> Self {
        Self(RgbImage::from_pixel(width, height, Rgb(BACKGROUND)))
    }

    pub fn into_image(self) -> RgbImage {
        self.0
    }

    /// Sets a pixel; does nothing outside the image.
    pub fn set(&mut self, x: u32, y: u32, color: Color) {
        if let Some(pixel) = self.0.get_pixel_mut_checked(x, y) {
            *pixel = Rgb(color);
        }
    }

    /// Writes `text` with its upper left corner at (x, y).
    pub fn text(&mut self, mut x: u32, y: u32, text: &str, color: Color) {
        for character in text.chars() {
            let glyph = BASIC_FONTS
                .get(character)
                .or_else(|| LATIN_FONTS.get(character));
            let glyph = glyph.or_else(|| BASIC_FONTS.get('?')).unwrap_or_default();
            for (row, bits) in (0..).zip(glyph) {
                for column in (0..GLYPH_SIZE).filter(|column| bits >> column & 1 == 1) {
                    self.set(x + column, y + row, color);
                }
            }
            x += GLYPH_SIZE;
        }
    }

    /// Draws a line from `a` to `b`, in pixels relative to `origin`, clipped to the rectangle of
    /// `size` at `origin`.
    pub fn line(&mut self, origin: [u32; 2], size: [u32; 2], [a, b]: [[f64; 2]; 2], color: Color) {
        let Some([a, b]) = clip(a, b, size.map(f64::from)) else {
            return;
        };
        let steps = (b[0] - a[0]).abs().max((b[1] - a[1]).abs()).ceil().max(1.0);
        for step in 0..=steps as u32 {
            let t = f64::from(step) / steps;
            let at = |x: usize| (a[x] + t * (b[x] - a[x])).floor().max(0.0) as u32;
            let [x, y] = [at(0).min(size[0] - 1), at(1).min(size[1] - 1)];
            self.set(origin[0] + x, origin[1] + y, color);
        }
    }
}

/// Returns the part of the segment within 0..=size, if there is one (Liang and Barsky).
fn clip(a: [f64; 2], b: [f64; 2], size: [f64; 2]) -> Option<[[f64; 2]; 2]> {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for x in 0..2 {
        let d = b[x] - a[x];
        if d == 0.0 {
            if !(0.0..=size[x]).contains(&a[x]) {
                return None;
            }
            continue;
        }
        let (t0, t1) = (-a[x] / d, (size[x] - a[x]) / d);
        from = from.max(t0.min(t1));
        to = to.min(t0.max(t1));
    }
    let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
    (from <= to).then(|| [at(from), at(to)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_clipped_to_their_rectangle() {
        assert_eq!(
            clip([-5.0, 1.0], [5.0, 1.0], [4.0; 2]),
            Some([[0.0, 1.0], [4.0, 1.0]])
        );
        assert_eq!(clip([-5.0, 1.0], [-1.0, 1.0], [4.0; 2]), None);
        assert_eq!(clip([1.0, 9.0], [1.0, 5.0], [4.0; 2]), None);
        let mut canvas = Canvas::new(8, 8);
        canvas.line([2, 2], [4, 4], [[-9.0, 0.5], [99.0, 0.5]], INK);
        let image = canvas.into_image();
        let row: Vec<_> = (0..8).map(|x| image.get_pixel(x, 2).0 == INK).collect();
        assert_eq!(row, [false, false, true, true, true, true, false, false]);
    }
}
