//! Textures on the CPU, with the filter of a linear, clamped sampler, for the CPU twin.

use aogrid_grid_format::{Grid, TexelFormat};
use aogrid_tables::{ClipTable, Format, MergeTable};

/// A texture as a shader reads it: missing channels are 0, and 1 in alpha.
#[derive(Clone, Debug, PartialEq)]
pub struct CpuTexture {
    size: [usize; 3],
    texels: Vec<[f32; 4]>,
}

/// The two texels of a linear interpolation along one axis, and the weight of the second.
struct Span {
    texels: [usize; 2],
    weight: f32,
}

impl CpuTexture {
    /// The texture of a grid; its directions are not decoded.
    pub fn of_grid(grid: &Grid) -> Self {
        let channels = grid.encoding().channels();
        let stored = grid.texels().chunks_exact(grid.format().channel_bytes());
        let values: Vec<f32> = stored
            .map(|bytes| grid.format().shader_value(bytes))
            .collect();
        Self {
            size: grid.spec().resolution().map(|n| n as usize),
            texels: values.chunks_exact(channels).map(texel).collect(),
        }
    }

    /// T_clip as transmittance, 1 − AO, in one channel, as the multiplying passes sample it.
    pub fn transmittance_table() -> Self {
        Self::table(
            clip_size(),
            &aogrid_tables::transmittance_texels(Format::F16),
            1,
        )
    }

    /// T_clip with all channels: AO, a′, f, 1.
    pub fn clip_table() -> Self {
        Self::table(clip_size(), aogrid_tables::clip_texels(Format::F16), 4)
    }

    /// The overlap table of T_merge: the fraction that two cones share.
    pub fn intersection_table() -> Self {
        let texels = aogrid_tables::intersection_texels(Format::F16);
        Self::table(MergeTable::SIZE, &texels, 1)
    }

    /// Samples with linear filtering at normalized coordinates, clamped to the edge; z is 0.5 for a
    /// 2D texture.
    pub fn sample(&self, coordinates: [f32; 3]) -> [f32; 4] {
        let [x, y, z] = std::array::from_fn(|axis| Span::new(coordinates[axis], self.size[axis]));
        let row = |y, z| x.mix(|x| self.texels[x + self.size[0] * (y + self.size[1] * z)]);
        z.mix(|z| y.mix(|y| row(y, z)))
    }

    /// A table of half floats.
    fn table(size: [usize; 3], f16_texels: &[u8], channels: usize) -> Self {
        let values: Vec<f32> = f16_texels
            .chunks_exact(2)
            .map(|bytes| TexelFormat::F16.shader_value(bytes))
            .collect();
        Self {
            size,
            texels: values.chunks_exact(channels).map(texel).collect(),
        }
    }
}

fn clip_size() -> [usize; 3] {
    let [width, height] = ClipTable::SIZE;
    [width, height, 1]
}

fn texel(channels: &[f32]) -> [f32; 4] {
    std::array::from_fn(|c| channels.get(c).copied().unwrap_or([0.0, 0.0, 0.0, 1.0][c]))
}

impl Span {
    fn new(coordinate: f32, size: usize) -> Self {
        let position = coordinate * size as f32 - 0.5;
        let below = position.floor();
        // The cast truncates and saturates; NaN becomes 0.
        let clamp = |texel: f32| (texel.max(0.0) as usize).min(size - 1);
        Self {
            texels: [clamp(below), clamp(below + 1.0)],
            weight: position - below,
        }
    }

    fn mix(&self, value: impl Fn(usize) -> [f32; 4]) -> [f32; 4] {
        let [first, second] = self.texels.map(value);
        std::array::from_fn(|c| first[c] + (second[c] - first[c]) * self.weight)
    }
}
