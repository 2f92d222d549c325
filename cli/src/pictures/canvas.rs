//! A raster image with lines and text.

use image::{Rgb, RgbImage};
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

const WEIGHT: FontWeight = FontWeight::Regular;
const SIZE: RasterHeight = RasterHeight::Size16;

/// The width and the height of a character with the space around it, in pixels.
pub const GLYPH_WIDTH: u32 = get_raster_width(WEIGHT, SIZE) as u32;
pub const GLYPH_HEIGHT: u32 = SIZE.val() as u32;

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
            let glyph =
                get_raster(character, WEIGHT, SIZE).or_else(|| get_raster('?', WEIGHT, SIZE));
            let rows = glyph.iter().flat_map(|glyph| glyph.rows());
            for (row, coverages) in (y..).zip(rows) {
                for (column, &coverage) in (x..).zip(coverages) {
                    self.blend(column, row, color, f32::from(coverage) / 255.0);
                }
            }
            x += GLYPH_WIDTH;
        }
    }

    /// Mixes the share `opacity` of a color into a pixel; does nothing outside the image.
    fn blend(&mut self, x: u32, y: u32, color: Color, opacity: f32) {
        if let Some(Rgb(pixel)) = self.0.get_pixel_mut_checked(x, y) {
            for (old, new) in pixel.iter_mut().zip(color) {
                let mixed = f32::from(*old) * (1.0 - opacity) + f32::from(new) * opacity;
                *old = mixed.round() as u8;
            }
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
    fn text_has_the_width_of_its_characters() {
        let mut canvas = Canvas::new(40, GLYPH_HEIGHT);
        canvas.text(0, 0, "HH", INK);
        let image = canvas.into_image();
        let is_inked = |x: u32| (0..GLYPH_HEIGHT).any(|y| image.get_pixel(x, y).0 != BACKGROUND);
        let inked = |from: u32| (from..from + GLYPH_WIDTH).map(is_inked).collect::<Vec<_>>();
        assert!(inked(0).contains(&true));
        assert_eq!(inked(0), inked(GLYPH_WIDTH));
        assert!(!inked(2 * GLYPH_WIDTH).contains(&true));
    }

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
