//! The AVX2 level: x86-64 with registers of 32 bytes; eight vertices, edges or directions at once.

#![allow(
    unsafe_code,
    reason = "the value of the SIMD level proves that the CPU has these instructions"
)]

mod compress;
mod crossings;
mod find;
mod ranks;
mod summation;

use std::arch::x86_64::*;
use std::mem::transmute;

use super::{RegisterLookup, Simd, SimdKernel};
use crate::sweep::data::{
    Batch, BlockTexels, COLUMN, DeltaBuffer, EdgeBuffer, Levels, Mask, RowMoments, SilhouetteSearch,
};
use summation::Lookup;

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
        unsafe { summation::accumulate(lookup, masks, moments) }
    }

    #[inline(always)]
    fn narrow_masks(self, counters: &[i8], masks: &mut [Mask]) -> bool {
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { narrow_masks(counters, masks) }
    }

    #[inline(always)]
    fn ranks(self, levels: &Levels, v: &[f32], w: &[f32], ranks: &mut [i32]) {
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { ranks::fill_ranks(levels, v, w, ranks) }
    }

    #[inline(always)]
    fn find_silhouettes(self, search: SilhouetteSearch<'_>) {
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { find::find(search) }
    }

    #[inline(always)]
    fn count(self, batch: &Batch<'_>, edges: &EdgeBuffer, unit: i8, deltas: &mut DeltaBuffer) {
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { crossings::count(batch, edges, unit, deltas) }
    }
}

#[target_feature(enable = "avx2")]
#[inline]
fn load(bytes: &[i8; COLUMN]) -> __m256i {
    // SAFETY: both are 32 bytes.
    unsafe { transmute::<[i8; COLUMN], __m256i>(*bytes) }
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

/// Loads by value: the intrinsics for unaligned memory check pointers in builds with assertions.
#[target_feature(enable = "avx2")]
#[inline]
fn floats(from: &[f32; LANES]) -> __m256 {
    // SAFETY: both are eight floats.
    unsafe { transmute::<[f32; LANES], __m256>(*from) }
}

#[target_feature(enable = "avx2")]
#[inline]
fn ints(from: &[i32; LANES]) -> __m256i {
    // SAFETY: both are 32 bytes, of which every value is valid.
    unsafe { transmute::<[i32; LANES], __m256i>(*from) }
}

#[target_feature(enable = "avx2")]
#[inline]
fn unsigned(from: &[u32; LANES]) -> __m256i {
    // SAFETY: as `ints`.
    unsafe { transmute::<[u32; LANES], __m256i>(*from) }
}

/// Loads the half of a register.
#[target_feature(enable = "avx2")]
#[inline]
fn four(from: &[u32; 4]) -> __m128i {
    // SAFETY: both are 16 bytes, of which every value is valid.
    unsafe { transmute::<[u32; 4], __m128i>(*from) }
}

#[target_feature(enable = "avx2")]
#[inline]
fn four_floats(from: &[f32; 4]) -> __m128i {
    // SAFETY: as `four`.
    unsafe { transmute::<[f32; 4], __m128i>(*from) }
}

#[target_feature(enable = "avx2")]
#[inline]
fn int_array(from: __m256i) -> [i32; LANES] {
    // SAFETY: as `ints`.
    unsafe { transmute::<__m256i, [i32; LANES]>(from) }
}

#[target_feature(enable = "avx2")]
#[inline]
fn unsigned_array(from: __m256i) -> [u32; LANES] {
    // SAFETY: as `ints`.
    unsafe { transmute::<__m256i, [u32; LANES]>(from) }
}

/// Computes [`Levels::q`]: a product and a difference, not fused.
#[target_feature(enable = "avx2")]
#[inline]
fn q(levels: &Levels, v: __m256, w: __m256) -> __m256 {
    _mm256_sub_ps(v, _mm256_mul_ps(_mm256_set1_ps(levels.slope), w))
}

/// Returns a bit for each lane that is set in a mask.
#[target_feature(enable = "avx2")]
#[inline]
fn lane_bits(mask: __m256i) -> u32 {
    _mm256_movemask_ps(_mm256_castsi256_ps(mask)).cast_unsigned()
}

/// The number of edges between the current one and the one whose data are prefetched, to hide the
/// latency of memory.
pub(in crate::sweep::simd) const PREFETCH_DISTANCE: usize = 24;

/// Prefetches the positions of the next `n` edges from `first` on.
#[inline(always)]
pub(in crate::sweep::simd) fn prefetch_positions(
    batch: &Batch<'_>,
    edges: &EdgeBuffer,
    (first, n): (usize, usize),
) {
    let later = first.min(edges.n)..(first + n).min(edges.n);
    for vertices in &edges.vertices {
        for &vertex in &vertices[later.clone()] {
            prefetch(&batch.positions[vertex as usize]);
        }
    }
}

/// Prefetches a value that is read soon.
#[inline(always)]
fn prefetch<T>(value: &T) {
    // SAFETY: a prefetch affects timing only, and SSE is part of x86-64.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast()) }
}
