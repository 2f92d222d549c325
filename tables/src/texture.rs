//! A texture with linear filtering, as on a GPU.

use crate::real::Float;

/// Returns the texture coordinate for the table argument `x`, 0..=1 along an axis with `size`
/// nodes.
///
/// The nodes include both ends of the axis: node i of N stands for x = i/(N − 1). A texture's texel
/// i has its center at (i + ½)/N. Hence the coordinate is x (N − 1)/N + ½/N.
pub fn texture_coordinate(x: f32, size: usize) -> f32 {
    let size = size as f32;
    x.within(0.0, 1.0) * ((size - 1.0) / size) + 0.5 / size
}

/// A texture with `C` channels, x fastest. A 2D texture has depth 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Texture<const C: usize> {
    size: [usize; 3],
    texels: Vec<[f32; C]>,
}

/// The two texels that are interpolated along an axis, and the weight of the second.
struct Span {
    texels: [usize; 2],
    weight: f32,
}

impl<const C: usize> Texture<C> {
    pub(crate) fn new(size: [usize; 3], texels: Vec<[f32; C]>) -> Self {
        assert_eq!(
            texels.len(),
            size.iter().product::<usize>(),
            "texels of a {size:?} texture"
        );
        Self { size, texels }
    }

    pub(crate) fn size(&self) -> [usize; 3] {
        self.size
    }

    pub(crate) fn texels(&self) -> &[[f32; C]] {
        &self.texels
    }

    pub(crate) fn texel(&self, [x, y, z]: [usize; 3]) -> [f32; C] {
        assert!(x < self.size[0] && y < self.size[1] && z < self.size[2]);
        self.texels[x + self.size[0] * (y + self.size[1] * z)]
    }

    pub(crate) fn map(&self, change: impl Fn(f32) -> f32) -> Self {
        let texels = self.texels.iter().map(|texel| texel.map(&change)).collect();
        Self {
            size: self.size,
            texels,
        }
    }

    /// Filters linearly at normalized coordinates, clamped to the edge.
    pub(crate) fn sample(&self, coordinates: [f32; 3]) -> [f32; C] {
        let [x, y, z] = std::array::from_fn(|axis| Span::new(coordinates[axis], self.size[axis]));
        let row = |y, z| x.mix(|x| self.texel([x, y, z]));
        z.mix(|z| y.mix(|y| row(y, z)))
    }
}

impl Span {
    fn new(coordinate: f32, size: usize) -> Self {
        let position = coordinate * size as f32 - 0.5;
        let below = position.floor();
        let clamp = |texel: f32| texel.within(0.0, (size - 1) as f32) as usize;
        Self {
            texels: [clamp(below), clamp(below + 1.0)],
            weight: position - below,
        }
    }

    fn mix<const C: usize>(&self, value: impl Fn(usize) -> [f32; C]) -> [f32; C] {
        let [first, second] = self.texels.map(value);
        std::array::from_fn(|k| first[k] + (second[k] - first[k]) * self.weight)
    }
}
