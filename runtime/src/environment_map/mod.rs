//! A prefiltered latitude-longitude map: the mean radiance over cones of several sizes, about every
//! axis.

mod prefilter;
mod source;

use half::f16;

use source::SourceImage;

/// The mean radiance over cones, sampled by the CPU twin and uploaded as an
/// [`EnvironmentTexture`](crate::EnvironmentTexture).
///
/// A look-up needs the mean over a cone of a fraction `a` of the sphere (RR-5779, 5.3). The mip
/// chain that graphics libraries generate from a latitude-longitude map does not hold it: near the
/// poles a texel has only a sliver of the solid angle that it has at the equator, and a box of
/// texels is not a cone anywhere. Each level is therefore a convolution on the sphere, by
/// integration over the given map, whose texels are areas of constant radiance.
///
/// Level l holds cones of a = ½ · 4^(l − 4): half-angles of 5.1°, 10.1°, 20.4°, 41.4° and 90°.
/// Within its cone a direction is weighted by its cosine to the axis. The last level is therefore
/// the irradiance divided by π, which a white surface reflects, and a completely occluded receiver
/// loses exactly what it would otherwise reflect: AO = 1 is black under every sky.
///
/// The rows of a level lie *on* colatitudes from pole to pole, the first and the last on the poles
/// themselves. A pole row has one value, so that interpolation shows neither a seam nor a pinch.
/// The row coordinate differs between the levels of a texture: a look-up between two levels samples
/// each at its own coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap {
    levels: Vec<Level>,
}

/// A level: cones of one size, in half floats as they are uploaded: red, green, blue, 1.
#[derive(Clone, Debug, PartialEq)]
struct Level {
    size: [usize; 2],
    texels: Vec<[u16; 4]>,
}

/// The reasons why an image cannot be prefiltered.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentMapError {
    /// The image is empty, or its number of texels does not match its size.
    #[error("{texels} texels do not form an image of {width} by {height}")]
    Size {
        /// The width in texels.
        width: usize,
        /// The height in texels.
        height: usize,
        /// The number of texels.
        texels: usize,
    },
    /// A texel is infinite or not a number.
    #[error("texel {0} is infinite or not a number; replace it by a finite radiance")]
    NotFinite(usize),
    /// A mean radiance exceeds the range of half floats.
    #[error(
        "a cone's mean radiance of {0} exceeds the half-float maximum, 65504: scale the map down"
    )]
    TooBright(f32),
}

impl EnvironmentMap {
    /// The number of levels.
    pub const LEVELS: usize = 5;

    /// The width and height of level 0.
    pub const SIZE: [usize; 2] = [512, 256];

    /// Prefilters an image of `size` (width, height) whose `texels` are its radiance in rows from
    /// the top. Images larger than 1024 × 512 are first averaged down to that, by solid angle. The
    /// orientation is that of OpenEXR: up is +y, the image's center +z and a quarter from the left
    /// +x. Negative radiance, which lossy compression leaves behind, counts as zero.
    ///
    /// It uses all processors and takes a fraction of a second; the same input gives the same bytes
    /// for any number of processors.
    ///
    /// # Errors
    ///
    /// If the image is empty, its number of texels does not match its size, a texel is not finite,
    /// or the radiance exceeds the range of half floats.
    pub fn new(size: [usize; 2], texels: &[[f32; 3]]) -> Result<Self, EnvironmentMapError> {
        let source = SourceImage::new(size, texels)?;
        let level = |level| {
            let size = Self::level_size(level);
            let means = prefilter::cones(&source, size, Self::fraction(level));
            let texels = means
                .into_iter()
                .map(half_floats)
                .collect::<Result<_, _>>()?;
            Ok(Level { size, texels })
        };
        let levels = (0..Self::LEVELS).map(level).collect::<Result<_, _>>()?;
        Ok(Self { levels })
    }

    /// The width and height of a level.
    pub fn level_size(level: usize) -> [usize; 2] {
        Self::SIZE.map(|n| n >> level)
    }

    /// The fraction of the sphere that a level's cones cover.
    pub fn fraction(level: usize) -> f32 {
        0.5 / 4.0_f32.powi((Self::LEVELS - 1 - level) as i32)
    }

    /// The half floats of a level, little-endian on every machine that wgpu runs on: rows from the
    /// north pole, each texel red, green, blue, 1.
    ///
    /// # Panics
    ///
    /// If there is no such level.
    pub fn texels(&self, level: usize) -> &[u8] {
        bytemuck::cast_slice(&self.levels[level].texels)
    }

    /// Samples a level with linear filtering at texture coordinates: repeating horizontally,
    /// clamped vertically.
    ///
    /// # Panics
    ///
    /// If there is no such level.
    pub fn sample(&self, [u, v]: [f32; 2], level: usize) -> [f32; 3] {
        let Level { size, texels } = &self.levels[level];
        let [width, height] = size.map(|n| n as f32);
        let (x, y) = (u * width - 0.5, v * height - 0.5);
        let column = |x: f32| x.rem_euclid(width) as usize % size[0];
        // The cast truncates; the row is clamped to the level.
        let row = |y: f32| (y.max(0.0) as usize).min(size[1] - 1);
        let (left, top) = (x.floor(), y.floor());
        let texel = |x, y| texels[row(y) * size[0] + column(x)].map(|v| f16::from_bits(v).to_f32());
        let mix =
            |a: [f32; 4], b: [f32; 4], t: f32| std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t);
        let across = |y| mix(texel(left, y), texel(left + 1.0, y), x - left);
        let [r, g, b, _] = mix(across(top), across(top + 1.0), y - top);
        [r, g, b]
    }
}

fn half_floats([r, g, b]: [f32; 3]) -> Result<[u16; 4], EnvironmentMapError> {
    let brightest = r.max(g).max(b);
    match brightest <= f16::MAX.to_f32() {
        true => Ok([r, g, b, 1.0].map(|v| f16::from_f32(v).to_bits())),
        false => Err(EnvironmentMapError::TooBright(brightest)),
    }
}

#[cfg(test)]
mod tests;
