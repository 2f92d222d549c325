//! Environment maps from Radiance HDR files.
//!
//! The header is read here: the image crate, which decodes the scan lines, accepts one form of it.

use std::io::Cursor;

use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;

use super::{Picture, check_size};
use crate::error::{bail, ensure};

/// The content of a header.
struct Header {
    /// The factors that the file's values are physical radiance times.
    factors: [f32; 3],
    layout: Layout,
    /// The number of bytes before the scan lines.
    length: usize,
}

/// The order of scan lines and of the texels in them.
struct Layout {
    /// The number of scan lines, and that of texels in each.
    size: [usize; 2],
    /// Whether scan lines are columns.
    is_transposed: bool,
    /// Whether the first column is on the right, and whether the first row is at the bottom.
    flips: [bool; 2],
}

/// Reads a map as physical radiance: values divided by EXPOSURE and COLORCORR.
pub(super) fn read(bytes: &[u8]) -> crate::Result<Picture> {
    let Header {
        factors,
        layout,
        length,
    } = header(bytes)?;
    let [n_lines, n_texels] = layout.size;
    check_size(layout.size)?;
    let mut plain =
        format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {n_lines} +X {n_texels}\n").into_bytes();
    plain.extend(&bytes[length..]);
    let decoder = HdrDecoder::new(Cursor::new(plain))?;
    let mut decoded = vec![0; 12 * n_lines * n_texels];
    decoder.read_image(&mut decoded)?;
    let value = |texel: usize, channel: usize| {
        let start = 12 * texel + 4 * channel;
        let bytes = std::array::from_fn(|byte| decoded[start + byte]);
        f32::from_ne_bytes(bytes) / factors[channel]
    };
    let (width, height) = match layout.is_transposed {
        true => (n_lines, n_texels),
        false => (n_texels, n_lines),
    };
    let texel = |idx: usize| {
        let flipped = |at: usize, n: usize, flip: bool| if flip { n - 1 - at } else { at };
        let x = flipped(idx % width, width, layout.flips[0]);
        let y = flipped(idx / width, height, layout.flips[1]);
        let source = match layout.is_transposed {
            true => x * n_texels + y,
            false => y * n_texels + x,
        };
        std::array::from_fn(|channel| value(source, channel))
    };
    Ok(Picture {
        size: [width, height],
        texels: (0..width * height).map(texel).collect(),
    })
}

fn header(bytes: &[u8]) -> crate::Result<Header> {
    let mut factors = [1.0; 3];
    let mut length = 0;
    let mut next_line = || {
        let rest = &bytes[length..];
        let end = rest.iter().position(|b| *b == b'\n')?;
        length += end + 1;
        Some(String::from_utf8_lossy(&rest[..end]).trim().to_owned())
    };
    // The first line is `#?RADIANCE`, `#?RGBE` or another program's name.
    next_line();
    loop {
        let Some(line) = next_line() else {
            bail!("its header does not end");
        };
        if line.is_empty() {
            break;
        }
        let Some((key, value)) = line.split_once('=') else {
            continue;
        };
        match key.trim() {
            "FORMAT" => ensure!(
                value.trim() == "32-bit_rle_rgbe",
                "its format is {}; only 32-bit_rle_rgbe is supported: convert it",
                value.trim()
            ),
            // All values of a header multiply.
            "EXPOSURE" => {
                let [exposure] = positive("EXPOSURE", value)?;
                factors = factors.map(|factor| factor * exposure);
            }
            "COLORCORR" => {
                let correction: [f32; 3] = positive("COLORCORR", value)?;
                factors = std::array::from_fn(|c| factors[c] * correction[c]);
            }
            _ => {}
        }
    }
    let Some(line) = next_line() else {
        bail!("it has no resolution");
    };
    let Some(layout) = layout(&line) else {
        bail!("its resolution `{line}` is malformed; an example is `-Y 512 +X 1024`");
    };
    Ok(Header {
        factors,
        layout,
        length,
    })
}

fn positive<const N: usize>(key: &str, text: &str) -> crate::Result<[f32; N]> {
    let numbers = text.split_whitespace().map(str::parse);
    let numbers: Vec<f32> = numbers.collect::<Result<_, _>>().unwrap_or_default();
    match <[f32; N]>::try_from(numbers) {
        Ok(numbers) if numbers.iter().all(|v| *v > 0.0 && v.is_finite()) => Ok(numbers),
        _ => bail!("its {key} `{}` needs {N} numbers above zero", text.trim()),
    }
}

/// Parses a resolution such as `-Y 512 +X 1024`: scan lines from the top, texels from the left.
fn layout(line: &str) -> Option<Layout> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [first, n_lines, second, n_texels] = words[..] else {
        return None;
    };
    let (x, y, is_transposed) = match (first, second) {
        ("-Y" | "+Y", "-X" | "+X") => (second, first, false),
        ("-X" | "+X", "-Y" | "+Y") => (first, second, true),
        _ => return None,
    };
    Some(Layout {
        size: [n_lines.parse().ok()?, n_texels.parse().ok()?],
        is_transposed,
        flips: [x == "-X", y == "+Y"],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a file whose texel `i` in file order has the red radiance 2^i.
    fn file(header: &str, resolution: &str, n: u8) -> Vec<u8> {
        let mut bytes = format!("{header}\n\n{resolution}\n").into_bytes();
        // A mantissa of 128 stands for a half.
        bytes.extend((0..n).flat_map(|i| [128, 64, 32, 129 + i]));
        bytes
    }

    const PLAIN: &str = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe";

    fn red(bytes: &[u8]) -> Vec<f32> {
        read(bytes)
            .unwrap()
            .texels
            .iter()
            .map(|texel| texel[0])
            .collect()
    }

    /// Report 09: the first line of other programs.
    #[test]
    fn any_program_may_have_written_it() {
        let plain = red(&file(PLAIN, "-Y 1 +X 2", 2));
        assert_eq!(plain, [1.0, 2.0]);
        for first in ["#?RGBE", "#?AUTOPANO", "#?RADIANCE\nSOFTWARE=x"] {
            assert_eq!(red(&file(first, "-Y 1 +X 2", 2)), plain, "{first}");
        }
    }

    /// Report 09: values are radiance times EXPOSURE and COLORCORR.
    #[test]
    fn exposure_and_color_correction_divide() {
        let header = format!("{PLAIN}\nEXPOSURE=4.0\nEXPOSURE= 0.5\nCOLORCORR=1 0.5 2");
        let picture = read(&file(&header, "-Y 1 +X 1", 1)).unwrap();
        assert_eq!(picture.texels, [[0.5, 0.5, 0.0625]]);
        for wrong in ["EXPOSURE=0", "EXPOSURE=x", "COLORCORR=1 2"] {
            let wrong = file(&format!("{PLAIN}\n{wrong}"), "-Y 1 +X 1", 1);
            let error = read(&wrong).err().unwrap().to_string();
            assert!(error.contains("above zero"), "{error}");
        }
    }

    #[test]
    fn all_orientations_are_read() {
        // Texels of the file, from 1 by doubling, in a picture of 3 × 2.
        for (resolution, expected) in [
            ("-Y 2 +X 3", [1, 2, 4, 8, 16, 32]),
            ("+Y 2 +X 3", [8, 16, 32, 1, 2, 4]),
            ("-Y 2 -X 3", [4, 2, 1, 32, 16, 8]),
            ("+Y 2 -X 3", [32, 16, 8, 4, 2, 1]),
            ("+X 3 -Y 2", [1, 4, 16, 2, 8, 32]),
            ("+X 3 +Y 2", [2, 8, 32, 1, 4, 16]),
            ("-X 3 -Y 2", [16, 4, 1, 32, 8, 2]),
            ("-X 3 +Y 2", [32, 8, 2, 16, 4, 1]),
        ] {
            let bytes = file(PLAIN, resolution, 6);
            assert_eq!(read(&bytes).unwrap().size, [3, 2], "{resolution}");
            let found: Vec<i32> = red(&bytes).iter().map(|v| *v as i32).collect();
            assert_eq!(found, expected, "{resolution}");
        }
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        let error = |header: &str, resolution: &str| {
            let bytes = file(header, resolution, 1);
            read(&bytes).err().unwrap().to_string()
        };
        let xyze = error("#?RADIANCE\nFORMAT=32-bit_rle_xyze", "-Y 1 +X 1");
        assert!(xyze.contains("32-bit_rle_xyze"), "{xyze}");
        for wrong in ["-Y 1 +Y 1", "1 1", "-Y 1 +X", "-Y -1 +X 1"] {
            assert!(error(PLAIN, wrong).contains(wrong), "{wrong}");
        }
        assert!(error(PLAIN, "-Y 0 +X 1").contains("no texels"));
        assert!(
            read(b"#?RADIANCE\nFORMAT=")
                .err()
                .unwrap()
                .to_string()
                .contains("end")
        );
        assert!(read(&file(PLAIN, "-Y 9 +X 9", 1)).is_err());
    }
}
