//! The moments of texels, of masks, and of the cells of a row.

use aogrid_bake_core::FixedTexel;
use aogrid_bake_core::sweep::{AxisFrame, texel_idx};

/// The occluded directions of a cell in one block: those of d in bits 0–15, of −d in 16–31.
pub(in crate::sweep) type Mask = u32;

/// The occluded fraction and moment of a [`FixedTexel`], or of several: a, then m along x, y and z.
pub(in crate::sweep) type TexelMoment = [i32; 4];

/// The moments of the texels of one block, one for each bit of a [`Mask`]; zero for lanes beyond
/// the end of the texel row.
pub(in crate::sweep) type BlockTexels = [TexelMoment; Mask::BITS as usize];

/// The number of summed quantities: occluded texels, and the four components of their moments.
pub(in crate::sweep) const QUANTITIES: usize = 5;

/// Returns the texels of one batch and block.
pub(in crate::sweep) fn block_texels(
    all: &[FixedTexel],
    frame: &AxisFrame,
    b: u32,
    block: usize,
) -> BlockTexels {
    std::array::from_fn(|bit| {
        let texel = texel_idx(frame.size, frame.axes[2], b, block, bit);
        let texel = texel.map(|texel| all[texel]);
        let FixedTexel { a, m: [x, y, z] } = texel.unwrap_or_default();
        [a, x, y, z]
    })
}

/// Returns the sum of each subset of consecutive texels; N is 2 to the power of the number of bits
/// that index the table. Texels past the last count as zero.
pub(in crate::sweep) fn subset_sums<const N: usize>(
    texels: &BlockTexels,
    first: usize,
) -> [TexelMoment; N] {
    let mut moments = [TexelMoment::default(); N];
    for bits in 1..N {
        // The subset without its lowest bit, plus the texel of that bit.
        let texel = texels.get(first + bits.trailing_zeros() as usize);
        let [rest, texel] = [
            moments[bits & (bits - 1)],
            texel.copied().unwrap_or_default(),
        ];
        moments[bits] = std::array::from_fn(|i| rest[i] + texel[i]);
    }
    moments
}

/// The moments of a row's cells.
pub(in crate::sweep) struct RowMoments<'a>(pub [&'a mut [i32]; QUANTITIES]);

impl RowMoments<'_> {
    #[inline(always)]
    pub(in crate::sweep) fn accumulate(&mut self, cell: usize, count: u32, moment: &TexelMoment) {
        let [counts, moments @ ..] = &mut self.0;
        counts[cell] += count.cast_signed();
        for (values, moment) in moments.iter_mut().zip(moment) {
            values[cell] += moment;
        }
    }
}
