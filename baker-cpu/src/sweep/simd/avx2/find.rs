//! Silhouettes, all texel rows of an edge at a time: the SIMD version of
//! [`silhouettes::find`](crate::sweep::simd::portable::silhouettes::find).

#![allow(
    unsafe_code,
    reason = "callers hold an `Avx2`, which proves that the CPU has these instructions"
)]

use std::arch::x86_64::*;
use std::mem::transmute;

use aogrid_bake_core::sweep::LANES;

use super::{PREFETCH_DISTANCE, prefetch};
use crate::sweep::data::{EdgeFacing, SilhouetteSearch, TriangleFacing};

/// Searches as [`silhouettes::find`](crate::sweep::simd::portable::silhouettes::find).
#[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
#[inline]
pub(super) fn find(search: SilhouetteSearch<'_>) {
    let rows = u16::MAX >> (LANES - search.n_rows);
    for (idx, edge) in search.edges.iter().enumerate() {
        if let Some(later) = search.edges.get(idx + PREFETCH_DISTANCE) {
            prefetch(&search.facings[later.sides[0].triangle()]);
            prefetch(&search.facings[later.sides[1].triangle()]);
        }
        let [(one, one_reversed), (other, other_reversed)] = search.facings_of(edge);
        let (one, other) = (oriented(one, one_reversed), oriented(other, other_reversed));
        let differ = _mm_xor_si128(one, other);
        // One half-edge runs along the edge and the other against it: they cancel where they are
        // equal.
        let cancels = _mm_cmpeq_epi8(differ, _mm_set1_epi8(i8::MIN));
        let mut rows_left = rows & !(_mm_movemask_epi8(cancels) as u16);
        if rows_left == 0 {
            continue;
        }
        let facings = [
            facings(_mm_unpacklo_epi8(one, other)),
            facings(_mm_unpackhi_epi8(one, other)),
        ];
        let facings: &[EdgeFacing] = facings.as_flattened();
        while rows_left != 0 {
            let row = rows_left.trailing_zeros() as usize & (LANES - 1);
            rows_left &= rows_left - 1;
            let list = &mut search.lists[row];
            list.vertices.push(edge.vertices);
            list.facings.push(facings[row]);
        }
    }
}

/// Computes `FacingInterval::oriented` of sixteen facings.
#[target_feature(enable = "avx2")]
#[inline]
fn oriented(facings: &TriangleFacing, reversed: bool) -> __m128i {
    // SAFETY: both are 16 bytes, of which every value is valid.
    let facings = unsafe { transmute::<TriangleFacing, __m128i>(*facings) };
    let sign = if reversed { i8::MIN } else { 0 };
    _mm_xor_si128(facings, _mm_set1_epi8(sign))
}

#[target_feature(enable = "avx2")]
#[inline]
fn facings(pairs: __m128i) -> [EdgeFacing; LANES / 2] {
    // SAFETY: both are 16 bytes, of which every value is valid.
    unsafe { transmute::<__m128i, [EdgeFacing; LANES / 2]>(pairs) }
}
