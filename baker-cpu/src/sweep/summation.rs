//! Summation: from differences along a row to the texels of its cells, and their moments.

use aogrid_bake_core::{FaceSums, FixedTexel, cube_face};

use super::counters::{COLUMN, Counter};
use super::frame::{Frame, LANES};

/// Occluded directions of a cell in one block: those of d in bits 0–15, of −d in 16–31.
pub(super) type Mask = u32;

/// [`FaceSums`] as a machine adds them: at once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(align(32))]
pub(super) struct Sums([i32; 8]);

impl Sums {
    #[inline(always)]
    pub(super) fn add(&mut self, more: &Self) {
        for (sum, more) in self.0.iter_mut().zip(&more.0) {
            *sum += more;
        }
    }

    pub(super) fn is_zero(&self) -> bool {
        self.0[0] == 0
    }

    /// Adds to the sums of a cell.
    #[inline(always)]
    pub(super) fn add_to(&self, sums: &mut FaceSums) {
        let [count, a, m @ .., _, _, _] = self.0;
        sums.count += count as u32;
        sums.a += a;
        for (sum, m) in sums.m.iter_mut().zip::<[i32; 3]>(m) {
            *sum += m;
        }
    }
}

impl From<&FixedTexel> for Sums {
    fn from(texel: &FixedTexel) -> Self {
        let [x, y, z] = texel.m;
        Self([1, texel.a, x, y, z, 0, 0, 0])
    }
}

/// Bits of a [`Mask`] that are looked up at once: few, so that the tables stay in a core's
/// first cache with the counters.
const BITS: usize = 4;
const TABLES: usize = Mask::BITS as usize / BITS;

/// The texels' shares of one batch and block, summed beforehand.
#[derive(Clone)]
pub(super) struct Shares([[Sums; 1 << BITS]; TABLES]);

impl Shares {
    pub(super) fn new(texels: &[FixedTexel], frame: &Frame, b: u32, block: usize) -> Self {
        let mut shares = [[Sums::default(); 1 << BITS]; TABLES];
        for (first, table) in (0..).step_by(BITS).zip(&mut shares) {
            for bits in 1..1_usize << BITS {
                // All but the lowest bit, and that one.
                let mut sums = table[bits & (bits - 1)];
                let bit = first + bits.trailing_zeros() as usize;
                if let Some(texel) = texel_of(frame, b, block, bit) {
                    sums.add(&Sums::from(&texels[texel]));
                }
                table[bits] = sums;
            }
        }
        Self(shares)
    }

    #[inline(always)]
    fn of(&self, mask: Mask) -> Sums {
        let mut sums = Sums::default();
        for (idx, table) in self.0.iter().enumerate() {
            sums.add(&table[(mask >> (idx * BITS)) as usize & ((1 << BITS) - 1)]);
        }
        sums
    }

    /// Adds to each cell of a row what its mask says.
    #[inline(always)]
    pub(super) fn add(&self, masks: &[Mask], sums: &mut [Sums]) {
        let (mut last, mut share) = (0, Sums::default());
        for (&mask, sums) in masks.iter().zip(sums) {
            // Neighbours mostly see the same.
            if mask != last {
                (last, share) = (mask, self.of(mask));
            }
            sums.add(&share);
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
