//! Summation: from layer counters along a row to the occluded texels of its cells, and their
//! moments.

use crate::sweep::data::{
    BlockTexels, COLUMN, Counter, Mask, RowMoments, TexelMoment, subset_sums,
};

/// The number of bits of a [`Mask`] that are looked up at a time: few, so that the tables stay in
/// the L1 cache with the counters.
const LOOKUP_BITS: usize = 4;

/// The moments of all masks, as one table for each part of the bits.
pub(in crate::sweep) struct MaskLookup(
    [[TexelMoment; 1 << LOOKUP_BITS]; Mask::BITS as usize / LOOKUP_BITS],
);

impl MaskLookup {
    pub(in crate::sweep) fn new(texels: &BlockTexels) -> Self {
        Self(std::array::from_fn(|part| {
            subset_sums(texels, part * LOOKUP_BITS)
        }))
    }

    #[inline(always)]
    fn moment_of(&self, mask: Mask) -> TexelMoment {
        let mut moment = TexelMoment::default();
        for (idx, table) in self.0.iter().enumerate() {
            let part = table[(mask >> (idx * LOOKUP_BITS)) as usize & ((1 << LOOKUP_BITS) - 1)];
            for (sum, part) in moment.iter_mut().zip(part) {
                *sum += part;
            }
        }
        moment
    }

    /// Adds the moments of each cell's mask to a row. The SIMD versions are tested against this
    /// one.
    #[inline(always)]
    pub(in crate::sweep) fn accumulate(&self, masks: &[Mask], mut row_moments: RowMoments<'_>) {
        let (mut last, mut count, mut moment) = (0, 0, TexelMoment::default());
        for (cell, &mask) in masks.iter().enumerate() {
            // Neighbors mostly have the same mask.
            if mask != last {
                (last, count, moment) = (mask, mask.count_ones(), self.moment_of(mask));
            }
            row_moments.accumulate(cell, count, &moment);
        }
    }
}

/// Computes the masks of a row's cells from the counters of its strip: the running sums that are
/// not zero.
#[inline(always)]
pub(in crate::sweep) fn masks<C: Counter>(counters: &[C], masks: &mut [Mask]) {
    let mut layers = [0_i32; COLUMN];
    for (column, mask) in counters.as_chunks::<COLUMN>().0.iter().zip(masks) {
        for (layers, &delta) in layers.iter_mut().zip(column) {
            *layers += delta.into();
        }
        *mask = 0;
        for (lane, layers) in (0_u32..).zip(&layers) {
            *mask |= u32::from(*layers != 0) << lane;
        }
    }
}

/// Whether a strip has no deltas.
#[inline(always)]
pub(in crate::sweep) fn is_zero(counters: &[i8]) -> bool {
    // No early exit: the whole fold compiles to 64 bytes per instruction.
    counters.iter().fold(0, |bits, n| bits | n) == 0
}

/// Computes [`masks`] with running sums in bytes; returns whether some may have saturated.
#[inline(always)]
pub(in crate::sweep) fn narrow_masks(counters: &[i8], masks: &mut [Mask]) -> bool {
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
    fn narrow_masks_match_wide_masks_or_report_overflow() {
        let mut bits = crate::random::random_bits(7);
        let mut next = || (bits() >> 62) as i8 - 1;
        let mut strip: Vec<i8> = (0..40 * COLUMN).map(|_| next()).collect();
        let both = |strip: &[i8]| {
            let mut found = [[0; 40]; 2];
            masks(strip, &mut found[0]);
            let too_small = narrow_masks(strip, &mut found[1]);
            assert!(found[0].iter().any(|mask| !mask & 0xffff != 0));
            (found[0] == found[1], too_small)
        };
        // Lane 5 goes up and down by 126.
        for (column, deltas) in strip.as_chunks_mut::<COLUMN>().0.iter_mut().enumerate() {
            deltas[5] = [126, -126][column % 2];
        }
        assert_eq!(both(&strip), (true, false));
        strip[5] = 127;
        assert!(both(&strip).1);
        // Down twice, up twice: unoccluded again, which saturated bytes have lost.
        for (column, delta) in [-126, -126, 126, 126].into_iter().enumerate() {
            strip[column * COLUMN + 5] = delta;
        }
        assert_eq!(both(&strip), (false, true));
    }
}
