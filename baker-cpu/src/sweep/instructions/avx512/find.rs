//! Silhouettes of sixteen edges at a time: the twin of [`Find::run_portable`].

#![allow(
    unsafe_code,
    reason = "the functions are for a machine whose instructions `Avx512` is the proof of"
)]

use std::arch::x86_64::*;

use super::{append_pairs, append_sides, fetch, load_pairs, unsigned};
use crate::sweep::frame::LANES;
use crate::sweep::silhouettes::{Facings, Find, List};

/// [`Find::run_portable`]: silhouettes are gathered until there are sixteen, and then shared
/// out to the lists of all rows.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
pub(super) fn find(find: Find<'_>) {
    let rows = u16::MAX >> (LANES - find.n_rows);
    let mut some = Gathered::default();
    for (idx, edge) in find.edges.iter().enumerate() {
        if let Some(later) = find.edges.get(idx + AHEAD) {
            for side in later.sides {
                fetch(&find.facings[side.triangle()]);
            }
        }
        let [one, other] = find.sides(edge);
        let [one, other] = [along(one.0, one.1), along(other.0, other.1)];
        let differ = _mm_xor_si128(one, other);
        // The one along the edge and the other against it: they cancel where they are equal.
        let odd = rows & !_mm_cmpeq_epi8_mask(differ, _mm_set1_epi8(i8::MIN));
        some.put(edge.vertices, odd, one, other);
        if some.n == LANES {
            some.share_out(find.n_rows, find.lists);
        }
    }
    some.share_out(find.n_rows, find.lists);
}

/// Edges whose facings are fetched while others are looked at: memory takes that long.
const AHEAD: usize = 24;

/// `Facing::along` of sixteen facings.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
fn along(facings: &Facings, reversed: bool) -> __m128i {
    // SAFETY: a facing is a byte, of which every value is one; sixteen need not be aligned.
    let facings = unsafe { _mm_loadu_si128(facings.as_ptr().cast()) };
    let sign = if reversed { i8::MIN } else { 0 };
    _mm_xor_si128(facings, _mm_set1_epi8(sign))
}

/// Up to sixteen edges that are silhouettes in some row.
#[derive(Default)]
#[repr(align(64))]
struct Gathered {
    vertices: [[u32; 2]; LANES],
    rows: [u32; LANES],
    /// The facings of the two triangles in each row: a number of 16 bits for each.
    sides: [[u32; LANES / 2]; LANES],
    n: usize,
}

impl Gathered {
    /// Adds an edge, unless there is no row in which it is a silhouette.
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
    #[inline]
    fn put(&mut self, vertices: [u32; 2], rows: u16, one: __m128i, other: __m128i) {
        let n = self.n & (LANES - 1);
        self.vertices[n] = vertices;
        self.rows[n] = u32::from(rows);
        let halves = [_mm_unpacklo_epi8(one, other), _mm_unpackhi_epi8(one, other)];
        for (half, sides) in halves.iter().zip(self.sides[n].as_chunks_mut::<4>().0) {
            // SAFETY: four numbers are 16 bytes; they need not be aligned.
            unsafe { _mm_storeu_si128(sides.as_mut_ptr().cast(), *half) }
        }
        self.n += usize::from(rows != 0);
    }

    /// Adds each edge to the lists of its rows.
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
    #[inline]
    fn share_out(&mut self, n_rows: usize, lists: &mut [List; LANES]) {
        let alive = ((1_u32 << self.n) - 1) as u16;
        let vertices = load_pairs(&self.vertices);
        let rows = unsigned(&self.rows);
        for (pair, lists) in lists[..n_rows].chunks_mut(2).enumerate() {
            let sides: [u32; LANES] = std::array::from_fn(|edge| self.sides[edge][pair]);
            let sides = unsigned(&sides);
            let of_row = [
                _mm512_and_si512(sides, _mm512_set1_epi32(0xffff)),
                _mm512_srli_epi32::<16>(sides),
            ];
            for ((row, list), sides) in (2 * pair..).zip(lists).zip(of_row) {
                let bit = _mm512_set1_epi32(1 << row);
                let chosen = _mm512_mask_test_epi32_mask(alive, rows, bit);
                append_pairs(chosen, vertices, &mut list.vertices);
                append_sides(chosen, sides, &mut list.sides);
            }
        }
        self.n = 0;
    }
}
