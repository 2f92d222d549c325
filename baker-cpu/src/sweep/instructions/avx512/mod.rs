//! x86-64 with registers of 64 bytes: sixteen vertices, edges or directions at once.

#![allow(
    unsafe_code,
    reason = "that the machine has the instructions is known here, and not to the compiler"
)]

mod crossings;
mod find;

use std::arch::x86_64::*;

use super::avx2::Avx2;
use super::{Batch, Edges, Find, Levels, Mask, Row, RowSums, Steps, Tables, Texels, Vectors, Work};
use crate::sweep::crossings::collect as collect_rest;
use crate::sweep::frame::LANES;
use crate::sweep::levels::{FRACTION_BITS, FRACTIONS};
use crate::sweep::silhouettes::Sides as EdgeSides;
use crate::sweep::steps::delta_bits;

/// The proof that the machine has what this module uses of AVX-512.
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

impl Vectors for Avx512 {
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
    fn find(self, find: Find<'_>) {
        // SAFETY: the machine has the instructions, or there were no `self`.
        unsafe { find::find(find) }
    }

    #[inline(always)]
    fn narrow_masks(self, counters: &[i8], masks: &mut [Mask]) -> bool {
        self.0.narrow_masks(counters, masks)
    }

    #[inline(always)]
    fn ranks(self, levels: &Levels, v: &[f32], w: &[f32], ranks: &mut [i32]) {
        // SAFETY: the machine has the instructions, or there were no `self`.
        unsafe { fill_ranks(levels, v, w, ranks) }
    }

    #[inline(always)]
    fn collect(self, row: &Row<'_>, edges: &mut Edges) {
        // SAFETY: the machine has the instructions, or there were no `self`.
        unsafe { collect(row, edges) }
    }

    #[inline(always)]
    fn count(self, batch: &Batch<'_>, edges: &Edges, unit: i8, steps: &mut Steps) {
        // SAFETY: the machine has the instructions, or there were no `self`.
        unsafe { crossings::count(batch, edges, unit, steps) }
    }
}

impl Avx512 {
    pub(super) fn run<W: Work>(self, work: W) {
        #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
        fn run<W: Work>(work: W, avx512: Avx512) {
            work.run(avx512);
        }
        // SAFETY: the machine has the instructions, or there were no `self`.
        unsafe { run(work, self) }
    }
}

/// Numbers with fewer are towards minus infinity, no exception is raised.
const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
const UP: i32 = _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC;

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn floats(from: &[f32; LANES]) -> __m512 {
    // SAFETY: sixteen floats are 64 bytes; they need not be aligned.
    unsafe { _mm512_loadu_ps(from.as_ptr()) }
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn ints(from: &[i32; LANES]) -> __m512i {
    // SAFETY: as `floats`.
    unsafe { _mm512_loadu_si512(from.as_ptr().cast()) }
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn unsigned(from: &[u32; LANES]) -> __m512i {
    // SAFETY: as `floats`.
    unsafe { _mm512_loadu_si512(from.as_ptr().cast()) }
}

/// Appends the chosen ones of sixteen pairs.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn append_pairs(chosen: __mmask16, from: [__m512i; 2], to: &mut Vec<[u32; 2]>) {
    to.reserve(LANES);
    let chosen = chosen.to_le_bytes();
    for (chosen, from) in chosen.into_iter().zip(from) {
        let n = chosen.count_ones() as usize;
        // SAFETY: there is room for the rest of sixteen pairs of eight bytes, of which the first
        // n are chosen.
        unsafe {
            let from = _mm512_maskz_compress_epi64(chosen, from);
            _mm512_storeu_si512(to.as_mut_ptr().add(to.len()).cast(), from);
            to.set_len(to.len() + n);
        }
    }
}

/// Appends the chosen ones of sixteen facings.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn append_sides(chosen: __mmask16, from: __m512i, to: &mut Vec<EdgeSides>) {
    to.reserve(LANES);
    let n = chosen.count_ones() as usize;
    // SAFETY: there is room for sixteen numbers of two bytes, of which the first n are chosen.
    unsafe {
        let from = _mm512_cvtepi32_epi16(_mm512_maskz_compress_epi32(chosen, from));
        _mm256_storeu_si256(to.as_mut_ptr().add(to.len()).cast(), from);
        to.set_len(to.len() + n);
    }
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn store<T: Number>(from: __m512i, to: &mut [T; LANES]) {
    // SAFETY: sixteen numbers of four bytes are 64 bytes; they need not be aligned.
    unsafe { _mm512_storeu_si512(to.as_mut_ptr().cast(), from) }
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn load_sides(from: &[EdgeSides; LANES]) -> __m512i {
    // SAFETY: sixteen numbers of two bytes are 32 bytes; they need not be aligned.
    unsafe { _mm512_cvtepu16_epi32(_mm256_loadu_si256(from.as_ptr().cast())) }
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn load_pairs(from: &[[u32; 2]; LANES]) -> [__m512i; 2] {
    let (halves, _) = from.as_flattened().as_chunks::<LANES>();
    [unsigned(&halves[0]), unsigned(&halves[1])]
}

/// A register as numbers. Where it crossed a cache line, each number would be waited for.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Array<T>([T; LANES]);

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn array(from: __m512) -> Array<f32> {
    let mut to = Array([0.0; LANES]);
    store(_mm512_castps_si512(from), &mut to.0);
    to
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn int_array(from: __m512i) -> Array<u32> {
    let mut to = Array([0; LANES]);
    store(from, &mut to.0);
    to
}

/// Four bytes of which every value is one.
trait Number {}
impl Number for u32 {}
impl Number for i32 {}
impl Number for f32 {}

/// Asks memory for what is soon looked at.
#[inline(always)]
fn fetch<T>(soon: &T) {
    // SAFETY: fetching has no effect but on time, and SSE is part of x86-64.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(soon).cast()) }
}

/// What a step of each lane has besides the place of its column.
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

    /// Looks at the lowest five bits of the index.
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

/// [`Levels::q`]: a product and a difference, and not both at once.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn q(levels: &Levels, v: __m512, w: __m512) -> __m512 {
    _mm512_sub_ps(v, _mm512_mul_ps(_mm512_set1_ps(levels.slope), w))
}

/// [`Levels::rank`]: the number of fractions below by bisection.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn rank(levels: &Levels, fractions: Table, q: __m512) -> __m512i {
    let whole = _mm512_roundscale_ps::<DOWN>(q);
    let fraction = _mm512_sub_ps(q, whole);
    let one = _mm512_set1_epi32(1);
    let mut below = _mm512_setzero_si512();
    for step in [16, 8, 4, 2, 1] {
        let more = _mm512_add_epi32(below, _mm512_set1_epi32(step));
        let last = fractions.float(_mm512_sub_epi32(more, one));
        let is_below = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(last, fraction);
        below = _mm512_mask_mov_epi32(below, is_below, more);
    }
    let is_below = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(fractions.float(below), fraction);
    below = _mm512_mask_add_epi32(below, is_below, below, one);
    let n = _mm512_set1_epi32(levels.n as i32);
    let all = _mm512_cmpeq_epi32_mask(below, n);
    below = _mm512_mask_mov_epi32(below, all, _mm512_set1_epi32(FRACTIONS as i32));
    let whole = _mm512_slli_epi32::<FRACTION_BITS>(_mm512_cvttps_epi32(whole));
    _mm512_add_epi32(whole, below)
}

/// [`crossings::collect`](crate::sweep::crossings::collect), sixteen edges at a time.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
fn collect(row: &Row<'_>, edges: &mut Edges) {
    let of_pairs = _mm512_set_epi32(30, 28, 26, 24, 22, 20, 18, 16, 14, 12, 10, 8, 6, 4, 2, 0);
    let firsts = of_pairs;
    let seconds = _mm512_add_epi32(of_pairs, _mm512_set1_epi32(1));
    let (vertices, _) = row.vertices.as_chunks::<LANES>();
    let (sides, _) = row.sides.as_chunks::<LANES>();
    let whole = LANES * sides.len();
    for (pairs, sides) in vertices.iter().zip(sides) {
        let [a, b] = load_pairs(pairs);
        let vertices = [firsts, seconds].map(|of| _mm512_permutex2var_epi32(a, of, b));
        // SAFETY: edges are of vertices that have ranks.
        let ranks = unsafe {
            [
                _mm512_i32gather_epi32::<4>(vertices[0], row.ranks.as_ptr().cast()),
                _mm512_i32gather_epi32::<4>(vertices[1], row.ranks.as_ptr().cast()),
            ]
        };
        let crossing = _mm512_cmpneq_epi32_mask(ranks[0], ranks[1]);
        let n = edges.n;
        for end in 0..2 {
            put(crossing, vertices[end], &mut edges.vertices[end], n);
            put(crossing, ranks[end], &mut edges.ranks[end], n);
        }
        put_sides(crossing, load_sides(sides), &mut edges.sides, n);
        edges.n += crossing.count_ones() as usize;
    }
    collect_rest(&row.after(whole), edges);
}

/// Puts the chosen ones of sixteen numbers at a place where there is room for all.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn put<T: Number, const N: usize>(chosen: __mmask16, from: __m512i, to: &mut [T; N], at: usize) {
    let room = to[at..].first_chunk_mut::<LANES>();
    let room = room.expect("there is room for sixteen");
    store(_mm512_maskz_compress_epi32(chosen, from), room);
}

/// [`put`] of facings.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn put_sides<const N: usize>(chosen: __mmask16, from: __m512i, to: &mut [EdgeSides; N], at: usize) {
    let room = to[at..].first_chunk_mut::<LANES>();
    let room: &mut [EdgeSides; LANES] = room.expect("there is room for sixteen");
    let from = _mm512_cvtepi32_epi16(_mm512_maskz_compress_epi32(chosen, from));
    // SAFETY: sixteen numbers of two bytes are 32 bytes; they need not be aligned.
    unsafe { _mm256_storeu_si256(room.as_mut_ptr().cast(), from) }
}

/// The bits that choose one of a register's numbers.
const BITS: usize = LANES.ilog2() as usize;
type Shares = Tables<LANES, { Mask::BITS as usize / BITS }>;

/// Adds sixteen numbers to others.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn add_to(sums: &mut [i32; LANES], more: __m512i) {
    store(_mm512_add_epi32(ints(sums), more), sums);
}

/// [`summation::Shares::add`](crate::sweep::summation::Shares::add): sixteen cells at a time, whose
/// bits choose from registers.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
fn add(shares: &Shares, masks: &[Mask], sums: RowSums<'_>) {
    let mut sums = sums
        .0
        .map(|sums| sums.as_chunks_mut::<LANES>().0.iter_mut());
    for masks in masks.as_chunks::<LANES>().0 {
        let [counts, shares_of @ ..] = sums.each_mut().map(|sums| sums.next().expect("one a mask"));
        let mut left = unsigned(masks);
        add_to(counts, count_ones(left));
        let mut more = [_mm512_setzero_si512(); 4];
        for part in &shares.0 {
            for (more, table) in more.iter_mut().zip(part) {
                *more = _mm512_add_epi32(*more, _mm512_permutexvar_epi32(left, ints(table)));
            }
            left = _mm512_srli_epi32::<{ BITS as u32 }>(left);
        }
        for (sums, more) in shares_of.into_iter().zip(more) {
            add_to(sums, more);
        }
    }
}

/// The bits that are set in each of sixteen numbers.
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
