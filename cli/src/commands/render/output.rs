//! Pictures and tables of shading results.

use std::io::Cursor;

use anyhow::Context;
use image::{ImageFormat, Rgb, RgbImage};

use aogrid_scene::shade::{Mode, ShadeInput, Shaded};
use aogrid_scene::{GBuffer, ReceiverList};

/// Gap between modes side by side, in pixels.
const GAP: u32 = 4;
const GAP_COLOR: [u8; 3] = [24, 24, 28];

/// Returns a PNG with the modes side by side.
pub(super) fn png(
    input: &ShadeInput<'_>,
    (gbuffer, pixels): &(GBuffer, Vec<usize>),
    shaded: &[(&Mode, Shaded)],
) -> anyhow::Result<Vec<u8>> {
    let [width, height] = gbuffer.size;
    let modes = shaded.len() as u32;
    let mut image = RgbImage::from_pixel(modes * (width + GAP) - GAP, height, Rgb(GAP_COLOR));
    let exposure = input.scene.exposure;
    for (mode, (_, shaded)) in (0..).zip(shaded) {
        let mut put = |pixel: usize, color| {
            let (x, y) = (pixel as u32 % width, pixel as u32 / width);
            image.put_pixel(mode * (width + GAP) + x, y, Rgb(color));
        };
        match shaded.light.as_ref().filter(|_| input.scene.shows_light) {
            None => {
                // Pixels without a surface are unoccluded.
                (0..gbuffer.ids.len()).for_each(|pixel| put(pixel, [255; 3]));
                for (&pixel, &ao) in pixels.iter().zip(&shaded.occlusion) {
                    put(pixel, [byte(1.0 - ao); 3]);
                }
            }
            Some(light) => {
                for (pixel, color) in sky(input, gbuffer).into_iter().enumerate() {
                    put(pixel, display(color, exposure));
                }
                for (idx, &pixel) in pixels.iter().enumerate() {
                    put(pixel, display(reflected(input, idx, light[idx]), exposure));
                }
            }
        }
    }
    let mut png = Cursor::new(Vec::new());
    image
        .write_to(&mut png, ImageFormat::Png)
        .context("cannot encode the picture")?;
    Ok(png.into_inner())
}

/// Returns an EXR file with the channels of every mode: `AO`, `AO.stderr`, and in a lit scene `R`,
/// `G`, `B` and their errors. With several modes, names are prefixed with the mode and a point.
pub(super) fn exr(
    input: &ShadeInput<'_>,
    (gbuffer, pixels): &(GBuffer, Vec<usize>),
    shaded: &[(&Mode, Shaded)],
) -> anyhow::Result<Vec<u8>> {
    let sky = match input.scene.is_lit() {
        true => sky(input, gbuffer),
        false => vec![],
    };
    let mut channels = vec![];
    let alone = shaded.len() == 1;
    for (mode, shaded) in shaded {
        for Column {
            name,
            values,
            color,
        } in columns(input, shaded)
        {
            let mut all: Vec<f32> = match color {
                None => vec![0.0; gbuffer.ids.len()],
                Some(c) => sky.iter().map(|color| color[c]).collect(),
            };
            for (&pixel, value) in pixels.iter().zip(values) {
                all[pixel] = value;
            }
            let name = match alone {
                true => name,
                false => format!("{}.{name}", mode.name),
            };
            channels.push(aogrid_scene::channel(&name, all.into_iter()));
        }
    }
    Ok(aogrid_scene::exr(gbuffer.size, channels)?)
}

/// Returns a CSV table with the list's own columns and, for every mode, AO as `MODE` and its other
/// quantities as `MODE.NAME`; prefixed with `rendered.` if the list has a column of that name.
pub(super) fn csv(
    input: &ShadeInput<'_>,
    list: &ReceiverList,
    shaded: &[(&Mode, Shaded)],
) -> anyhow::Result<Vec<u8>> {
    let mut header = list.columns.clone();
    let mut added: Vec<Vec<f32>> = vec![];
    for (mode, shaded) in shaded {
        for Column { name, values, .. } in columns(input, shaded) {
            let mode = mode.name;
            let mut title = match name.strip_prefix("AO") {
                Some(rest) => format!("{mode}{rest}"),
                None => format!("{mode}.{name}"),
            };
            // The list may bring values of the same name to compare with.
            if list.columns.contains(&title) {
                title.insert_str(0, TAKEN_PREFIX);
            }
            header.push(title);
            added.push(values);
        }
    }
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&header)?;
    for (idx, row) in list.rows.iter().enumerate() {
        let values = added.iter().map(|values| values[idx].to_string());
        writer.write_record(row.iter().cloned().chain(values))?;
    }
    writer.into_inner().context("cannot write the table")
}

/// Prefix of a column's name that the list has already.
const TAKEN_PREFIX: &str = "rendered.";

/// A quantity with a value for every receiver.
struct Column {
    name: String,
    values: Vec<f32>,
    /// The sky's color channel for pixels without a receiver; `None` for 0.
    color: Option<usize>,
}

fn columns(input: &ShadeInput<'_>, shaded: &Shaded) -> Vec<Column> {
    let column = |name: &str, values: Vec<f32>, color| Column {
        name: name.to_owned(),
        values,
        color,
    };
    let mut columns = vec![column("AO", shaded.occlusion.clone(), None)];
    if let Some(errors) = &shaded.occlusion_error {
        columns.push(column("AO.stderr", errors.clone(), None));
    }
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        let of = |light: &[[f32; 3]]| {
            let light = light.iter().enumerate();
            light.map(|(idx, &l)| reflected(input, idx, l)[c]).collect()
        };
        if let Some(light) = &shaded.light {
            columns.push(column(name, of(light), Some(c)));
        }
        if let Some(errors) = &shaded.light_error {
            columns.push(column(&format!("{name}.stderr"), of(errors), None));
        }
    }
    columns
}

/// Returns the radiance from receiver `idx`: light times the albedo of its instance's material, if
/// the instance is known.
fn reflected(input: &ShadeInput<'_>, idx: usize, light: [f32; 3]) -> [f32; 3] {
    let albedo = input.albedo(idx);
    std::array::from_fn(|c| light[c] * albedo[c])
}

/// Returns the radiance that each pixel would see without objects.
fn sky(input: &ShadeInput<'_>, gbuffer: &GBuffer) -> Vec<[f32; 3]> {
    let [width, height] = gbuffer.size;
    let pixels = (0..width * height).map(|pixel| [pixel % width, pixel / width]);
    let (Some(environment), Some(camera)) = (input.environment, &input.scene.camera) else {
        return pixels.map(|_| input.scene.ambient).collect();
    };
    let radiance = |at| {
        let [_, direction] = camera.ray(at);
        let radiance = environment.radiance(direction.into());
        std::array::from_fn(|c| radiance[c] + input.scene.ambient[c])
    };
    pixels.map(radiance).collect()
}

/// Converts radiance to sRGB; channels above 1 after exposure are clipped.
fn display(radiance: [f32; 3], exposure: f32) -> [u8; 3] {
    radiance.map(|v| {
        let v = (v * exposure).clamp(0.0, 1.0);
        byte(match v {
            v if v <= 0.003_130_8 => 12.92 * v,
            v => 1.055 * v.powf(1.0 / 2.4) - 0.055,
        })
    })
}

fn byte(v: f32) -> u8 {
    (255.0 * v.clamp(0.0, 1.0)).round() as u8
}
