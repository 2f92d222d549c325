//! The AVX2 level: x86-64 with registers of 32 bytes.

#![allow(
    unsafe_code,
    reason = "the value of the SIMD level proves that the CPU has these instructions"
)]

use std::arch::x86_64::*;

use super::{RegisterLookup, Simd, SimdKernel};
use crate::sweep::data::{BlockTexels, COLUMN, Mask, RowMoments};

/// A proof that the machine has AVX2 and the extensions before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::sweep) struct Avx2(());

impl Avx2 {
    pub(super) fn new() -> Option<Self> {
        let has_all = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("popcnt")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2");
        has_all.then_some(Self(()))
    }

    pub(super) fn run<K: SimdKernel>(self, kernel: K) {
        #[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
        fn run<K: SimdKernel>(kernel: K, avx2: Avx2) {
            kernel.run(avx2);
        }
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { run(kernel, self) }
    }
}

impl Simd for Avx2 {
    type Lookup = Lookup;

    fn mask_lookup(self, texels: &BlockTexels) -> Lookup {
        RegisterLookup::new(texels)
    }

    #[inline(always)]
    fn accumulate(self, lookup: &Lookup, masks: &[Mask], moments: RowMoments<'_>) {
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { accumulate(lookup, masks, moments) }
    }

    #[inline(always)]
    fn narrow_masks(self, counters: &[i8], masks: &mut [Mask]) -> bool {
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { narrow_masks(counters, masks) }
    }
}

#[target_feature(enable = "avx2")]
#[inline]
fn load(bytes: &[i8; COLUMN]) -> __m256i {
    // SAFETY: a column is 32 bytes, and need not be aligned.
    unsafe { _mm256_loadu_si256(bytes.as_ptr().cast()) }
}

#[target_feature(enable = "avx2")]
#[inline]
fn nonzero(bytes: __m256i) -> u32 {
    let zero = _mm256_cmpeq_epi8(bytes, _mm256_setzero_si256());
    !_mm256_movemask_epi8(zero).cast_unsigned()
}

#[target_feature(enable = "avx2")]
#[inline]
fn narrow_masks(counters: &[i8], masks: &mut [Mask]) -> bool {
    let mut layers = _mm256_setzero_si256();
    let [mut lowest, mut highest] = [layers; 2];
    for (column, mask) in counters.as_chunks().0.iter().zip(masks) {
        layers = _mm256_adds_epi8(layers, load(column));
        lowest = _mm256_min_epi8(lowest, layers);
        highest = _mm256_max_epi8(highest, layers);
        *mask = nonzero(layers);
    }
    let is = |bytes, value| _mm256_movemask_epi8(_mm256_cmpeq_epi8(bytes, _mm256_set1_epi8(value)));
    is(lowest, i8::MIN) | is(highest, i8::MAX) != 0
}

/// The number of 32-bit lanes in a register.
const LANES: usize = 8;

/// The number of bits that select a lane.
const INDEX_BITS: usize = LANES.ilog2() as usize;
type Lookup = RegisterLookup<LANES, { (Mask::BITS as usize).div_ceil(INDEX_BITS) }>;

#[target_feature(enable = "avx2")]
#[inline]
fn load_ints(from: &[i32; LANES]) -> __m256i {
    // SAFETY: eight numbers are 32 bytes, and need not be aligned.
    unsafe { _mm256_loadu_si256(from.as_ptr().cast()) }
}

/// Adds eight numbers to others.
#[target_feature(enable = "avx2")]
#[inline]
fn add_to(moments: &mut [i32; LANES], addend: __m256i) {
    let sum = _mm256_add_epi32(load_ints(moments), addend);
    // SAFETY: as `load_ints`.
    unsafe { _mm256_storeu_si256(moments.as_mut_ptr().cast(), sum) }
}

/// Adds as [`MaskLookup::accumulate`](crate::sweep::simd::portable::summation::MaskLookup),
/// eight cells at a time. The bits of their masks select entries of tables in registers.
#[target_feature(enable = "avx2")]
#[inline]
fn accumulate(lookup: &Lookup, masks: &[Mask], moments: RowMoments<'_>) {
    let mut moments = moments
        .0
        .map(|moments| moments.as_chunks_mut::<LANES>().0.iter_mut());
    for masks in masks.as_chunks::<LANES>().0 {
        let [counts, moment_rows @ ..] = moments
            .each_mut()
            .map(|moments| moments.next().expect("one value per mask"));
        let mut bits_left = load_ints(&masks.map(u32::cast_signed));
        add_to(counts, count_ones(bits_left));
        let mut addend = [_mm256_setzero_si256(); 4];
        for part in &lookup.0 {
            for (addend, table) in addend.iter_mut().zip(part) {
                let selected = _mm256_permutevar8x32_epi32(load_ints(table), bits_left);
                *addend = _mm256_add_epi32(*addend, selected);
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
