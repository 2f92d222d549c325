//! Summation: from differences along a row to the texels of its cells, and their moments.

use aogrid_bake_core::{FixedTexel, cube_face};

use super::counters::{COLUMN, Counter};
use super::frame::{Frame, LANES};
use super::sums::RowSums;

/// Occluded directions of a cell in one block: those of d in bits 0–15, of −d in 16–31.
pub(super) type Mask = u32;

/// Of the moments: of a [`FixedTexel`], or of several.
pub(super) type Share = [i32; 4];

/// The shares of the texels that the bits of a [`Mask`] are: zero for lanes beyond the face's
/// side.
pub(super) type Texels = [Share; Mask::BITS as usize];

/// Those of one batch and block.
pub(super) fn texels(all: &[FixedTexel], frame: &Frame, b: u32, block: usize) -> Texels {
    std::array::from_fn(|bit| {
        let texel = texel_of(frame, b, block, bit).map(|texel| all[texel]);
        let FixedTexel { a, m: [x, y, z] } = texel.unwrap_or_default();
        [a, x, y, z]
    })
}

/// The share of each subset of some texels next to each other: N is 2 to the power of how many
/// bits are looked up at once. Beyond the last texel there is nothing.
pub(super) fn subsets<const N: usize>(texels: &Texels, first: usize) -> [Share; N] {
    let mut shares = [Share::default(); N];
    for bits in 1..N {
        // All but the lowest bit, and that one.
        let texel = texels.get(first + bits.trailing_zeros() as usize);
        let [rest, texel] = [
            shares[bits & (bits - 1)],
            texel.copied().unwrap_or_default(),
        ];
        shares[bits] = std::array::from_fn(|i| rest[i] + texel[i]);
    }
    shares
}

/// Bits of a [`Mask`] that are looked up at once: few, so that the tables stay in a core's
/// first cache with the counters.
const BITS: usize = 4;

/// The shares of all masks, in parts.
pub(super) struct Shares([[Share; 1 << BITS]; Mask::BITS as usize / BITS]);

impl Shares {
    pub(super) fn new(texels: &Texels) -> Self {
        Self(std::array::from_fn(|part| subsets(texels, part * BITS)))
    }

    #[inline(always)]
    fn of(&self, mask: Mask) -> Share {
        let mut share = Share::default();
        for (idx, table) in self.0.iter().enumerate() {
            let part = table[(mask >> (idx * BITS)) as usize & ((1 << BITS) - 1)];
            for (sum, part) in share.iter_mut().zip(part) {
                *sum += part;
            }
        }
        share
    }

    /// Adds to each cell of a row what its mask says. This is what faster ways have to agree
    /// with.
    #[inline(always)]
    pub(super) fn add(&self, masks: &[Mask], mut sums: RowSums<'_>) {
        let (mut last, mut count, mut share) = (0, 0, Share::default());
        for (cell, &mask) in masks.iter().enumerate() {
            // Neighbours mostly see the same.
            if mask != last {
                (last, count, share) = (mask, mask.count_ones(), self.of(mask));
            }
            sums.add(cell, count, &share);
        }
    }
}

/// Which texel a bit of a [`Mask`] is; none for a lane beyond the face's side.
pub(super) fn texel_of(frame: &Frame, b: u32, block: usize, bit: usize) -> Option<usize> {
    let z = (block * LANES + bit % LANES) as u32;
    let size = frame.size;
    let opposite = |i: u32| size - 1 - i;
    (z < size).then(|| match bit < LANES {
        true => cube_face::texel_idx(size, frame.w, true, [z, b]),
        false => cube_face::texel_idx(size, frame.w, false, [opposite(z), opposite(b)]),
    })
}

/// The masks of a row's cells from the counters of its strip: running sums that are not zero.
#[inline(always)]
pub(super) fn masks<C: Counter>(counters: &[C], masks: &mut [Mask]) {
    let mut layers = [0_i32; COLUMN];
    for (column, mask) in counters.as_chunks::<COLUMN>().0.iter().zip(masks) {
        for (layers, &step) in layers.iter_mut().zip(column) {
            *layers += step.into();
        }
        *mask = 0;
        for (lane, layers) in (0_u32..).zip(&layers) {
            *mask |= u32::from(*layers != 0) << lane;
        }
    }
}

/// Whether nothing happens along a row.
#[inline(always)]
pub(super) fn is_zero(counters: &[i8]) -> bool {
    // All of them, and not up to the first: a machine does sixty-four at once.
    counters.iter().fold(0, |bits, n| bits | n) == 0
}

/// [`masks`] with running sums in bytes; whether some of them were too small for that.
#[inline(always)]
pub(super) fn narrow_masks(counters: &[i8], masks: &mut [Mask]) -> bool {
    let mut layers = [0_i8; COLUMN];
    let [mut lowest, mut highest] = [layers; 2];
    for (column, mask) in counters.as_chunks::<COLUMN>().0.iter().zip(masks) {
        for lane in 0..COLUMN {
            layers[lane] = layers[lane].saturating_add(column[lane]);
            lowest[lane] = lowest[lane].min(layers[lane]);
            highest[lane] = highest[lane].max(layers[lane]);
        }
        *mask = 0;
        for (lane, layers) in (0_u32..).zip(&layers) {
            *mask |= u32::from(*layers != 0) << lane;
        }
    }
    lowest.contains(&i8::MIN) || highest.contains(&i8::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_give_the_same_masks_or_say_that_they_are_too_small() {
        let mut state = 7_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 30) as i8 - 1
        };
        let mut strip: Vec<i8> = (0..40 * COLUMN).map(|_| next()).collect();
        let both = |strip: &[i8]| {
            let mut found = [[0; 40]; 2];
            masks(strip, &mut found[0]);
            let too_small = narrow_masks(strip, &mut found[1]);
            assert!(found[0].iter().any(|mask| !mask & 0xffff != 0));
            (found[0] == found[1], too_small)
        };
        // Lane 5 goes up and down by 126.
        for (column, steps) in strip.as_chunks_mut::<COLUMN>().0.iter_mut().enumerate() {
            steps[5] = [126, -126][column % 2];
        }
        assert_eq!(both(&strip), (true, false));
        strip[5] = 127;
        assert!(both(&strip).1);
        // Down twice, up twice: open again, where bytes have lost count.
        for (column, step) in [-126, -126, 126, 126].into_iter().enumerate() {
            strip[column * COLUMN + 5] = step;
        }
        assert_eq!(both(&strip), (false, true));
    }
}
