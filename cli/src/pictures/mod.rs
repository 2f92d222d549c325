//! Parts of pictures: a canvas with text, panels of shading results, and slices of grids.

pub(crate) mod baked_model;
pub mod canvas;
pub(crate) mod outline;
pub(crate) mod panels;
pub(crate) mod scales;
pub(crate) mod slice;

use std::io::Cursor;

use anyhow::Context;
use image::{ImageFormat, RgbImage};

/// Encodes an image as PNG.
pub(crate) fn png(image: &RgbImage) -> anyhow::Result<Vec<u8>> {
    let mut png = Cursor::new(Vec::new());
    image
        .write_to(&mut png, ImageFormat::Png)
        .context("cannot encode the picture")?;
    Ok(png.into_inner())
}
