//! Environment maps from OpenEXR files.

use std::io::Cursor;

use exr::math::Vec2;
use exr::meta::attribute::{EnvironmentMap, Text};
use exr::meta::header::Header;
use exr::meta::{Headers, MetaData};
use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel};

use super::{Picture, check_size};
use crate::error::{bail, ensure};

/// The maximum size in bytes of a decoded image with all its channels.
const MAX_BYTES: usize = 512 << 20;

/// Reads the largest level of the first layer that has the channels R, G and B, or else Y alone. A
/// layer is a part of the file or the channels whose names begin alike, as `ViewLayer.Combined.R`.
///
/// The picture is the display window: what the data window lacks of it is black, what the data window
/// has beyond it is left out.
pub(super) fn read(bytes: &[u8]) -> crate::Result<Picture> {
    // Check the headers first, so that a hostile file cannot make us allocate much memory.
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)?;
    meta.headers.iter().try_for_each(check)?;
    let (header, names) = channels(&meta.headers)?;
    let display = header.shared_attributes.display_window;
    let size = [display.size.width(), display.size.height()];
    check_size(size)?;
    // The position of the data window in the display window.
    let offset = header.own_attributes.layer_position - display.position;
    let black = move || Picture {
        size,
        texels: vec![[0.0; 3]; size[0] * size[1]],
    };
    let place = move |picture: &mut Picture, at: Vec2<usize>, texel: [f32; 3]| {
        let within = |at: usize, offset: i32, size: usize| {
            let at = usize::try_from(at as i64 + i64::from(offset)).ok()?;
            (at < size).then_some(at)
        };
        let x = within(at.x(), offset.x(), size[0]);
        let y = within(at.y(), offset.y(), size[1]);
        if let (Some(x), Some(y)) = (x, y) {
            picture.texels[y * size[0] + x] = texel;
        }
    };
    let reader = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels();
    /// Reads the pixels of the first layer that has the channels.
    macro_rules! read_first {
        ($channels:expr) => {
            $channels
                .first_valid_layer()
                .all_attributes()
                .non_parallel()
                .from_buffered(Cursor::new(bytes))?
                .layer_data
                .channel_data
                .pixels
        };
    }
    Ok(match names {
        Names::Color([r, g, b]) => {
            let channels = reader.required(r).required(g).required(b);
            read_first!(channels.collect_pixels(
                move |_, _| black(),
                move |picture, at, (r, g, b): (f32, f32, f32)| place(picture, at, [r, g, b]),
            ))
        }
        Names::Gray(y) => read_first!(reader.required(y).collect_pixels(
            move |_, _| black(),
            move |picture, at, (y,): (f32,)| place(picture, at, [y; 3]),
        )),
    })
}

/// The channels of a picture.
enum Names {
    Color([Text; 3]),
    /// Luminance alone.
    Gray(Text),
}

fn check(header: &Header) -> crate::Result<()> {
    let Vec2(width, height) = header.layer_size;
    check_size([width, height])?;
    let layer = width
        .checked_mul(height)
        .zip(Some(header.channels.bytes_per_pixel));
    let layer = layer.and_then(|(texels, bytes)| texels.checked_mul(bytes));
    let block = header.max_block_byte_size();
    ensure!(
        layer.is_some_and(|bytes| bytes <= MAX_BYTES) && block <= MAX_BYTES,
        "its channels take more than {} MiB: leave out all but R, G and B",
        MAX_BYTES >> 20
    );
    ensure!(
        header.own_attributes.environment_map != Some(EnvironmentMap::Cube),
        "it is a cube map; a latitude-longitude map is needed"
    );
    Ok(())
}

/// Returns the first header with the channels of a color, and their names. Luminance alone is gray.
fn channels(headers: &Headers) -> crate::Result<(&Header, Names)> {
    let names = |header: &Header| -> Vec<String> {
        let list = header.channels.list.iter();
        list.map(|channel| channel.name.to_string()).collect()
    };
    for wanted in [&["R", "G", "B"][..], &["Y"]] {
        for header in headers {
            let names = names(header);
            // Channels without a layer's name go before those with one.
            let prefixes = names.iter().filter_map(|name| name.strip_suffix(wanted[0]));
            let mut prefixes: Vec<_> = prefixes
                .filter(|prefix| prefix.is_empty() || prefix.ends_with('.'))
                .collect();
            prefixes.sort_by_key(|prefix| !prefix.is_empty());
            for prefix in prefixes {
                let full = wanted.iter().map(|name| format!("{prefix}{name}"));
                let full: Vec<String> = full.filter(|name| names.contains(name)).collect();
                let text = |idx: usize| Text::from(full[idx].as_str());
                match full.len() {
                    3 => return Ok((header, Names::Color([0, 1, 2].map(text)))),
                    1 if wanted.len() == 1 => return Ok((header, Names::Gray(text(0)))),
                    _ => {}
                }
            }
        }
    }
    let all: Vec<String> = headers.iter().flat_map(names).collect();
    bail!(
        "it has no channels R, G and B, of any layer, and no Y; it has: {}",
        all.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use exr::image::write::WritableImage;
    use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
    use exr::math::Vec2;
    use exr::meta::attribute::IntegerBounds;
    use exr::meta::header::{ImageAttributes, LayerAttributes};

    use super::*;

    /// Returns a layer of 4 × 2 texels at a position: a channel's value is that of its name, plus ten
    /// times the row.
    fn layer(
        name: Option<&str>,
        channels: &[(&str, f32)],
        position: [i32; 2],
    ) -> Layer<AnyChannels<FlatSamples>> {
        let samples = |value: f32| (0..8).map(|i| value + (i / 4 * 10) as f32).collect();
        let list = channels
            .iter()
            .map(|(name, value)| AnyChannel::new(*name, FlatSamples::F32(samples(*value))));
        let attributes = LayerAttributes {
            layer_name: name.map(Text::from),
            layer_position: Vec2(position[0], position[1]),
            ..LayerAttributes::default()
        };
        let channels = AnyChannels::sort(list.collect());
        Layer::new((4, 2), attributes, Encoding::UNCOMPRESSED, channels)
    }

    fn file(
        layers: Vec<Layer<AnyChannels<FlatSamples>>>,
        display: ([i32; 2], [usize; 2]),
    ) -> Vec<u8> {
        let ([x, y], [width, height]) = display;
        let window = IntegerBounds::new((x, y), (width, height));
        let image = Image::from_layers(ImageAttributes::new(window), layers);
        let mut bytes = Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    const WHOLE: ([i32; 2], [usize; 2]) = ([0, 0], [4, 2]);
    const RGB: [(&str, f32); 3] = [("R", 2.0), ("G", 1.0), ("B", 0.5)];

    fn texels(bytes: &[u8]) -> Vec<[f32; 3]> {
        read(bytes).unwrap().texels
    }

    /// Report 10: crop and overscan.
    #[test]
    fn the_picture_is_the_display_window() {
        let plain = texels(&file(vec![layer(None, &RGB, [0, 0])], WHOLE));
        assert_eq!((plain[0], plain[7]), ([2.0, 1.0, 0.5], [12.0, 11.0, 10.5]));
        // The data window is the upper half of the display window.
        let cropped = read(&file(vec![layer(None, &RGB, [0, 0])], ([0, 0], [4, 4]))).unwrap();
        assert_eq!(cropped.size, [4, 4]);
        assert_eq!(cropped.texels[..8], plain);
        assert!(cropped.texels[8..].iter().all(|t| *t == [0.0; 3]));
        // It reaches one texel beyond the display window on the left and above, whose corner is not
        // at zero.
        let overscan = read(&file(vec![layer(None, &RGB, [6, 7])], ([7, 8], [3, 1]))).unwrap();
        assert_eq!(
            (overscan.size, &overscan.texels[..]),
            ([3, 1], &plain[5..8])
        );
    }

    /// Report 10: layers in EXR's sense, in names of channels and as parts of the file.
    #[test]
    fn channels_of_layers_are_found() {
        let plain = texels(&file(vec![layer(None, &RGB, [0, 0])], WHOLE));
        for prefix in ["ViewLayer.Combined.", "env."] {
            let named = RGB.map(|(name, value)| (format!("{prefix}{name}"), value));
            let mut channels: Vec<_> = named.iter().map(|(n, v)| (n.as_str(), *v)).collect();
            channels.push(("Z", 9.0));
            let layers = vec![layer(None, &channels, [0, 0])];
            assert_eq!(texels(&file(layers, WHOLE)), plain, "{prefix}");
        }
        let depth = layer(Some("depth"), &[("Z", 9.0)], [0, 0]);
        let beauty = [("beauty.R", 2.0), ("beauty.G", 1.0), ("beauty.B", 0.5)];
        let beauty = layer(Some("beauty"), &beauty, [0, 0]);
        assert_eq!(texels(&file(vec![depth, beauty], WHOLE)), plain);
        // Names without a layer go first.
        let both = [
            ("a.R", 9.0),
            ("a.G", 9.0),
            ("a.B", 9.0),
            RGB[0],
            RGB[1],
            RGB[2],
        ];
        assert_eq!(
            texels(&file(vec![layer(None, &both, [0, 0])], WHOLE)),
            plain
        );
    }

    #[test]
    fn luminance_is_gray_and_other_channels_are_named() {
        let gray = texels(&file(vec![layer(None, &[("Y", 3.0)], [0, 0])], WHOLE));
        assert_eq!(gray[0], [3.0; 3]);
        let lower = [("r", 2.0), ("g", 1.0), ("b", 0.5)];
        let error = read(&file(vec![layer(None, &lower, [0, 0])], WHOLE))
            .err()
            .unwrap();
        assert!(error.to_string().ends_with("it has: b, g, r"), "{error}");
    }
}
