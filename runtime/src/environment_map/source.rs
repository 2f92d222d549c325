//! The picture that is prefiltered: checked, not too large, and integrated along its rows.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::EnvironmentMapError;

/// The largest picture that is integrated as it is: its texels are much smaller than the cones.
const LARGEST: [usize; 2] = [1024, 512];

/// Rows of areas of one radiance, from the top.
pub(super) struct Source {
    rows: Vec<Row>,
}

/// One row, ready to be integrated over any range of azimuths.
pub(super) struct Row {
    pieces: Vec<Piece>,
    /// Over the whole row.
    total: [DVec3; 3],
}

/// A texel of a row. Up to an azimuth φ in it, the integrals of L, L cos φ and L sin φ from the row's
/// beginning are `constants` + `radiance` · (φ, sin φ, −cos φ).
struct Piece {
    radiance: DVec3,
    constants: [DVec3; 3],
}

/// An azimuth, counted from the picture's left edge: any number of turns.
#[derive(Clone, Copy)]
pub(super) struct Azimuth {
    pub turns: f64,
    pub sin: f64,
    pub cos: f64,
}

impl Source {
    pub(super) fn new(size: [usize; 2], texels: &[[f32; 3]]) -> Result<Self, EnvironmentMapError> {
        let [width, height] = size;
        if texels.is_empty() || width.checked_mul(height) != Some(texels.len()) {
            return Err(EnvironmentMapError::Size {
                width,
                height,
                texels: texels.len(),
            });
        }
        let not_finite = |texel: &[f32; 3]| texel.iter().any(|v| !v.is_finite());
        if let Some(idx) = texels.iter().position(not_finite) {
            return Err(EnvironmentMapError::NotFinite(idx));
        }
        let columns = width.min(LARGEST[0]);
        let rows = spans(height, height.min(LARGEST[1])).map(|rows| {
            let narrowed = |row: usize| narrowed(&texels[row * width..][..width], columns);
            Row::new(&mean_of_rows(rows, height, narrowed))
        });
        Ok(Self {
            rows: rows.collect(),
        })
    }

    /// The rows, from the top, each between two colatitudes.
    pub(super) fn rows(&self) -> impl Iterator<Item = (&Row, [f64; 2])> {
        let height = self.rows.len() as f64;
        let edges = move |row: usize| [row, row + 1].map(|edge| PI * edge as f64 / height);
        self.rows
            .iter()
            .enumerate()
            .map(move |(row, r)| (r, edges(row)))
    }
}

impl Row {
    fn new(texels: &[DVec3]) -> Self {
        let width = texels.len() as f64;
        let mut sums = [DVec3::ZERO; 3];
        let pieces = texels.iter().enumerate().map(|(column, &radiance)| {
            let [left, right] = [column, column + 1].map(|edge| {
                let (sin, cos) = (TAU * edge as f64 / width).sin_cos();
                [TAU * edge as f64 / width, sin, -cos]
            });
            let constants = std::array::from_fn(|k| sums[k] - radiance * left[k]);
            for k in 0..3 {
                sums[k] += radiance * (right[k] - left[k]);
            }
            Piece {
                radiance,
                constants,
            }
        });
        Self {
            pieces: pieces.collect(),
            total: sums,
        }
    }

    /// ∫ L dφ, ∫ L cos φ dφ and ∫ L sin φ dφ from one azimuth to another.
    pub(super) fn integrals(&self, [from, to]: [Azimuth; 2]) -> [DVec3; 3] {
        let (from, to) = (self.up_to(from), self.up_to(to));
        std::array::from_fn(|k| to[k] - from[k])
    }

    fn up_to(&self, azimuth: Azimuth) -> [DVec3; 3] {
        let whole = azimuth.turns.floor();
        let rest = azimuth.turns - whole;
        let width = self.pieces.len();
        let column = ((rest * width as f64) as usize).min(width - 1);
        let piece = &self.pieces[column];
        let factors = [TAU * rest, azimuth.sin, -azimuth.cos];
        std::array::from_fn(|k| {
            piece.constants[k] + piece.radiance * factors[k] + whole * self.total[k]
        })
    }
}

/// `n` texels shared out evenly among `parts`: for each part the texels and how much of each it has.
fn spans(n: usize, parts: usize) -> impl Iterator<Item = Vec<(usize, [f64; 2])>> {
    (0..parts).map(move |part| {
        // In units of 1/parts of a texel, to be exact.
        let (from, to) = (part * n, (part + 1) * n);
        let texels = from / parts..to.div_ceil(parts);
        let edges = |texel: usize| {
            let (first, last) = (from.max(texel * parts), to.min((texel + 1) * parts));
            [first, last].map(|edge| edge as f64 / parts as f64)
        };
        texels.map(|texel| (texel, edges(texel))).collect()
    })
}

/// A row in so many columns, each the mean of what it covers.
fn narrowed(texels: &[[f32; 3]], columns: usize) -> Vec<DVec3> {
    let radiance = |t: [f32; 3]| DVec3::from(t.map(|v| f64::from(v.max(0.0))));
    let mean = |covered: Vec<(usize, [f64; 2])>| {
        let parts = covered
            .iter()
            .map(|&(x, [from, to])| (radiance(texels[x]), to - from));
        mean(parts)
    };
    spans(texels.len(), columns).map(mean).collect()
}

/// The mean of some rows by solid angle.
fn mean_of_rows(
    rows: Vec<(usize, [f64; 2])>,
    height: usize,
    row: impl Fn(usize) -> Vec<DVec3>,
) -> Vec<DVec3> {
    let cosine = |edge: f64| (PI * edge / height as f64).cos();
    let all: Vec<_> = rows
        .iter()
        .map(|&(y, [from, to])| (row(y), cosine(from) - cosine(to)))
        .collect();
    let columns = 0..all[0].0.len();
    columns
        .map(|x| mean(all.iter().map(|(row, weight)| (row[x], *weight))))
        .collect()
}

fn mean(parts: impl Iterator<Item = (DVec3, f64)>) -> DVec3 {
    let (sum, weights) = parts.fold((DVec3::ZERO, 0.0), |(sum, weights), (value, weight)| {
        (sum + value * weight, weights + weight)
    });
    sum / weights
}
