//! Exports of every encoding and format, read by other readers.

use std::io::Cursor;

use aogrid_grid_format::{
    BakeRecord, Boundary, BoundaryMode, ChannelRange, Encoding, Grid, GridSpec, Interior, Sampling,
    Source, TexelFormat,
};
use ddsfile::{D3D10ResourceDimension, Dds, DxgiFormat};
use serde_json::Value;

use super::flipbook::Layout;
use super::{dds, exr, flipbook, sidecar};

/// Cells along the axes: all different, so that none can be taken for another, and with rows whose bytes
/// are no multiple of four.
const RESOLUTION: [u32; 3] = [9, 10, 12];

/// Half a step of 16 bits for a signed channel and for one in 0..1, and the rounding of single floats.
const SIGNED_STEP: f32 = 0.5 / 32_767.0 + f32::EPSILON;
const UNIT_STEP: f32 = 0.5 / 65_535.0 + f32::EPSILON;

/// Returns a grid with different values in all cells, zero and the ends of the ranges among them.
fn grid(encoding: Encoding, format: TexelFormat) -> Grid {
    let spec = GridSpec::new(RESOLUTION, [1.0, -2.0, 0.5], [1.5, 2.0, 3.0]).unwrap();
    let n = spec.cell_count();
    let cell = |idx: usize| {
        let t = idx as f32 / (n - 1) as f32;
        [t, 1.0 - 2.0 * t, 0.5 * t * t - 0.25, (1.0 - t) * (1.0 - t)]
    };
    let mut cells: Vec<_> = (0..n).map(cell).collect();
    cells[1] = [0.0; 4];
    cells[2] = [1.0, -1.0, 0.0, 1.0];
    let record = BakeRecord {
        epsilon: Some(0.8),
        sample_offset: [0.0; 3],
        sampling: Sampling::CubeFaces { size: 16 },
        max_distance: None,
        interior: Interior::Signed,
        interior_cells: 0,
        inside: None,
        snap: true,
        fit: false,
        self_offset: 0.25,
        flatness: [0.5, 0.0, 0.0, 0.25],
        check: None,
        without: vec![],
        boundary: Boundary {
            requested: BoundaryMode::None,
            applied: BoundaryMode::None,
            v_m: 0.0,
        },
        source: Source {
            name: "a.obj".into(),
            part: None,
            blake3: "0".repeat(64),
            triangles: 1,
        },
    };
    Grid::encode(spec, encoding, format, &cells, record).unwrap()
}

/// Returns a grid of each encoding and format.
fn grids() -> impl Iterator<Item = Grid> {
    let kinds = Encoding::ALL
        .into_iter()
        .flat_map(|encoding| TexelFormat::ALL.map(|format| (encoding, format)));
    kinds.map(|(encoding, format)| grid(encoding, format))
}

/// Returns the decoding of a texel's channels by a sidecar, in double precision.
fn decoded(json: &Value, t: &[f64]) -> Vec<f64> {
    let channels = json["channels"].as_array().unwrap();
    assert_eq!(channels.len(), t.len());
    let value = |(channel, t): (&Value, &f64)| {
        channel["scale"].as_f64().unwrap() * t + channel["offset"].as_f64().unwrap()
    };
    channels.iter().zip(t).map(value).collect()
}

/// The DXGI numbers of the formats, from Microsoft's documentation, by channels and bytes a channel.
fn dxgi(channels: usize, bytes: usize) -> u32 {
    match (channels, bytes) {
        (1, 1) => 61,
        (1, 2) => 54,
        (1, 4) => 41,
        (4, 1) => 28,
        (4, 2) => 10,
        _ => 2,
    }
}

#[test]
fn volume_textures_are_read_by_the_crate_and_at_the_documented_offsets() {
    for grid in grids() {
        let bytes = dds::encode(&grid).unwrap();
        let read = Dds::read(&bytes[..]).unwrap();
        assert_eq!(read.data, grid.texels());
        let size = [read.get_width(), read.get_height(), read.get_depth()];
        assert_eq!(size, RESOLUTION);
        let header = read.header10.as_ref().unwrap();
        assert_eq!(header.resource_dimension, D3D10ResourceDimension::Texture3D);
        assert_ne!(
            read.get_dxgi_format(),
            Some(DxgiFormat::R8G8B8A8_UNorm_sRGB)
        );

        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!((&bytes[..4], word(4)), (&b"DDS "[..], 124));
        assert_eq!([word(16), word(12), word(24)], RESOLUTION);
        // Caps, height, width, pixel format and depth are valid; the volume bits of both caps are set.
        assert_eq!(word(8) & 0x0080_1007, 0x0080_1007);
        assert_eq!(&bytes[84..88], b"DX10");
        assert_eq!(
            (word(112) & 0x20_0000, word(108) & 0x1000),
            (0x20_0000, 0x1000)
        );
        let channels = grid.encoding().channels();
        assert_eq!(word(128), dxgi(channels, grid.format().channel_bytes()));
        assert_eq!([word(132), word(136), word(140)], [4, 0, 1]);
        assert_eq!(bytes[148..], *grid.texels());
        let json = serde_json::to_value(sidecar::volume(&grid)).unwrap();
        check_values(
            &grid,
            &json,
            |cell, channel| {
                let at = 148
                    + (grid.spec().cell_idx(cell) * channels + channel)
                        * grid.format().channel_bytes();
                f64::from(grid.format().shader_value(&bytes[at..]))
            },
            [f32::EPSILON; 2],
        );
        assert_eq!(json["flipbook"], Value::Null);
    }
}

/// Compares what a texture's channels decode to by its sidecar with the grid, each within the tolerance
/// for a signed channel and for one in 0..1.
fn check_values(
    grid: &Grid,
    json: &Value,
    t: impl Fn([u32; 3], usize) -> f64,
    [signed, unit]: [f32; 2],
) {
    let channels = grid.encoding().channel_list();
    let values = grid.decode();
    for idx in 0..grid.spec().cell_count() {
        let cell = grid.spec().cell_at(idx);
        let t: Vec<f64> = (0..channels.len())
            .map(|channel| t(cell, channel))
            .collect();
        for (x, found) in decoded(json, &t).into_iter().enumerate() {
            let expected = f64::from(values[idx * channels.len() + x]);
            let tolerance = match channels[x].range {
                ChannelRange::Signed => signed,
                ChannelRange::Unit => unit,
            };
            assert!(
                (found - expected).abs() <= f64::from(tolerance),
                "{:?} {cell:?}: {found} {expected}",
                grid.encoding()
            );
            assert_eq!(json["channels"][x]["name"], channels[x].name);
        }
    }
}

/// Returns the pixel of a cell by what a sidecar says.
fn pixel(json: &Value, [i, j, k]: [u32; 3]) -> [u32; 2] {
    let book = &json["flipbook"];
    let number = |value: &Value| value.as_u64().unwrap() as u32;
    let columns = number(&book["columns"]);
    assert_eq!(book["y"], "up");
    assert_eq!(columns * number(&book["rows"]), RESOLUTION[2]);
    let [width, height] = [0, 1].map(|x| number(&book["slice"][x]));
    assert_eq!([width, height], RESOLUTION[..2]);
    let row = k / columns;
    [k % columns * width + i, row * height + height - 1 - j]
}

#[test]
fn flip_books_decode_to_the_grid() {
    for grid in grids() {
        let layout = Layout::of(RESOLUTION);
        let png = flipbook::encode(&grid, &layout).unwrap();
        let json = serde_json::to_value(sidecar::flipbook(&grid, &layout)).unwrap();
        let image = image::load_from_memory(&png).unwrap();
        assert_eq!([image.width(), image.height()], layout.size);
        let bits = if grid.format() == TexelFormat::Unorm8 {
            8
        } else {
            16
        };
        let channels = grid.encoding().channels();
        assert_eq!(usize::from(image.color().bits_per_pixel()), bits * channels);
        let wide = image.to_rgba16();
        let t = |cell, channel: usize| {
            let [x, y] = pixel(&json, cell);
            f64::from(wide.get_pixel(x, y)[channel]) / 65_535.0
        };
        let tolerance = match grid.format() {
            TexelFormat::Unorm8 => [f32::EPSILON; 2],
            _ => [SIGNED_STEP, UNIT_STEP],
        };
        check_values(&grid, &json, t, tolerance);
    }
}

#[test]
fn zero_stays_zero_in_a_flip_book() {
    for bits in TexelFormat::ALL {
        let grid = grid(Encoding::Moment, bits);
        let layout = Layout::of(RESOLUTION);
        let png = flipbook::encode(&grid, &layout).unwrap();
        let json = serde_json::to_value(sidecar::flipbook(&grid, &layout)).unwrap();
        let [x, y] = pixel(&json, [1, 0, 0]);
        let image = image::load_from_memory(&png).unwrap().to_rgba16();
        let t = image.get_pixel(x, y).0.map(|v| f64::from(v) / 65_535.0);
        for value in decoded(&json, &t) {
            assert!(value.abs() < 1e-12, "{bits:?}: {value}");
        }
    }
}

#[test]
fn exr_pictures_hold_the_decoded_values_exactly() {
    use ::exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
    for grid in grids() {
        let layout = Layout::of(RESOLUTION);
        let bytes = exr::encode(&grid, &layout).unwrap();
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .unwrap();
        let json = serde_json::to_value(sidecar::decoded(&grid, &layout)).unwrap();
        let list = &image.layer_data.channel_data.list;
        let width = layout.size[0] as usize;
        let names: Vec<_> = grid.encoding().channel_names().collect();
        assert_eq!(list.len(), names.len());
        let t = |cell, channel: usize| {
            let [x, y] = pixel(&json, cell).map(|v| v as usize);
            let channel = list.iter().find(|c| c.name == *names[channel]).unwrap();
            let is_half = matches!(channel.sample_data, FlatSamples::F16(_));
            assert_eq!(is_half, grid.format() == TexelFormat::F16);
            f64::from(
                channel
                    .sample_data
                    .value_by_flat_index(y * width + x)
                    .to_f32(),
            )
        };
        check_values(&grid, &json, t, [0.0; 2]);
    }
}

#[test]
fn layouts_leave_no_place_empty() {
    for (resolution, columns, rows) in [
        ([32, 32, 32], 4, 8),
        ([9, 10, 12], 4, 3),
        ([64, 8, 12], 1, 12),
        ([8, 8, 13], 1, 13),
    ] {
        let layout = Layout::of(resolution);
        assert_eq!(
            (layout.columns, layout.rows),
            (columns, rows),
            "{resolution:?}"
        );
        assert_eq!(layout.warning(), None);
        let [nx, ny, nz] = resolution;
        assert_eq!(layout.cells().count(), (nx * ny * nz) as usize);
        assert_eq!(layout.cells().next(), Some([0, ny - 1, 0]));
    }
    let long = Layout::of([32, 32, 1021]).warning().unwrap();
    assert!(Layout::of([8, 8, 2039]).warning().is_none());
    assert!(long.contains("divisors"), "{long}");
}
