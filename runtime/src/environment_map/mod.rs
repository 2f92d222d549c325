//! A latitude-longitude map, prefiltered: the mean radiance over cones of many sizes, about every
//! axis.

mod prefilter;
mod source;

use half::f16;

use source::Source;

/// Mean radiance over cones: what the twin looks up, and what an
/// [`EnvironmentTexture`](crate::EnvironmentTexture) holds on a device.
///
/// A look-up wants the mean over a cone of a fraction `a` of the sphere (RR-5779, 5.3). The mip
/// chain that graphics libraries make of a latitude-longitude map does not have it: near the poles
/// a texel is a sliver of the solid angle that it has at the equator, and a box of texels is no
/// cone anywhere. So each level is a convolution on the sphere, by integration over the given map,
/// whose texels count as areas of one radiance.
///
/// Level l holds cones of a = ½ · 4^(l − 4): half-angles of 5.1°, 10.1°, 20.4°, 41.4° and 90°.
/// Within its cone a direction counts by its cosine to the axis. That makes the last level the
/// irradiance over π, what a white surface reflects, and what a receiver that is hidden whole
/// loses is exactly what it would get: AO = 1 is black under every sky.
///
/// Rows of a level lie *on* colatitudes from pole to pole, the first and the last on the poles
/// themselves: each is one value, and what is interpolated has neither a seam nor a pinch there.
/// The levels of one texture do not share such a coordinate: a look-up between two of them reads
/// each at its own.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap {
    levels: Vec<Level>,
}

/// Cones of one size, in half floats, as they are uploaded: red, green, blue, 1.
#[derive(Clone, Debug, PartialEq)]
struct Level {
    size: [usize; 2],
    texels: Vec<[u16; 4]>,
}

/// Why a picture cannot be prefiltered.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentMapError {
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
    /// Infinite or not a number.
    #[error("texel {0} is infinite or not a number; put a radiance there")]
    NotFinite(usize),
    /// More than half floats hold.
    #[error(
        "a cone's mean radiance of {0} is more than half floats hold, 65504: scale the map down"
    )]
    TooBright(f32),
}

impl EnvironmentMap {
    /// Levels of the chain.
    pub const LEVELS: usize = 5;

    /// Across and down, of level 0.
    pub const SIZE: [usize; 2] = [512, 256];

    /// Prefilters a picture of `size` (across, down), `texels` its radiance in rows from the top,
    /// of any size: what is larger than 1024 × 512 is averaged down to that, by solid angle. As
    /// OpenEXR has it, up is +y, the picture's middle +z and a quarter from the left +x. Negative
    /// radiance, which lossy compression leaves behind, counts as none.
    ///
    /// On all processors; the same input gives the same bytes for any number of them. A fraction
    /// of a second.
    ///
    /// # Errors
    ///
    /// No size, not as many texels, a texel that is not finite, radiance beyond half floats.
    pub fn new(size: [usize; 2], texels: &[[f32; 3]]) -> Result<Self, EnvironmentMapError> {
        let source = Source::new(size, texels)?;
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

    /// Across and down, of a level.
    pub fn level_size(level: usize) -> [usize; 2] {
        Self::SIZE.map(|n| n >> level)
    }

    /// The share of the sphere that a level's cones cover.
    pub fn fraction(level: usize) -> f32 {
        0.5 / 4.0_f32.powi((Self::LEVELS - 1 - level) as i32)
    }

    /// A level's half floats, little-endian on every machine that wgpu runs on: rows from the
    /// north pole, each texel red, green, blue, 1.
    ///
    /// # Panics
    ///
    /// If there is no such level.
    pub fn texels(&self, level: usize) -> &[u8] {
        bytemuck::cast_slice(&self.levels[level].texels)
    }

    /// A level, linearly filtered at texture coordinates: repeated across, clamped down.
    ///
    /// # Panics
    ///
    /// If there is no such level.
    pub fn sample(&self, [u, v]: [f32; 2], level: usize) -> [f32; 3] {
        let Level { size, texels } = &self.levels[level];
        let [width, height] = size.map(|n| n as f32);
        let (x, y) = (u * width - 0.5, v * height - 0.5);
        let column = |x: f32| x.rem_euclid(width) as usize % size[0];
        // A float becomes the nearest index that there is.
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
