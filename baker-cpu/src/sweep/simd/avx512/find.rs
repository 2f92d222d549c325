//! Silhouettes of sixteen edges at a time: the SIMD version of
//! [`silhouettes::find`](crate::sweep::simd::portable::silhouettes::find).

#![allow(
    unsafe_code,
    reason = "callers hold an `Avx512`, which proves that the CPU has these instructions"
)]

use std::arch::x86_64::*;
use std::mem::transmute;

use aogrid_bake_core::sweep::LANES;

use super::super::avx2::prefetch;
use super::{append_facings, append_pairs, load_pairs, unsigned};
use crate::sweep::data::{SilhouetteList, SilhouetteSearch, TriangleFacing};

/// Searches as [`silhouettes::find`](crate::sweep::simd::portable::silhouettes::find): silhouettes
/// are gathered until there are sixteen, and then distributed to the lists of all texel rows.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
pub(super) fn find(search: SilhouetteSearch<'_>) {
    let rows = u16::MAX >> (LANES - search.n_rows);
    let mut buffer = SilhouetteBuffer::default();
    for (idx, edge) in search.edges.iter().enumerate() {
        if let Some(later) = search.edges.get(idx + PREFETCH_DISTANCE) {
            for side in later.sides {
                prefetch(&search.facings[side.triangle()]);
            }
        }
        let [one, other] = search.facings_of(edge);
        let [one, other] = [oriented(one.0, one.1), oriented(other.0, other.1)];
        let differ = _mm_xor_si128(one, other);
        // One half-edge runs along the edge and the other against it: they cancel where they are
        // equal.
        let silhouette_rows = rows & !_mm_cmpeq_epi8_mask(differ, _mm_set1_epi8(i8::MIN));
        buffer.push(edge.vertices, silhouette_rows, one, other);
        if buffer.n == LANES {
            buffer.flush(search.n_rows, search.lists);
        }
    }
    buffer.flush(search.n_rows, search.lists);
}

/// The number of edges between the current one and the one whose facings are prefetched, to hide
/// the latency of memory.
const PREFETCH_DISTANCE: usize = 24;

/// Computes `FacingInterval::oriented` of sixteen facings.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
fn oriented(facings: &TriangleFacing, reversed: bool) -> __m128i {
    // SAFETY: both are 16 bytes, of which every value is valid.
    let facings = unsafe { transmute::<TriangleFacing, __m128i>(*facings) };
    let sign = if reversed { i8::MIN } else { 0 };
    _mm_xor_si128(facings, _mm_set1_epi8(sign))
}

/// A buffer of at most sixteen edges that are silhouettes in some texel row.
#[derive(Default)]
#[repr(align(64))]
struct SilhouetteBuffer {
    vertices: [[u32; 2]; LANES],
    rows: [u32; LANES],
    /// The facings of the two triangles in each texel row, 16 bits per row.
    facings: [[u32; LANES / 2]; LANES],
    n: usize,
}

impl SilhouetteBuffer {
    /// Appends an edge, unless there is no texel row in which it is a silhouette.
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
    #[inline]
    fn push(&mut self, vertices: [u32; 2], rows: u16, one: __m128i, other: __m128i) {
        let n = self.n & (LANES - 1);
        self.vertices[n] = vertices;
        self.rows[n] = u32::from(rows);
        let halves = [_mm_unpacklo_epi8(one, other), _mm_unpackhi_epi8(one, other)];
        for (half, facings) in halves.iter().zip(self.facings[n].as_chunks_mut::<4>().0) {
            // SAFETY: both are 16 bytes, of which every value is valid.
            *facings = unsafe { transmute::<__m128i, [u32; 4]>(*half) };
        }
        self.n += usize::from(rows != 0);
    }

    /// Appends each edge to the lists of its texel rows.
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
    #[inline]
    fn flush(&mut self, n_rows: usize, lists: &mut [SilhouetteList; LANES]) {
        let alive = ((1_u32 << self.n) - 1) as u16;
        let vertices = load_pairs(&self.vertices);
        let rows = unsigned(&self.rows);
        for (pair, lists) in lists[..n_rows].chunks_mut(2).enumerate() {
            let facings: [u32; LANES] = std::array::from_fn(|edge| self.facings[edge][pair]);
            let facings = unsigned(&facings);
            let of_row = [
                _mm512_and_si512(facings, _mm512_set1_epi32(0xffff)),
                _mm512_srli_epi32::<16>(facings),
            ];
            for ((row, list), facings) in (2 * pair..).zip(lists).zip(of_row) {
                let bit = _mm512_set1_epi32(1 << row);
                let selected = _mm512_mask_test_epi32_mask(alive, rows, bit);
                append_pairs(selected, vertices, &mut list.vertices);
                append_facings(selected, facings, &mut list.facings);
            }
        }
        self.n = 0;
    }
}
