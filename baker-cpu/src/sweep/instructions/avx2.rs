//! x86-64 with registers of 32 bytes.

#![allow(
    unsafe_code,
    reason = "that the machine has the instructions is known here, and not to the compiler"
)]

use std::arch::x86_64::*;

use super::{Mask, RowSums, Tables, Texels, Vectors, Work};
use crate::sweep::counters::COLUMN;

/// The proof that the machine has AVX2, and what came before it.
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

    pub(super) fn run<W: Work>(self, work: W) {
        #[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
        fn run<W: Work>(work: W, avx2: Avx2) {
            work.run(avx2);
        }
        // SAFETY: the machine has AVX2, or there were no `self`.
        unsafe { run(work, self) }
    }
}

impl Vectors for Avx2 {
    type Shares = Shares;

    fn shares(self, texels: &Texels) -> Shares {
        Tables::new(texels)
    }

    #[inline(always)]
    fn add(self, shares: &Shares, masks: &[Mask], sums: RowSums<'_>) {
        // SAFETY: the machine has the instructions, or there were no `self`.
        unsafe { add(shares, masks, sums) }
    }

    #[inline(always)]
    fn narrow_masks(self, counters: &[i8], masks: &mut [Mask]) -> bool {
        // SAFETY: the machine has the instructions, or there were no `self`.
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

/// Numbers of four bytes in a register.
const LANES: usize = 8;

/// The bits that choose one of a register's numbers.
const BITS: usize = LANES.ilog2() as usize;
type Shares = Tables<LANES, { (Mask::BITS as usize).div_ceil(BITS) }>;

#[target_feature(enable = "avx2")]
#[inline]
fn load_ints(from: &[i32; LANES]) -> __m256i {
    // SAFETY: eight numbers are 32 bytes, and need not be aligned.
    unsafe { _mm256_loadu_si256(from.as_ptr().cast()) }
}

/// Adds eight numbers to others.
#[target_feature(enable = "avx2")]
#[inline]
fn add_to(sums: &mut [i32; LANES], more: __m256i) {
    let sum = _mm256_add_epi32(load_ints(sums), more);
    // SAFETY: as `load_ints`.
    unsafe { _mm256_storeu_si256(sums.as_mut_ptr().cast(), sum) }
}

/// [`summation::Shares::add`](crate::sweep::summation::Shares::add): eight cells at a time, whose
/// bits choose from registers.
#[target_feature(enable = "avx2")]
#[inline]
fn add(shares: &Shares, masks: &[Mask], sums: RowSums<'_>) {
    let mut sums = sums
        .0
        .map(|sums| sums.as_chunks_mut::<LANES>().0.iter_mut());
    for masks in masks.as_chunks::<LANES>().0 {
        let [counts, shares_of @ ..] = sums.each_mut().map(|sums| sums.next().expect("one a mask"));
        let mut left = load_ints(&masks.map(u32::cast_signed));
        add_to(counts, count_ones(left));
        let mut more = [_mm256_setzero_si256(); 4];
        for part in &shares.0 {
            for (more, table) in more.iter_mut().zip(part) {
                let chosen = _mm256_permutevar8x32_epi32(load_ints(table), left);
                *more = _mm256_add_epi32(*more, chosen);
            }
            left = _mm256_srli_epi32::<{ BITS as i32 }>(left);
        }
        for (sums, more) in shares_of.into_iter().zip(more) {
            add_to(sums, more);
        }
    }
}

/// The bits that are set in each of eight numbers.
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
