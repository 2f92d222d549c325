//! The contact sheet of a grid: rows of slices across z, occlusion above, directions below.

use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::layers::CellClass;
use aogrid_grid_format::{Encoding, Grid};
use image::RgbImage;

use super::{BakedModel, outline};
use crate::canvas::{BACKGROUND, Canvas, Color, DIM, GLYPH_SIZE, INK};
use crate::commands::info::{interior_line, triple};

/// Longer side of a slice, in pixels.
const TILE_SIDE: f64 = 128.0;
/// Minimum length of the shorter side in pixels, so that a slice of a rod is visible.
const MIN_TILE_SIDE: u32 = 16;
const COLUMNS: usize = 8;
/// Maximum number of slices, evenly spaced.
const MAX_SLICES: usize = 32;
const GAP: u32 = 8;
/// Distance between lines of text, in pixels.
const LINE_HEIGHT: u32 = GLYPH_SIZE + 4;
const MARGIN: u32 = 16;
/// Minimum width of the picture in pixels, so that its lines of text fit.
const MIN_WIDTH: u32 = 720;

const OUTLINE: Color = [255, 96, 0];
const OUTLINE_ON_COLORS: Color = [255, 255, 255];

/// Distance between hatching lines, in pixels.
const HATCH_SPACING: u32 = 3;

/// Colors of the marks of interior and of doubtful cells.
const INTERIOR: Color = [0, 140, 255];
const DOUBTFUL: Color = [225, 40, 190];

/// Side of the scale of directions, in pixels.
const BALL_SIDE: u32 = 64;

/// The occlusion fraction below which directions fade into the background, being of little weight.
const FADE_OCCLUSION: f32 = 0.05;

/// The quantity that a block of slices shows.
#[derive(Clone, Copy, PartialEq)]
enum Quantity {
    Occlusion,
    Direction,
}

impl Quantity {
    fn color(self, [x, y, z, a]: [f32; 4]) -> Color {
        match self {
            Self::Occlusion => [((1.0 - a) * 255.0).round() as u8; 3],
            Self::Direction => {
                let strength = (a / FADE_OCCLUSION).min(1.0);
                let mut color = direction_color([x, y, z]);
                for (c, background) in color.iter_mut().zip(BACKGROUND) {
                    let mixed = f32::from(*c) * strength + f32::from(background) * (1.0 - strength);
                    *c = mixed.round() as u8;
                }
                color
            }
        }
    }

    fn outline(self) -> Color {
        match self {
            Self::Occlusion => OUTLINE,
            Self::Direction => OUTLINE_ON_COLORS,
        }
    }
}

/// Maps a direction to a color: −1..1 along x, y, z to dark..bright red, green, blue.
fn direction_color(d: [f32; 3]) -> Color {
    d.map(|v| ((v * 0.5 + 0.5).clamp(0.0, 1.0) * 255.0).round() as u8)
}

/// The layout of the sheet.
struct Layout {
    /// Width and height of a slice in pixels.
    tile: [u32; 2],
    /// The z indices of the slices drawn.
    slices: Vec<u32>,
}

impl Layout {
    fn new(grid: &Grid) -> Self {
        let [ex, ey, _] = grid.spec().half_extents().map(f64::from);
        let pixels = TILE_SIDE / ex.max(ey);
        let tile = [ex, ey].map(|e| ((e * pixels).round() as u32).max(MIN_TILE_SIDE));
        let nz = grid.spec().resolution()[2] as usize;
        let shown = nz.min(MAX_SLICES);
        let slices = (0..shown).map(|s| ((2 * s + 1) * nz / (2 * shown)) as u32);
        Self {
            tile,
            slices: slices.collect(),
        }
    }

    fn width(&self) -> u32 {
        let columns = self.slices.len().min(COLUMNS) as u32;
        let tiles = columns * (self.tile[0].max(10 * GLYPH_SIZE) + GAP) - GAP;
        tiles.max(MIN_WIDTH) + 2 * MARGIN
    }

    /// Returns the height of a block of slices with its heading.
    fn block_height(&self) -> u32 {
        let rows = self.slices.len().div_ceil(COLUMNS) as u32;
        2 * LINE_HEIGHT + rows * (self.tile[1] + LINE_HEIGHT + GAP)
    }

    /// Returns the upper left corner of a slice in a block.
    fn slice_origin(&self, slice: usize) -> [u32; 2] {
        let (row, column) = ((slice / COLUMNS) as u32, (slice % COLUMNS) as u32);
        [
            column * (self.tile[0].max(10 * GLYPH_SIZE) + GAP),
            2 * LINE_HEIGHT + row * (self.tile[1] + LINE_HEIGHT + GAP),
        ]
    }
}

/// Draws the sheet of `grid`, which is called `name`.
pub(super) fn draw(grid: &Grid, model: Option<&BakedModel>, name: &str) -> RgbImage {
    let layout = Layout::new(grid);
    let quantities: &[Quantity] = match grid.encoding().has_direction() {
        false => &[Quantity::Occlusion],
        true => &[Quantity::Occlusion, Quantity::Direction],
    };
    let header = headings(grid, name);
    let top = MARGIN + header.len() as u32 * LINE_HEIGHT + 3 * LINE_HEIGHT;
    let scales = BALL_SIDE + 2 * LINE_HEIGHT;
    let height = top + quantities.len() as u32 * layout.block_height() + scales + MARGIN;
    let mut canvas = Canvas::new(layout.width(), height);
    for (line, text) in (0..).zip(&header) {
        let color = if line == 0 { INK } else { DIM };
        canvas.text(MARGIN, MARGIN + line * LINE_HEIGHT, text, color);
    }
    for (block, &quantity) in (0..).zip(quantities) {
        let origin = [MARGIN, top + block * layout.block_height()];
        draw_block(&mut canvas, &layout, origin, grid, model, quantity);
    }
    let origin = [MARGIN, height - MARGIN - scales];
    if model.is_some() {
        draw_legend(&mut canvas, [MARGIN, top - 2 * LINE_HEIGHT]);
    }
    draw_scales(
        &mut canvas,
        origin,
        quantities.contains(&Quantity::Direction),
    );
    canvas.into_image()
}

/// Returns the lines of text at the top of the sheet.
fn headings(grid: &Grid, name: &str) -> Vec<String> {
    let (spec, record) = (grid.spec(), grid.record());
    let [nx, ny, nz] = spec.resolution();
    let part = record.source.part.as_ref();
    vec![
        name.to_owned(),
        format!(
            "{}{}, {} triangles",
            record.source.name,
            part.map(|part| format!(" ({part})")).unwrap_or_default(),
            record.source.triangles
        ),
        format!(
            "{nx}x{ny}x{nz} cells, half-extents {}",
            triple(spec.half_extents())
        ),
        format!(
            "boundary {:?}, V_M {:.4}; mean a {:.4}, largest {:.4}",
            record.boundary.applied,
            record.boundary.v_m,
            grid.statistics().mean,
            grid.statistics().largest
        ),
        interior_line(record),
    ]
}

fn draw_block(
    canvas: &mut Canvas,
    layout: &Layout,
    [left, top]: [u32; 2],
    grid: &Grid,
    model: Option<&BakedModel>,
    quantity: Quantity,
) {
    let title = match quantity {
        Quantity::Occlusion => {
            "a: occluded share of the sphere; x right, y up, one slice for each z"
        }
        Quantity::Direction if grid.encoding() == Encoding::Moment => {
            "v: direction towards the object, gray where occlusion is spread out, same slices"
        }
        Quantity::Direction => "d: direction towards the object, same slices",
    };
    canvas.text(left, top, title, INK);
    for (slice, &k) in layout.slices.iter().enumerate() {
        let [x, y] = layout.slice_origin(slice);
        let origin = [left + x, top + y];
        draw_slice(canvas, layout.tile, origin, grid, k, quantity);
        let [_, _, from_center] = grid.spec().sample_from_center([0, 0, k], [0.0; 3]);
        let z = f64::from(grid.spec().center()[2]) + from_center;
        if let Some(BakedModel { mesh, cells }) = model {
            if quantity == Quantity::Occlusion {
                draw_interior(canvas, layout.tile, origin, grid, cells.classes(), k);
            }
            draw_outline(
                canvas,
                layout.tile,
                origin,
                grid,
                mesh,
                z,
                quantity.outline(),
            );
        }
        let label = match z.abs() == 0.0 || (1e-2..1e5).contains(&z.abs()) {
            true => format!("z {z:.3}"),
            false => format!("z {z:.1e}"),
        };
        canvas.text(origin[0], origin[1] + layout.tile[1] + 2, &label, DIM);
    }
}

fn draw_slice(
    canvas: &mut Canvas,
    [width, height]: [u32; 2],
    [left, top]: [u32; 2],
    grid: &Grid,
    k: u32,
    quantity: Quantity,
) {
    let [nx, ny, _] = grid.spec().resolution();
    for y in 0..height {
        // Rows of pixels run downwards, y upwards.
        let j = (height - 1 - y) * ny / height;
        for x in 0..width {
            let cone = grid.cell(grid.spec().cell_idx([x * nx / width, j, k]));
            canvas.set(left + x, top + y, quantity.color(cone));
        }
    }
}

/// Draws a dot of four pixels in each interior cell, and hatching over doubtful cells.
fn draw_interior(
    canvas: &mut Canvas,
    [width, height]: [u32; 2],
    [left, top]: [u32; 2],
    grid: &Grid,
    classes: &[CellClass],
    k: u32,
) {
    let [nx, ny, _] = grid.spec().resolution();
    let class = |i: u32, j: u32| classes[grid.spec().cell_idx([i, j, k])];
    // Hatching first, so that the dots stay visible.
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let (i, j) = (x * nx / width, (height - 1 - y) * ny / height);
        if class(i, j).is_doubtful && (x + y) % HATCH_SPACING == 0 {
            canvas.set(left + x, top + y, DOUBTFUL);
        }
    }
    for (j, i) in (0..ny).flat_map(|j| (0..nx).map(move |i| (j, i))) {
        if class(i, j).is_interior {
            let x = ((2 * i + 1) * width / (2 * nx)).saturating_sub(1);
            let y = (height - 1 - (2 * j + 1) * height / (2 * ny)).min(height - 2);
            for [right, down] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
                canvas.set(left + x + right, top + y + down, INTERIOR);
            }
        }
    }
}

fn draw_outline(
    canvas: &mut Canvas,
    tile: [u32; 2],
    origin: [u32; 2],
    grid: &Grid,
    mesh: &TriangleMesh,
    z: f64,
    color: Color,
) {
    let ([cx, cy, _], [ex, ey, _]) = (grid.spec().center(), grid.spec().half_extents());
    let pixel = |[x, y]: [f64; 2]| {
        let u = (x - f64::from(cx)) / f64::from(ex) * 0.5 + 0.5;
        let v = (y - f64::from(cy)) / f64::from(ey) * 0.5 + 0.5;
        [u * f64::from(tile[0]), (1.0 - v) * f64::from(tile[1])]
    };
    for segment in outline::cut(mesh, 2, z) {
        canvas.line(origin, tile, segment.map(pixel), color);
    }
}

fn draw_legend(canvas: &mut Canvas, [left, top]: [u32; 2]) {
    let mut x = left;
    for (text, color) in [
        ("outline", OUTLINE),
        ("inside: filled from around", INTERIOR),
        ("in doubt", DOUBTFUL),
    ] {
        canvas.text(x, top, text, color);
        x += (text.chars().count() as u32 + 3) * GLYPH_SIZE;
    }
}

fn draw_scales(canvas: &mut Canvas, [left, top]: [u32; 2], with_directions: bool) {
    let (width, height) = (200, 16);
    canvas.text(left, top, "a", INK);
    for x in 0..width {
        let a = x as f32 / (width - 1) as f32;
        for y in 0..height {
            canvas.set(
                left + x,
                top + LINE_HEIGHT + y,
                Quantity::Occlusion.color([0.0, 0.0, 0.0, a]),
            );
        }
    }
    for (x, text) in [(0, "0"), (width / 2 - 12, "0.5"), (width - GLYPH_SIZE, "1")] {
        canvas.text(left + x, top + LINE_HEIGHT + height + 4, text, DIM);
    }
    if !with_directions {
        return;
    }
    let halves = [(1.0, "d, z towards you"), (-1.0, "d, z away")];
    for (i, (sign, title)) in (0..).zip(halves) {
        let left = left + width + 40 + i * 160;
        canvas.text(left, top, title, INK);
        draw_ball(canvas, [left, top + LINE_HEIGHT], sign);
    }
}

/// Draws the hemisphere of directions whose z has the sign of `sign`, seen from +z.
fn draw_ball(canvas: &mut Canvas, [left, top]: [u32; 2], sign: f32) {
    for row in 0..BALL_SIDE {
        for column in 0..BALL_SIDE {
            let centered = |i: u32| (2 * i + 1) as f32 / BALL_SIDE as f32 - 1.0;
            let (x, y) = (centered(column), -centered(row));
            let square = 1.0 - x * x - y * y;
            if square >= 0.0 {
                let color = direction_color([x, y, sign * square.sqrt()]);
                canvas.set(left + column, top + row, color);
            }
        }
    }
}
