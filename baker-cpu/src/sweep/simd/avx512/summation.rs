//! Moments of the masks of sixteen cells at a time: the SIMD version of
//! [`MaskLookup::accumulate`](crate::sweep::simd::portable::summation::MaskLookup).

#![allow(
    unsafe_code,
    reason = "callers hold an `Avx512`, which proves that the CPU has these instructions"
)]

use std::arch::x86_64::*;

use aogrid_bake_core::sweep::LANES;

use super::{ints, store, unsigned};
use crate::sweep::data::{Mask, RowMoments};
use crate::sweep::simd::RegisterLookup;

/// The number of bits that select a lane.
const INDEX_BITS: usize = LANES.ilog2() as usize;
pub(in crate::sweep) type Lookup = RegisterLookup<LANES, { Mask::BITS as usize / INDEX_BITS }>;

/// Adds sixteen numbers to others.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn add_to(moments: &mut [i32; LANES], addend: __m512i) {
    store(_mm512_add_epi32(ints(moments), addend), moments);
}

/// Adds as [`MaskLookup::accumulate`](crate::sweep::simd::portable::summation::MaskLookup),
/// sixteen cells at a time. The bits of their masks select entries of tables in registers.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
pub(super) fn accumulate(lookup: &Lookup, masks: &[Mask], moments: RowMoments<'_>) {
    let mut moments = moments
        .0
        .map(|moments| moments.as_chunks_mut::<LANES>().0.iter_mut());
    for masks in masks.as_chunks::<LANES>().0 {
        let [counts, moment_rows @ ..] = moments
            .each_mut()
            .map(|moments| moments.next().expect("one value per mask"));
        let mut bits_left = unsigned(masks);
        add_to(counts, count_ones(bits_left));
        let mut addend = [_mm512_setzero_si512(); 4];
        for part in &lookup.0 {
            for (addend, table) in addend.iter_mut().zip(part) {
                *addend =
                    _mm512_add_epi32(*addend, _mm512_permutexvar_epi32(bits_left, ints(table)));
            }
            bits_left = _mm512_srli_epi32::<{ INDEX_BITS as u32 }>(bits_left);
        }
        for (moments, addend) in moment_rows.into_iter().zip(addend) {
            add_to(moments, addend);
        }
    }
}

/// Returns the number of set bits in each of sixteen numbers.
#[target_feature(enable = "avx512f,avx512bw,popcnt,bmi1,bmi2")]
#[inline]
fn count_ones(x: __m512i) -> __m512i {
    let ones = _mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
    let ones = _mm512_broadcast_i32x4(ones);
    let low = _mm512_set1_epi8(0xf);
    let [a, b] = [x, _mm512_srli_epi32::<4>(x)].map(|x| _mm512_and_si512(x, low));
    let bytes = _mm512_add_epi8(_mm512_shuffle_epi8(ones, a), _mm512_shuffle_epi8(ones, b));
    let pairs = _mm512_maddubs_epi16(bytes, _mm512_set1_epi8(1));
    _mm512_madd_epi16(pairs, _mm512_set1_epi16(1))
}
