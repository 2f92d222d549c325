//! x86-64 with registers of 32 bytes.

#![allow(
    unsafe_code,
    reason = "that the machine has the instructions is known here, and not to the compiler"
)]

use std::arch::x86_64::*;

use super::{Mask, Vectors, Work};
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
