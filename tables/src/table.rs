//! The tables as textures: their nodes, their generation row by row, and their look-up.

use crate::clip::{self, Clip};
use crate::format::Format;
use crate::generated;
use crate::merge;
use crate::texture::{Texture, texture_coordinate};
use std::f32::consts::PI;

/// `T_clip` at the nodes of a 2D texture: x is `a`, y is (cos β + 1)/2.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipTable {
    texture: Texture<3>,
}

/// `T_merge` at the nodes of a 3D texture: x is `a1`, y is `a2`, z is γ/π.
#[derive(Clone, Debug, PartialEq)]
pub struct MergeTable {
    texture: Texture<1>,
}

/// A row of a [`ClipTable`]: AO, a′ and f for every `a`.
pub type ClipRow = Vec<[f32; 3]>;

/// A row of a [`MergeTable`]: the union for every `a1`.
pub type MergeRow = Vec<f32>;

impl ClipTable {
    /// Numbers of nodes of the committed table along `a` and cos β.
    pub const SIZE: [usize; 2] = [64, 64];

    /// Returns the committed table, the master at full precision.
    pub fn committed() -> Self {
        Self::new(Self::SIZE, generated::clip_master())
    }

    /// Computes row `y` of a table by [`clip::integrate`]. Rows are the unit of work for callers
    /// with threads, a progress bar or cancellation.
    ///
    /// # Panics
    /// If an axis has fewer than two nodes.
    pub fn row(size: [usize; 2], y: usize) -> ClipRow {
        let cos_beta = 2.0 * node(y, size[1]) - 1.0;
        let texel = |x| {
            clip::integrate(node(x, size[0]), cos_beta)
                .to_array()
                .map(to_master)
        };
        (0..size[0]).map(texel).collect()
    }

    /// Returns the number of rows of a table.
    pub fn row_count(size: [usize; 2]) -> usize {
        size[1]
    }

    /// Assembles a table from all of its rows, in their order.
    ///
    /// # Panics
    /// If the rows do not fill a texture of the given size.
    pub fn from_rows(size: [usize; 2], rows: Vec<ClipRow>) -> Self {
        Self::new(size, rows.concat())
    }

    /// Generates a whole table on this thread.
    pub fn generate(size: [usize; 2]) -> Self {
        Self::from_rows(
            size,
            (0..Self::row_count(size))
                .map(|y| Self::row(size, y))
                .collect(),
        )
    }

    /// Returns the numbers of nodes along `a` and cos β.
    pub fn size(&self) -> [usize; 2] {
        let [width, height, _] = self.texture.size();
        [width, height]
    }

    /// Returns the entry for a = `x`/(width − 1) and cos β = 2 `y`/(height − 1) − 1.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn node(&self, x: usize, y: usize) -> Clip<f32> {
        Clip::from_array(self.texture.texel([x, y, 0]))
    }

    /// Looks up an entry with linear filtering, as a GPU does but for its low-precision weights.
    /// Arguments as for [`clip::integrate`].
    pub fn sample(&self, a: f32, cos_beta: f32) -> Clip<f32> {
        let [width, height] = self.size();
        let x = texture_coordinate(a, width);
        let y = texture_coordinate(0.5 * cos_beta + 0.5, height);
        Clip::from_array(self.texture.sample([x, y, 0.5]))
    }

    /// Returns the table as a shader reads it after its upload in the given format.
    pub fn quantized(&self, format: Format) -> Self {
        Self {
            texture: self.texture.map(|value| format.quantize(value)),
        }
    }

    /// Returns shape and values of the nodes for analysis: C order, shape (a, cos β, \[AO, a′,
    /// f\]).
    pub fn node_array(&self) -> ([usize; 3], Vec<f32>) {
        let [width, height] = self.size();
        let nodes = (0..width).flat_map(|x| (0..height).map(move |y| [x, y, 0]));
        let values = nodes.flat_map(|node| self.texture.texel(node)).collect();
        ([width, height, 3], values)
    }

    /// Returns the texels to upload, x fastest: AO, a′, f, and 1 in the fourth channel, the value
    /// that a shader reads from a texture without one.
    pub(crate) fn encode(&self, format: Format) -> Vec<u8> {
        let rgba = |&[r, g, b]: &[f32; 3]| [r, g, b, 1.0];
        format.encode(self.master().iter().flat_map(rgba))
    }

    /// Returns AO, a′ and f of every node, x fastest.
    pub(crate) fn master(&self) -> &[[f32; 3]] {
        self.texture.texels()
    }

    fn new([width, height]: [usize; 2], texels: Vec<[f32; 3]>) -> Self {
        Self {
            texture: Texture::new([width, height, 1], texels),
        }
    }
}

impl MergeTable {
    /// Numbers of nodes of the committed table along `a1`, `a2` and γ.
    pub const SIZE: [usize; 3] = [48, 48, 32];

    /// Returns the committed table, the master at full precision.
    pub fn committed() -> Self {
        Self {
            texture: Texture::new(Self::SIZE, generated::merge_master()),
        }
    }

    /// Computes row y + height · z of a table by [`merge::integrate`]. Rows are the unit of work
    /// for callers with threads, a progress bar or cancellation.
    ///
    /// # Panics
    /// If an axis has fewer than two nodes.
    pub fn row([width, height, depth]: [usize; 3], row: usize) -> MergeRow {
        let a2 = node(row % height, height);
        let gamma = std::f64::consts::PI * node(row / height, depth);
        (0..width)
            .map(|x| to_master(merge::integrate(node(x, width), a2, gamma)))
            .collect()
    }

    /// Returns the number of rows of a table.
    pub fn row_count([_, height, depth]: [usize; 3]) -> usize {
        height * depth
    }

    /// Assembles a table from all of its rows, in their order.
    ///
    /// # Panics
    /// If the rows do not fill a texture of the given size.
    pub fn from_rows(size: [usize; 3], rows: Vec<MergeRow>) -> Self {
        let texels = rows.into_iter().flatten().map(|union| [union]).collect();
        Self {
            texture: Texture::new(size, texels),
        }
    }

    /// Generates a whole table on this thread.
    pub fn generate(size: [usize; 3]) -> Self {
        Self::from_rows(
            size,
            (0..Self::row_count(size))
                .map(|row| Self::row(size, row))
                .collect(),
        )
    }

    /// Returns the numbers of nodes along `a1`, `a2` and γ.
    pub fn size(&self) -> [usize; 3] {
        self.texture.size()
    }

    /// Returns the entry for a1 = `x`/(width − 1), a2 = `y`/(height − 1) and γ = π `z`/(depth − 1).
    ///
    /// # Panics
    /// If there is no such node.
    pub fn node(&self, x: usize, y: usize, z: usize) -> f32 {
        let [union] = self.texture.texel([x, y, z]);
        union
    }

    /// Looks up an entry with linear filtering, as a GPU does but for its low-precision weights.
    /// Arguments as for [`merge::integrate`].
    pub fn sample(&self, a1: f32, a2: f32, gamma: f32) -> f32 {
        let [width, height, depth] = self.size();
        let x = texture_coordinate(a1, width);
        let y = texture_coordinate(a2, height);
        let z = texture_coordinate(gamma / PI, depth);
        let [union] = self.texture.sample([x, y, z]);
        union
    }

    /// Returns the table as a shader reads it after its upload in the given format.
    pub fn quantized(&self, format: Format) -> Self {
        Self {
            texture: self.texture.map(|value| format.quantize(value)),
        }
    }

    /// Returns shape and values of the nodes for analysis: C order, shape (a1, a2, γ).
    pub fn node_array(&self) -> ([usize; 3], Vec<f32>) {
        let [width, height, depth] = self.size();
        let columns = (0..width).flat_map(|x| (0..height).map(move |y| (x, y)));
        let values = columns.flat_map(|(x, y)| (0..depth).map(move |z| self.node(x, y, z)));
        (self.size(), values.collect())
    }

    /// Returns the texels to upload, x fastest, one channel.
    pub(crate) fn encode(&self, format: Format) -> Vec<u8> {
        format.encode(self.master().iter().flatten().copied())
    }

    /// Returns the fraction that both cones cover, for every node, x fastest.
    pub(crate) fn intersections(&self) -> impl Iterator<Item = f32> {
        let [width, height, _] = self.size();
        self.master().iter().enumerate().map(move |(idx, [union])| {
            let (a1, a2) = (idx % width, idx / width % height);
            let sum = node(a1, width) + node(a2, height);
            ((sum - f64::from(*union)) as f32).max(0.0)
        })
    }

    /// Returns the union at every node, x fastest.
    pub(crate) fn master(&self) -> &[[f32; 1]] {
        self.texture.texels()
    }
}

/// Returns the position of node `index` of `size` on the unit interval; the first and the last node
/// are its ends.
fn node(index: usize, size: usize) -> f64 {
    assert!(size >= 2, "a table's axis needs a node at either end");
    index as f64 / (size - 1) as f64
}

/// Rounds a value of 0..=1 to the master's precision, a multiple of 2⁻²⁴, which an `f32` holds
/// exactly. Finer digits would depend on the platform's sine and cosine.
fn to_master(value: f64) -> f32 {
    const STEPS: f64 = (1 << 24) as f64;
    ((value * STEPS).round() / STEPS) as f32
}
