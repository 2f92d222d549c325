//! The pictures that examples write.

use std::path::Path;
use std::process::Command;

use image::RgbaImage;

/// Runs a command to its end and reads the image that it writes.
///
/// # Panics
///
/// If the command fails, prints a validation error or writes no picture.
pub fn picture(command: &mut Command, png: &Path) -> RgbaImage {
    let output = command.output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(!said.contains("alidation"), "{said}");
    image::open(png).expect("a picture").into_rgba8()
}

/// Returns the mean brightness of 8×8 pixels around a point, whose coordinates are 0..1 of the
/// image's size.
pub fn brightness(picture: &RgbaImage, x: f32, y: f32) -> f32 {
    color(picture, x, y).iter().sum::<f32>() / 3.0
}

/// Returns the mean of 8×8 pixels around a point, for each color channel.
pub fn color(picture: &RgbaImage, x: f32, y: f32) -> [f32; 3] {
    let at = |t: f32, size: u32| (t * size as f32) as u32 - 4;
    let (x, y) = (at(x, picture.width()), at(y, picture.height()));
    let pixels = (0..64).map(|i| picture.get_pixel(x + i % 8, y + i / 8).0);
    pixels.fold([0.0; 3], |sum, pixel| {
        std::array::from_fn(|c| sum[c] + f32::from(pixel[c]) / (64.0 * 255.0))
    })
}
