//! The image to prefilter: validated, averaged down if it is large, and integrated along its rows.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::EnvironmentMapError;

/// The largest size that is integrated without averaging: its texels are much smaller than the
/// cones.
const MAX_SIZE: [usize; 2] = [1024, 512];

/// An image as rows of areas of constant radiance, from the top.
pub(super) struct SourceImage {
    rows: Vec<Row>,
}

/// One row, prepared for integration over any range of azimuths.
pub(super) struct Row {
    integrals_by_texel: Vec<TexelIntegral>,
    /// The integrals over the whole row.
    total: [DVec3; 3],
}

/// A texel of a row. Up to an azimuth φ in it, the integrals of L, L cos φ and L sin φ from the
/// start of the row are `constants` + `radiance` · (φ, sin φ, −cos φ).
struct TexelIntegral {
    radiance: DVec3,
    constants: [DVec3; 3],
}

/// An azimuth from the image's left edge, in any number of turns.
#[derive(Clone, Copy)]
pub(super) struct Azimuth {
    pub turns: f64,
    pub sin: f64,
    pub cos: f64,
}

impl SourceImage {
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
        let columns = width.min(MAX_SIZE[0]);
        let rows = spans(height, height.min(MAX_SIZE[1])).map(|rows| {
            let averaged_row = |row: usize| averaged_row(&texels[row * width..][..width], columns);
            Row::new(&mean_of_rows(rows, height, averaged_row))
        });
        Ok(Self {
            rows: rows.collect(),
        })
    }

    /// The rows from the top, each between two colatitudes.
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
        let integrals_by_texel = texels.iter().enumerate().map(|(column, &radiance)| {
            // The antiderivatives of 1, cos φ and sin φ at both edges of the texel.
            let [left, right] = [column, column + 1].map(|edge| {
                let (sin, cos) = (TAU * edge as f64 / width).sin_cos();
                [TAU * edge as f64 / width, sin, -cos]
            });
            let constants = std::array::from_fn(|k| sums[k] - radiance * left[k]);
            for k in 0..3 {
                sums[k] += radiance * (right[k] - left[k]);
            }
            TexelIntegral {
                radiance,
                constants,
            }
        });
        Self {
            integrals_by_texel: integrals_by_texel.collect(),
            total: sums,
        }
    }

    /// Returns ∫ L dφ, ∫ L cos φ dφ and ∫ L sin φ dφ from one azimuth to another.
    pub(super) fn integrals(&self, [from, to]: [Azimuth; 2]) -> [DVec3; 3] {
        let (from, to) = (self.integrals_up_to(from), self.integrals_up_to(to));
        std::array::from_fn(|k| to[k] - from[k])
    }

    /// The same integrals from the image's left edge to an azimuth.
    fn integrals_up_to(&self, azimuth: Azimuth) -> [DVec3; 3] {
        let whole = azimuth.turns.floor();
        let rest = azimuth.turns - whole;
        let width = self.integrals_by_texel.len();
        let column = ((rest * width as f64) as usize).min(width - 1);
        let texel = &self.integrals_by_texel[column];
        let factors = [TAU * rest, azimuth.sin, -azimuth.cos];
        std::array::from_fn(|k| {
            texel.constants[k] + texel.radiance * factors[k] + whole * self.total[k]
        })
    }
}

/// Divides `n` texels evenly into `parts`: for each part, its texels and the range of each that it
/// covers.
fn spans(n: usize, parts: usize) -> impl Iterator<Item = Vec<(usize, [f64; 2])>> {
    (0..parts).map(move |part| {
        // In units of 1/parts of a texel, so that the edges are exact.
        let (from, to) = (part * n, (part + 1) * n);
        let texels = from / parts..to.div_ceil(parts);
        let edges = |texel: usize| {
            let (first, last) = (from.max(texel * parts), to.min((texel + 1) * parts));
            [first, last].map(|edge| edge as f64 / parts as f64)
        };
        texels.map(|texel| (texel, edges(texel))).collect()
    })
}

/// A row averaged to `columns` columns, each the mean of the texels that it covers.
fn averaged_row(texels: &[[f32; 3]], columns: usize) -> Vec<DVec3> {
    let radiance = |t: [f32; 3]| DVec3::from(t.map(|v| f64::from(v.max(0.0))));
    let mean = |covered: Vec<(usize, [f64; 2])>| {
        let parts = covered
            .iter()
            .map(|&(x, [from, to])| (radiance(texels[x]), to - from));
        mean(parts)
    };
    spans(texels.len(), columns).map(mean).collect()
}

/// The mean of several rows, weighted by solid angle.
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
