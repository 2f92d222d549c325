//! Ranks of eight vertices at a time.

use std::arch::x86_64::*;

use super::{LANES, floats, int_array, q};
use crate::sweep::data::{FRACTION_BITS, FRACTIONS, Levels};

/// The number of parts that a table of fractions has: the entries that one instruction selects from.
const PARTS: usize = 4;

/// The number of fractions of a part.
const PART: usize = FRACTIONS / PARTS;

/// A table of fractions, in parts: the last fraction of the first three parts, and the n-th fraction of
/// every part.
struct Fractions {
    last: [__m256; PARTS - 1],
    nth: [__m256; PART],
}

impl Fractions {
    #[target_feature(enable = "avx2")]
    #[inline]
    fn new(fractions: &[f32; FRACTIONS]) -> Self {
        let mut table = Self {
            last: [_mm256_setzero_ps(); PARTS - 1],
            nth: [_mm256_setzero_ps(); PART],
        };
        for (part, last) in table.last.iter_mut().enumerate() {
            *last = _mm256_set1_ps(fractions[part * PART + PART - 1]);
        }
        for (n, of_parts) in table.nth.iter_mut().enumerate() {
            let [a, b, c, d] = [0, 1, 2, 3].map(|part| fractions[part * PART + n]);
            *of_parts = _mm256_setr_ps(a, b, c, d, a, b, c, d);
        }
        table
    }

    /// Returns the number of fractions below each of eight numbers: those of the parts that are wholly
    /// below, and those of the next part.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn below(&self, x: __m256) -> __m256i {
        let mut part = _mm256_setzero_si256();
        for &last in &self.last {
            part = count_if_below(part, last, x);
        }
        let mut below = _mm256_slli_epi32::<{ PART.ilog2() as i32 }>(part);
        for &of_parts in &self.nth {
            below = count_if_below(below, _mm256_permutevar_ps(of_parts, part), x);
        }
        below
    }
}

/// Adds one to a count where `fraction` < `x`.
#[target_feature(enable = "avx2")]
#[inline]
fn count_if_below(count: __m256i, fraction: __m256, x: __m256) -> __m256i {
    let is_below = _mm256_cmp_ps::<_CMP_LT_OQ>(fraction, x);
    // A mask is −1.
    _mm256_sub_epi32(count, _mm256_castps_si256(is_below))
}

#[target_feature(enable = "avx2")]
#[inline]
pub(super) fn fill_ranks(levels: &Levels, v: &[f32], w: &[f32], ranks: &mut [i32]) {
    let fractions = Fractions::new(&levels.fractions);
    let (v, last_v) = v.as_chunks::<LANES>();
    let (w, last_w) = w.as_chunks::<LANES>();
    let (ranks, last) = ranks.as_chunks_mut::<LANES>();
    for (ranks, (v, w)) in ranks.iter_mut().zip(v.iter().zip(w)) {
        let q = q(levels, floats(v), floats(w));
        *ranks = int_array(rank(levels, &fractions, q));
    }
    for (rank, (&v, &w)) in last.iter_mut().zip(last_v.iter().zip(last_w)) {
        *rank = levels.rank(v, w);
    }
}

/// Computes [`Levels::rank`].
#[target_feature(enable = "avx2")]
#[inline]
fn rank(levels: &Levels, fractions: &Fractions, q: __m256) -> __m256i {
    let whole = _mm256_floor_ps(q);
    let below = fractions.below(_mm256_sub_ps(q, whole));
    let all = _mm256_cmpeq_epi32(below, _mm256_set1_epi32(levels.n as i32));
    let below = _mm256_blendv_epi8(below, _mm256_set1_epi32(FRACTIONS as i32), all);
    let whole = _mm256_slli_epi32::<{ FRACTION_BITS as i32 }>(_mm256_cvttps_epi32(whole));
    _mm256_add_epi32(whole, below)
}
