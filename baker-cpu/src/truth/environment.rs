//! What surrounds a scene: a latitude-longitude map.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

/// A latitude-longitude map as OpenEXR has it: y up, the picture's centre towards +z, +x at a
/// quarter of its width. Texels are areas of one radiance, not points to interpolate between:
/// what is integrated is known exactly.
#[derive(Clone, Debug)]
pub struct Environment {
    size: [usize; 2],
    /// Rows from the top, as radiance.
    texels: Vec<[f32; 3]>,
    map_from_world: DMat3,
    /// Luminance up to which a texel belongs to the base.
    cap: f64,
    bright: Option<Bright>,
}

/// Why a picture is no environment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentError {
    /// The picture has no size, or not as many texels as its size says.
    #[error("{texels} texels are no picture of {width} by {height}")]
    Size {
        /// Across.
        width: usize,
        /// Down.
        height: usize,
        /// How many there are.
        texels: usize,
    },
    /// Negative, infinite or not a number.
    #[error("texel {0} is not a radiance")]
    Texel(usize),
}

/// What is brighter than this many times the mean is sampled by itself.
const BRIGHT: f64 = 4.0;

impl Environment {
    /// A map of `size` (across, down), turned by the rotation `map_from_world` (rows).
    ///
    /// # Errors
    ///
    /// No size, not as many texels, a texel that is negative or not finite.
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
        environment.cap = BRIGHT * environment.mean_luminance();
        environment.bright = Bright::new(&environment);
        Ok(environment)
    }

    /// Across and down.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Rows from the top, as radiance.
    pub fn texels(&self) -> &[[f32; 3]] {
        &self.texels
    }

    /// From world axes to the map's: rows.
    pub fn map_from_world(&self) -> [[f64; 3]; 3] {
        self.map_from_world.transpose().to_cols_array_2d()
    }

    /// The radiance from `direction`, of any length, in world space.
    pub fn radiance(&self, direction: [f64; 3]) -> [f32; 3] {
        self.texels[self.texel_idx(direction.into())]
    }

    /// The radiance up to the cap.
    pub(super) fn base(&self, direction: DVec3) -> [f64; 3] {
        let texel = self.texels[self.texel_idx(direction)].map(f64::from);
        let luminance = luminance(texel);
        match luminance > self.cap {
            true => texel.map(|v| v * self.cap / luminance),
            false => texel,
        }
    }

    /// What is above the cap, if anything is.
    pub(super) fn bright(&self) -> Option<&Bright> {
        self.bright.as_ref()
    }

    fn texel_idx(&self, direction: DVec3) -> usize {
        let d = self.map_from_world * direction.normalize();
        let u = 0.5 - d.x.atan2(d.z) / TAU;
        let v = 0.5 - d.y.clamp(-1.0, 1.0).asin() / PI;
        let [width, height] = self.size;
        let column = ((u * width as f64) as usize).min(width - 1);
        let row = ((v * height as f64) as usize).min(height - 1);
        row * width + column
    }

    /// Sines of the latitudes above and below a row.
    fn latitudes(&self, row: usize) -> [f64; 2] {
        [row, row + 1].map(|edge| (PI * (0.5 - edge as f64 / self.size[1] as f64)).sin())
    }

    /// The solid angle of each texel of a row.
    fn solid_angle(&self, row: usize) -> f64 {
        let [above, below] = self.latitudes(row);
        TAU / self.size[0] as f64 * (above - below)
    }

    fn mean_luminance(&self) -> f64 {
        let rows = self.texels.chunks_exact(self.size[0]).enumerate();
        let of_row = |(row, texels): (usize, &[[f32; 3]])| {
            let sum: f64 = texels.iter().map(|t| luminance(t.map(f64::from))).sum();
            sum * self.solid_angle(row)
        };
        rows.map(of_row).sum::<f64>() / (4.0 * PI)
    }
}

/// ITU-R BT.709's weights.
fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The texels above the cap, chosen in proportion to what they have above it.
#[derive(Clone, Debug)]
pub(super) struct Bright {
    texels: Vec<BrightTexel>,
    /// The sum of all texels' luminance above the cap times solid angle.
    total: f64,
    world_from_map: DMat3,
}

#[derive(Clone, Copy, Debug)]
struct BrightTexel {
    /// The sum up to and with this texel.
    cumulative: f64,
    /// Longitudes u and sines of latitude, from and to.
    u: [f64; 2],
    sines: [f64; 2],
    /// Radiance above the cap over its luminance.
    colour: [f32; 3],
}

impl Bright {
    fn new(environment: &Environment) -> Option<Self> {
        let [width, _] = environment.size;
        let mut total = 0.0;
        let mut texels = vec![];
        for (idx, texel) in environment.texels.iter().enumerate() {
            let texel = texel.map(f64::from);
            let all = luminance(texel);
            if all <= environment.cap {
                continue;
            }
            let (row, column) = (idx / width, idx % width);
            total += (all - environment.cap) * environment.solid_angle(row);
            texels.push(BrightTexel {
                cumulative: total,
                u: [column, column + 1].map(|edge| edge as f64 / width as f64),
                sines: environment.latitudes(row),
                colour: texel.map(|v| (v / all) as f32),
            });
        }
        (total > 0.0).then(|| Self {
            texels,
            total,
            world_from_map: environment.map_from_world.transpose(),
        })
    }

    /// A direction, of length 1 in world space, and the radiance above the cap from there over
    /// the density per solid angle with which uniform points of the square give it.
    pub(super) fn sample(&self, square: [f64; 2]) -> (DVec3, [f64; 3]) {
        let wanted = square[0] * self.total;
        let idx = self.texels.partition_point(|t| t.cumulative <= wanted);
        let idx = idx.min(self.texels.len() - 1);
        let texel = &self.texels[idx];
        let before = match idx {
            0 => 0.0,
            _ => self.texels[idx - 1].cumulative,
        };
        // What is left of the random number says where across the texel.
        let across = (wanted - before) / (texel.cumulative - before);
        let u = texel.u[0] + across * (texel.u[1] - texel.u[0]);
        let sine = texel.sines[0] + square[1] * (texel.sines[1] - texel.sines[0]);
        let cosine = (1.0 - sine * sine).max(0.0).sqrt();
        let (x, z) = ((0.5 - u) * TAU).sin_cos();
        let direction = DVec3::new(cosine * x, sine, cosine * z);
        let radiance = texel.colour.map(|v| f64::from(v) * self.total);
        (self.world_from_map * direction, radiance)
    }
}
