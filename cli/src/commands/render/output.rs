//! Pictures and tables of shading results.

use anyhow::Context;
use aogrid_scene::shade::{Mode, ShadeInput, Shaded};
use aogrid_scene::{GBuffer, ReceiverList};

use crate::pictures::canvas::{Canvas, Color, INK};
use crate::pictures::panels::{GAP, LINE, NO_SURFACE, gray};

/// Returns a PNG of one mode, or of several side by side under their names.
pub(super) fn png(
    input: &ShadeInput<'_>,
    picture: &(GBuffer, Vec<usize>),
    shaded: &[(&Mode, Shaded)],
) -> anyhow::Result<Vec<u8>> {
    let [width, height] = picture.0.size;
    let (modes, gap) = (shaded.len() as u32, GAP);
    let top = if modes > 1 { LINE } else { 0 };
    let mut canvas = Canvas::new(modes * (width + gap) - gap, top + height);
    let truth = shaded.iter().find(|(mode, _)| mode.name == TRUTH);
    for (mode, (column, shaded)) in (0..).zip(shaded) {
        let left = mode * (width + gap);
        if modes > 1 {
            let label = label(column, shaded, truth.map(|(_, truth)| truth));
            canvas.text(left, 1, &label, INK);
        }
        for (pixel, color) in colors(input, picture, shaded).into_iter().enumerate() {
            let pixel = pixel as u32;
            canvas.set(left + pixel % width, top + pixel / width, color);
        }
    }
    crate::pictures::png(&canvas.into_image())
}

/// The mode that the others are measured against.
const TRUTH: &str = "truth";

/// Returns a mode's name and, beside truth, the error of its occlusion.
fn label(mode: &Mode, shaded: &Shaded, truth: Option<&Shaded>) -> String {
    let Some(truth) = truth.filter(|_| mode.name != TRUTH) else {
        return mode.name.to_owned();
    };
    let pairs = shaded.occlusion.iter().zip(&truth.occlusion);
    let squares: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let rmse = (squares / shaded.occlusion.len().max(1) as f64).sqrt();
    format!("{}: RMSE of AO {rmse:.3}", mode.name)
}

/// Returns the color of each pixel: light in a lit scene, else 1 − AO.
fn colors(
    input: &ShadeInput<'_>,
    (gbuffer, pixels): &(GBuffer, Vec<usize>),
    shaded: &Shaded,
) -> Vec<Color> {
    let exposure = input.scene.exposure;
    let Some(light) = shaded.light.as_ref().filter(|_| input.scene.shows_light) else {
        let mut colors = vec![NO_SURFACE; gbuffer.ids.len()];
        for (&pixel, &ao) in pixels.iter().zip(&shaded.occlusion) {
            colors[pixel] = gray(ao);
        }
        return colors;
    };
    let sky = sky(input, gbuffer).into_iter();
    let mut colors: Vec<_> = sky.map(|color| display(color, exposure)).collect();
    for (idx, &pixel) in pixels.iter().enumerate() {
        colors[pixel] = display(reflected(input, idx, light[idx]), exposure);
    }
    colors
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
