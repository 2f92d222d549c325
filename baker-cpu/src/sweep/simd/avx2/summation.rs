//! Moments of the masks of eight cells at a time: the SIMD version of
//! [`MaskLookup::accumulate`](crate::sweep::simd::portable::summation::MaskLookup).

use std::arch::x86_64::*;

use super::{LANES, int_array, ints, unsigned};
use crate::sweep::data::{Mask, RowMoments};
use crate::sweep::simd::RegisterLookup;

/// The number of bits that select a lane.
const INDEX_BITS: usize = LANES.ilog2() as usize;
pub(in crate::sweep) type Lookup =
    RegisterLookup<LANES, { (Mask::BITS as usize).div_ceil(INDEX_BITS) }>;

/// Adds eight numbers to others.
#[target_feature(enable = "avx2")]
#[inline]
fn add_to(moments: &mut [i32; LANES], addend: __m256i) {
    *moments = int_array(_mm256_add_epi32(ints(moments), addend));
}

/// Adds as [`MaskLookup::accumulate`](crate::sweep::simd::portable::summation::MaskLookup),
/// eight cells at a time. The bits of their masks select entries of tables in registers.
#[target_feature(enable = "avx2")]
#[inline]
pub(super) fn accumulate(lookup: &Lookup, masks: &[Mask], moments: RowMoments<'_>) {
    let part_bits = _mm256_set1_epi32((1 << INDEX_BITS) - 1);
    let mut moments = moments
        .0
        .map(|moments| moments.as_chunks_mut::<LANES>().0.iter_mut());
    for masks in masks.as_chunks::<LANES>().0 {
        let [counts, moment_rows @ ..] = moments
            .each_mut()
            .map(|moments| moments.next().expect("one value per mask"));
        let mut bits_left = unsigned(masks);
        // Most cells are away from all occluders.
        if _mm256_testz_si256(bits_left, bits_left) != 0 {
            continue;
        }
        add_to(counts, count_ones(bits_left));
        let mut addend = [_mm256_setzero_si256(); 4];
        for part in &lookup.0 {
            // Neighboring cells see occluders in the same few directions.
            if _mm256_testz_si256(bits_left, part_bits) == 0 {
                for (addend, table) in addend.iter_mut().zip(part) {
                    let selected = _mm256_permutevar8x32_epi32(ints(table), bits_left);
                    *addend = _mm256_add_epi32(*addend, selected);
                }
            }
            bits_left = _mm256_srli_epi32::<{ INDEX_BITS as i32 }>(bits_left);
        }
        for (moments, addend) in moment_rows.into_iter().zip(addend) {
            add_to(moments, addend);
        }
    }
}

/// Returns the number of set bits in each of eight numbers.
#[target_feature(enable = "avx2")]
#[inline]
fn count_ones(x: __m256i) -> __m256i {
    let ones = _mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
    let ones = _mm256_broadcastsi128_si256(ones);
    let low = _mm256_set1_epi8(0xf);
    let [a, b] = [x, _mm256_srli_epi32::<4>(x)].map(|x| _mm256_and_si256(x, low));
    let bytes = _mm256_add_epi8(_mm256_shuffle_epi8(ones, a), _mm256_shuffle_epi8(ones, b));
    let pairs = _mm256_maddubs_epi16(bytes, _mm256_set1_epi8(1));
    _mm256_madd_epi16(pairs, _mm256_set1_epi16(1))
}
