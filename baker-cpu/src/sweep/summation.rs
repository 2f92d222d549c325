//! Summation: from differences along a row to the texels of its cells, and their moments.

use aogrid_bake_core::{FaceSums, FixedTexel, cube_face};

use super::counters::{COLUMN, Counter};
use super::frame::{Frame, LANES};

/// Occluded directions of a cell in one block: those of d in bits 0–15, of −d in 16–31.
pub(super) type Mask = u32;

/// The texels' shares of one batch and block, summed beforehand for each byte of a [`Mask`].
pub(super) struct Shares(Box<[[FaceSums; 256]; 4]>);

impl Shares {
    pub(super) fn new(texels: &[FixedTexel], frame: &Frame, b: u32, block: usize) -> Self {
        let mut shares = Box::new([[FaceSums::default(); 256]; 4]);
        for (byte, table) in shares.iter_mut().enumerate() {
            for bits in 1..256_usize {
                // All but the lowest bit, and that one.
                let mut sums = table[bits & (bits - 1)];
                let bit = 8 * byte + bits.trailing_zeros() as usize;
                if let Some(texel) = texel_of(frame, b, block, bit) {
                    sums.add(&texels[texel]);
                }
                table[bits] = sums;
            }
        }
        Self(shares)
    }

    #[inline(always)]
    fn of(&self, mask: Mask) -> FaceSums {
        let mut sums = FaceSums::default();
        for (table, byte) in self.0.iter().zip(mask.to_le_bytes()) {
            join(&mut sums, &table[usize::from(byte)]);
        }
        sums
    }

    /// Adds to each cell of a row what its mask says.
    #[inline(always)]
    pub(super) fn add(&self, masks: &[Mask], sums: &mut [FaceSums]) {
        let (mut last, mut share) = (0, FaceSums::default());
        for (&mask, sums) in masks.iter().zip(sums) {
            // Neighbours mostly see the same.
            if mask != last {
                (last, share) = (mask, self.of(mask));
            }
            join(sums, &share);
        }
    }
}

#[inline(always)]
pub(super) fn join(sums: &mut FaceSums, more: &FaceSums) {
    sums.count += more.count;
    sums.a += more.a;
    for (sum, m) in sums.m.iter_mut().zip(more.m) {
        *sum += m;
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

/// The masks of a row's cells from the counters of its block: running sums that are not zero.
#[inline(always)]
pub(super) fn masks<C: Counter>(counters: &[C], masks: &mut [Mask]) {
    let mut layers = [0_i32; COLUMN];
    let mut last = 0;
    for (column, mask) in counters.as_chunks::<COLUMN>().0.iter().zip(masks) {
        // Mostly nothing happens.
        if *column != [C::default(); COLUMN] {
            for (layers, &step) in layers.iter_mut().zip(column) {
                *layers += step.into();
            }
            last = 0;
            for (lane, layers) in (0_u32..).zip(&layers) {
                last |= u32::from(*layers != 0) << lane;
            }
        }
        *mask = last;
    }
}
