//! The latitude–longitude environment map that surrounds a scene.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

/// A latitude–longitude map in OpenEXR's convention: y up, +z at the center of the picture, +x at a
/// quarter of its width.
///
/// Texels are areas of constant radiance, without interpolation, so that the integrand is known
/// exactly.
#[derive(Clone, Debug)]
pub struct Environment {
    size: [usize; 2],
    /// The radiance of each texel, in rows from the top.
    texels: Vec<[f32; 3]>,
    map_from_world: DMat3,
    /// The luminance above which the excess of a texel is sampled separately.
    cap: f64,
    bright: Option<BrightTexels>,
}

/// The reason that a picture is not a valid environment map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentError {
    /// The picture is empty, or the number of texels does not match its size.
    #[error("{texels} texels do not make a picture of {width} by {height}")]
    Size {
        /// The width in texels.
        width: usize,
        /// The height in texels.
        height: usize,
        /// The number of texels given.
        texels: usize,
    },
    /// A texel is negative, infinite or not a number.
    #[error("texel {0} is negative, infinite or not a number")]
    Texel(usize),
}

/// The cap over the mean luminance of the map. The luminance above the cap is importance-sampled.
const CAP_OVER_MEAN: f64 = 4.0;

impl Environment {
    /// Creates a map of `size` (width, height), rotated by `map_from_world` (a matrix in rows).
    ///
    /// # Errors
    ///
    /// The picture is empty, the number of texels does not match, or a texel is negative or not
    /// finite.
    pub fn new(
        size: [usize; 2],
        texels: Vec<[f32; 3]>,
        map_from_world: [[f64; 3]; 3],
    ) -> Result<Self, EnvironmentError> {
        let [width, height] = size;
        if texels.is_empty() || width.checked_mul(height) != Some(texels.len()) {
            return Err(EnvironmentError::Size {
                width,
                height,
                texels: texels.len(),
            });
        }
        let usable = |texel: &[f32; 3]| texel.iter().all(|&v| (0.0..=f32::MAX).contains(&v));
        if let Some(idx) = texels.iter().position(|texel| !usable(texel)) {
            return Err(EnvironmentError::Texel(idx));
        }
        let mut environment = Self {
            size,
            texels,
            map_from_world: DMat3::from_cols_array_2d(&map_from_world).transpose(),
            cap: f64::INFINITY,
            bright: None,
        };
        environment.cap = CAP_OVER_MEAN * environment.mean_luminance();
        environment.bright = BrightTexels::new(&environment);
        Ok(environment)
    }

    /// Returns the width and height in texels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Returns the radiance of each texel, in rows from the top.
    pub fn texels(&self) -> &[[f32; 3]] {
        &self.texels
    }

    /// Returns the rotation from world axes to the map's axes, as the rows of a matrix.
    pub fn map_from_world(&self) -> [[f64; 3]; 3] {
        self.map_from_world.transpose().to_cols_array_2d()
    }

    /// Returns the radiance from `direction`, of any length, in world space.
    pub fn radiance(&self, direction: [f64; 3]) -> [f32; 3] {
        self.texels[self.texel_idx(direction.into())]
    }

    /// Returns the radiance from `direction`, with its luminance limited to the cap.
    pub(super) fn capped_radiance(&self, direction: DVec3) -> [f64; 3] {
        let texel = self.texels[self.texel_idx(direction)].map(f64::from);
        let luminance = luminance(texel);
        match luminance > self.cap {
            true => texel.map(|v| v * self.cap / luminance),
            false => texel,
        }
    }

    /// Returns the texels above the cap, if there are any.
    pub(super) fn bright(&self) -> Option<&BrightTexels> {
        self.bright.as_ref()
    }

    /// Returns the index of the texel in a direction, of any length, in world space.
    fn texel_idx(&self, direction: DVec3) -> usize {
        let d = self.map_from_world * direction.normalize();
        let u = 0.5 - d.x.atan2(d.z) / TAU;
        let v = 0.5 - d.y.clamp(-1.0, 1.0).asin() / PI;
        let [width, height] = self.size;
        let column = ((u * width as f64) as usize).min(width - 1);
        let row = ((v * height as f64) as usize).min(height - 1);
        row * width + column
    }

    /// Returns the sines of the latitudes that bound a row, the upper one first.
    fn latitude_sines(&self, row: usize) -> [f64; 2] {
        [row, row + 1].map(|edge| (PI * (0.5 - edge as f64 / self.size[1] as f64)).sin())
    }

    /// Returns the solid angle of each texel of a row.
    fn solid_angle(&self, row: usize) -> f64 {
        let [upper, lower] = self.latitude_sines(row);
        TAU / self.size[0] as f64 * (upper - lower)
    }

    /// Returns the mean luminance over the sphere.
    fn mean_luminance(&self) -> f64 {
        let rows = self.texels.chunks_exact(self.size[0]).enumerate();
        let row_integral = |(row, texels): (usize, &[[f32; 3]])| {
            let sum: f64 = texels.iter().map(|t| luminance(t.map(f64::from))).sum();
            sum * self.solid_angle(row)
        };
        rows.map(row_integral).sum::<f64>() / (4.0 * PI)
    }
}

/// Returns the luminance of a linear color, with the weights of ITU-R BT.709.
fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The texels above the cap, sampled in proportion to their excess: luminance above the cap times
/// solid angle.
#[derive(Clone, Debug)]
pub(super) struct BrightTexels {
    texels: Vec<BrightTexel>,
    /// The excess of all texels.
    total: f64,
    world_from_map: DMat3,
}

#[derive(Clone, Copy, Debug)]
struct BrightTexel {
    /// The excess of all texels up to and including this one.
    cumulative: f64,
    /// The map's u coordinates that bound the texel.
    u: [f64; 2],
    /// The sines of the latitudes that bound the texel, the upper one first.
    sines: [f64; 2],
    /// The radiance divided by its luminance.
    color: [f32; 3],
}

impl BrightTexels {
    /// Collects the texels above the cap, if there are any.
    fn new(environment: &Environment) -> Option<Self> {
        let [width, _] = environment.size;
        let mut total = 0.0;
        let mut texels = vec![];
        for (idx, texel) in environment.texels.iter().enumerate() {
            let texel = texel.map(f64::from);
            let luminance = luminance(texel);
            if luminance <= environment.cap {
                continue;
            }
            let (row, column) = (idx / width, idx % width);
            total += (luminance - environment.cap) * environment.solid_angle(row);
            texels.push(BrightTexel {
                cumulative: total,
                u: [column, column + 1].map(|edge| edge as f64 / width as f64),
                sines: environment.latitude_sines(row),
                color: texel.map(|v| (v / luminance) as f32),
            });
        }
        (total > 0.0).then(|| Self {
            texels,
            total,
            world_from_map: environment.map_from_world.transpose(),
        })
    }

    /// Returns a direction, of length 1 in world space, and its radiance above the cap divided by
    /// its probability density per solid angle, for uniform points of the unit square.
    pub(super) fn sample(&self, square: [f64; 2]) -> (DVec3, [f64; 3]) {
        // Choose the texel by the cumulative excess.
        let target = square[0] * self.total;
        let idx = self.texels.partition_point(|t| t.cumulative <= target);
        let idx = idx.min(self.texels.len() - 1);
        let texel = &self.texels[idx];
        let before = match idx {
            0 => 0.0,
            _ => self.texels[idx - 1].cumulative,
        };
        // The rest of the random number is uniform across the texel's width.
        let across = (target - before) / (texel.cumulative - before);
        let u = texel.u[0] + across * (texel.u[1] - texel.u[0]);
        // A uniform sine of the latitude is uniform by solid angle.
        let sine = texel.sines[0] + square[1] * (texel.sines[1] - texel.sines[0]);
        let cosine = (1.0 - sine * sine).max(0.0).sqrt();
        let (x, z) = ((0.5 - u) * TAU).sin_cos();
        let direction = DVec3::new(cosine * x, sine, cosine * z);
        // Density = excess luminance / total, so that radiance / density = color · total.
        let radiance = texel.color.map(|v| f64::from(v) * self.total);
        (self.world_from_map * direction, radiance)
    }
}
