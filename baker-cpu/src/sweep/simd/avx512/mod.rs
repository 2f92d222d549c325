//! The AVX-512 level: x86-64 with registers of 64 bytes; sixteen vertices, edges or directions at
//! once.

#![allow(
    unsafe_code,
    reason = "the value of the SIMD level proves that the CPU has these instructions"
)]

mod crossings;
mod summation;

use std::arch::x86_64::*;
use std::mem::{transmute, transmute_copy};

use aogrid_bake_core::sweep::LANES;

use super::avx2::Avx2;
use super::portable::crossings::collect as collect_rest;
use super::{RegisterLookup, Simd, SimdKernel};
use crate::sweep::data::{
    Batch, BlockTexels, DeltaBuffer, EdgeBuffer, EdgeFacing, FRACTION_BITS, FRACTIONS, Levels,
    Mask, RowMoments, SilhouetteChunk, SilhouetteSearch, delta_bits,
};

/// A proof that the machine has the parts of AVX-512 that this module uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::sweep) struct Avx512(Avx2);

impl Avx512 {
    pub(super) fn new() -> Option<Self> {
        let has_all = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("popcnt")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2");
        Avx2::new().filter(|_| has_all).map(Self)
    }
}

impl Simd for Avx512 {
    type Lookup = summation::Lookup;

    fn mask_lookup(self, texels: &BlockTexels) -> summation::Lookup {
        RegisterLookup::new(texels)
    }

    #[inline(always)]
    fn accumulate(self, lookup: &summation::Lookup, masks: &[Mask], moments: RowMoments<'_>) {
        // SAFETY: a value of `Avx512` exists only on machines that have it.
        unsafe { summation::accumulate(lookup, masks, moments) }
    }

    #[inline(always)]
    fn find_silhouettes(self, search: SilhouetteSearch<'_>) {
        self.0.find_silhouettes(search);
    }

    #[inline(always)]
    fn narrow_masks(self, counters: &[i8], masks: &mut [Mask]) -> bool {
        self.0.narrow_masks(counters, masks)
    }

    #[inline(always)]
    fn ranks(self, levels: &Levels, v: &[f32], w: &[f32], ranks: &mut [i32]) {
        // SAFETY: a value of `Avx512` exists only on machines that have it.
        unsafe { fill_ranks(levels, v, w, ranks) }
    }

    #[inline(always)]
    fn collect(self, chunk: &SilhouetteChunk<'_>, edges: &mut EdgeBuffer) {
        // SAFETY: a value of `Avx512` exists only on machines that have it.
        unsafe { collect(chunk, edges) }
    }

    #[inline(always)]
    fn count(self, batch: &Batch<'_>, edges: &EdgeBuffer, unit: i8, deltas: &mut DeltaBuffer) {
        // SAFETY: a value of `Avx512` exists only on machines that have it.
        unsafe { crossings::count(batch, edges, unit, deltas) }
    }
}

impl Avx512 {
    pub(super) fn run<K: SimdKernel>(self, kernel: K) {
        #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
        fn run<K: SimdKernel>(kernel: K, avx512: Avx512) {
            kernel.run(avx512);
        }
        // SAFETY: a value of `Avx512` exists only on machines that have it.
        unsafe { run(kernel, self) }
    }
}

/// Rounding towards minus infinity, without exceptions.
const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
const UP: i32 = _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC;

/// Loads by value: the intrinsics for unaligned memory check pointers in builds with assertions.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn floats(from: &[f32; LANES]) -> __m512 {
    // SAFETY: both are sixteen floats.
    unsafe { transmute::<[f32; LANES], __m512>(*from) }
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn ints(from: &[i32; LANES]) -> __m512i {
    // SAFETY: both are 64 bytes, of which every value is valid.
    unsafe { transmute::<[i32; LANES], __m512i>(*from) }
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn unsigned(from: &[u32; LANES]) -> __m512i {
    // SAFETY: as `ints`.
    unsafe { transmute::<[u32; LANES], __m512i>(*from) }
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn store<T: Scalar32>(from: __m512i, to: &mut [T; LANES]) {
    // SAFETY: sixteen numbers of four bytes are 64 bytes, of which every value is valid.
    *to = unsafe { transmute_copy::<__m512i, [T; LANES]>(&from) };
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn load_facings(from: &[EdgeFacing; LANES]) -> __m512i {
    // SAFETY: both are 32 bytes, of which every value is valid.
    _mm512_cvtepu16_epi32(unsafe { transmute::<[EdgeFacing; LANES], __m256i>(*from) })
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn load_pairs(from: &[[u32; 2]; LANES]) -> [__m512i; 2] {
    let (halves, _) = from.as_flattened().as_chunks::<LANES>();
    [unsigned(&halves[0]), unsigned(&halves[1])]
}

/// The lanes of a register, as an array. Aligned, because reads from a store that crosses a cache
/// line would stall.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct LaneArray<T>([T; LANES]);

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn array(from: __m512) -> LaneArray<f32> {
    let mut to = LaneArray([0.0; LANES]);
    store(_mm512_castps_si512(from), &mut to.0);
    to
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn int_array(from: __m512i) -> LaneArray<u32> {
    let mut to = LaneArray([0; LANES]);
    store(from, &mut to.0);
    to
}

/// A four-byte type for which every bit pattern is valid.
trait Scalar32: Copy {}
impl Scalar32 for u32 {}
impl Scalar32 for i32 {}
impl Scalar32 for f32 {}

/// Returns the part of each lane's delta that does not depend on its column.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn lane_deltas(delta: i8) -> __m512i {
    let lanes = _mm512_set_epi32(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
    _mm512_add_epi32(lanes, _mm512_set1_epi32(delta_bits(delta).cast_signed()))
}

/// A table with an entry for each of a tile's fractions.
#[derive(Clone, Copy)]
struct Table([__m512i; 2]);

impl Table {
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn floats(from: &[f32; FRACTIONS]) -> Self {
        let (halves, _) = from.as_chunks::<LANES>();
        Self([
            _mm512_castps_si512(floats(&halves[0])),
            _mm512_castps_si512(floats(&halves[1])),
        ])
    }

    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn ints(from: &[i32; FRACTIONS]) -> Self {
        let (halves, _) = from.as_chunks::<LANES>();
        Self([ints(&halves[0]), ints(&halves[1])])
    }

    /// Looks up entries by the lowest five bits of the index.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn int(self, idx: __m512i) -> __m512i {
        _mm512_permutex2var_epi32(self.0[0], idx, self.0[1])
    }

    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn float(self, idx: __m512i) -> __m512 {
        _mm512_castsi512_ps(self.int(idx))
    }
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
fn fill_ranks(levels: &Levels, v: &[f32], w: &[f32], ranks: &mut [i32]) {
    let fractions = Table::floats(&levels.fractions);
    let (v, last_v) = v.as_chunks::<LANES>();
    let (w, last_w) = w.as_chunks::<LANES>();
    let (ranks, last) = ranks.as_chunks_mut::<LANES>();
    for (ranks, (v, w)) in ranks.iter_mut().zip(v.iter().zip(w)) {
        let q = q(levels, floats(v), floats(w));
        store(rank(levels, fractions, q), ranks);
    }
    for (rank, (&v, &w)) in last.iter_mut().zip(last_v.iter().zip(last_w)) {
        *rank = levels.rank(v, w);
    }
}

/// Computes [`Levels::q`]: a product and a difference, not fused.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn q(levels: &Levels, v: __m512, w: __m512) -> __m512 {
    _mm512_sub_ps(v, _mm512_mul_ps(_mm512_set1_ps(levels.slope), w))
}

/// Computes [`Levels::rank`]: counts the fractions below by bisection.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn rank(levels: &Levels, fractions: Table, q: __m512) -> __m512i {
    let whole = _mm512_roundscale_ps::<DOWN>(q);
    let fraction = _mm512_sub_ps(q, whole);
    let one = _mm512_set1_epi32(1);
    let mut below = _mm512_setzero_si512();
    for half in [16, 8, 4, 2, 1] {
        let candidate = _mm512_add_epi32(below, _mm512_set1_epi32(half));
        let last = fractions.float(_mm512_sub_epi32(candidate, one));
        let is_below = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(last, fraction);
        below = _mm512_mask_mov_epi32(below, is_below, candidate);
    }
    // Bisection ends at 31; one more comparison reaches 32.
    let is_below = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(fractions.float(below), fraction);
    below = _mm512_mask_add_epi32(below, is_below, below, one);
    let n = _mm512_set1_epi32(levels.n as i32);
    let all = _mm512_cmpeq_epi32_mask(below, n);
    below = _mm512_mask_mov_epi32(below, all, _mm512_set1_epi32(FRACTIONS as i32));
    let whole = _mm512_slli_epi32::<FRACTION_BITS>(_mm512_cvttps_epi32(whole));
    _mm512_add_epi32(whole, below)
}

/// Collects as [`collect`](crate::sweep::simd::portable::crossings::collect), sixteen edges at a time.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
fn collect(chunk: &SilhouetteChunk<'_>, edges: &mut EdgeBuffer) {
    let of_pairs = _mm512_set_epi32(30, 28, 26, 24, 22, 20, 18, 16, 14, 12, 10, 8, 6, 4, 2, 0);
    let firsts = of_pairs;
    let seconds = _mm512_add_epi32(of_pairs, _mm512_set1_epi32(1));
    let (vertices, _) = chunk.vertices.as_chunks::<LANES>();
    let (facings, _) = chunk.facings.as_chunks::<LANES>();
    let whole = LANES * facings.len();
    for (pairs, facings) in vertices.iter().zip(facings) {
        let [a, b] = load_pairs(pairs);
        let vertices = [firsts, seconds].map(|of| _mm512_permutex2var_epi32(a, of, b));
        // SAFETY: every vertex of an edge has a rank.
        let ranks = unsafe {
            [
                _mm512_i32gather_epi32::<4>(vertices[0], chunk.ranks.as_ptr().cast()),
                _mm512_i32gather_epi32::<4>(vertices[1], chunk.ranks.as_ptr().cast()),
            ]
        };
        let crossing = _mm512_cmpneq_epi32_mask(ranks[0], ranks[1]);
        let n = edges.n;
        for end in 0..2 {
            store_compressed(crossing, vertices[end], &mut edges.vertices[end], n);
            store_compressed(crossing, ranks[end], &mut edges.ranks[end], n);
        }
        store_compressed_facings(crossing, load_facings(facings), &mut edges.facings, n);
        edges.n += crossing.count_ones() as usize;
    }
    collect_rest(&chunk.after(whole), edges);
}

/// Stores the selected ones of sixteen numbers from index `at` on, where there is space for all.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn store_compressed<T: Scalar32, const N: usize>(
    selected: __mmask16,
    from: __m512i,
    to: &mut [T; N],
    at: usize,
) {
    let slots = to[at..].first_chunk_mut::<LANES>();
    let slots = slots.expect("sixteen slots are free");
    store(_mm512_maskz_compress_epi32(selected, from), slots);
}

/// Stores facings as [`store_compressed`] does.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn store_compressed_facings<const N: usize>(
    selected: __mmask16,
    from: __m512i,
    to: &mut [EdgeFacing; N],
    at: usize,
) {
    let slots = to[at..].first_chunk_mut::<LANES>();
    let slots: &mut [EdgeFacing; LANES] = slots.expect("sixteen slots are free");
    let from = _mm512_cvtepi32_epi16(_mm512_maskz_compress_epi32(selected, from));
    // SAFETY: both are 32 bytes, of which every value is valid.
    *slots = unsafe { transmute::<__m256i, [EdgeFacing; LANES]>(from) };
}
