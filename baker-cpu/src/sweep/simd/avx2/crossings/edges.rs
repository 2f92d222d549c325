//! Eight edges as seen by one batch: their lines, and the directions of which they are silhouettes.

use std::arch::x86_64::*;

use aogrid_bake_core::sweep;

use super::listed;
use crate::sweep::data::{Batch, EdgeBuffer, MAX_COLUMN_ERROR};
use crate::sweep::simd::avx2::{LANES, four_floats, ints, lane_bits, q, unsigned};

/// Eight [ends](crate::sweep::data::End) of edges.
struct End {
    rank: __m256i,
    u: __m256,
    v: __m256,
    w: __m256,
}

/// Returns the numbers of eight records, number by number.
#[target_feature(enable = "avx2")]
#[inline]
pub(super) fn transposed(records: [__m128i; LANES]) -> [__m256i; 4] {
    let [a, b, c, d, e, f, g, h] = records;
    let r0 = _mm256_castsi256_ps(_mm256_set_m128i(e, a));
    let r1 = _mm256_castsi256_ps(_mm256_set_m128i(f, b));
    let r2 = _mm256_castsi256_ps(_mm256_set_m128i(g, c));
    let r3 = _mm256_castsi256_ps(_mm256_set_m128i(h, d));
    let (low01, high01) = (_mm256_unpacklo_ps(r0, r1), _mm256_unpackhi_ps(r0, r1));
    let (low23, high23) = (_mm256_unpacklo_ps(r2, r3), _mm256_unpackhi_ps(r2, r3));
    [
        _mm256_castps_si256(_mm256_shuffle_ps::<0x44>(low01, low23)),
        _mm256_castps_si256(_mm256_shuffle_ps::<0xee>(low01, low23)),
        _mm256_castps_si256(_mm256_shuffle_ps::<0x44>(high01, high23)),
        _mm256_castps_si256(_mm256_shuffle_ps::<0xee>(high01, high23)),
    ]
}

/// Returns the index of each of eight edges; behind the last edge, that of the last.
#[inline(always)]
fn edge(edges: &EdgeBuffer, first: usize, lane: usize) -> usize {
    (first + lane).min(edges.n - 1)
}

impl End {
    /// Returns [`Batch::end`] of eight edges.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn new(batch: &Batch<'_>, edges: &EdgeBuffer, end: usize, first: usize) -> Self {
        let positions = batch.positions.as_flattened();
        let mut records = [_mm_setzero_si128(); LANES];
        for (lane, record) in records.iter_mut().enumerate() {
            let vertex = edges.vertices[end][edge(edges, first, lane)];
            let coordinates = positions[3 * vertex as usize..].first_chunk();
            // The fourth number belongs to the next vertex; one more follows the last.
            *record = four_floats(coordinates.expect("a position follows that of each vertex"));
        }
        let coordinates = transposed(records);
        let [u, v, w] = batch.frame.axes;
        Self {
            rank: ints(lanes_at(&edges.ranks[end], first)),
            u: _mm256_castsi256_ps(coordinates[u]),
            v: _mm256_castsi256_ps(coordinates[v]),
            w: _mm256_castsi256_ps(coordinates[w]),
        }
    }
}

#[inline(always)]
fn lanes_at<T, const N: usize>(values: &[T; N], first: usize) -> &[T; LANES] {
    let lanes = values[first..].first_chunk();
    lanes.expect("the capacity is a multiple of eight")
}

/// Eight [lines](crate::sweep::data::Line).
pub(super) struct Lines {
    pub u: __m256,
    pub w: __m256,
    pub q: __m256,
    pub u_per_level: __m256,
    pub w_per_level: __m256,
    pub column_error: __m256,
    /// The number of the first level, and one above that of the last: no more than the first for
    /// lanes behind the last edge.
    pub level: __m256i,
    pub end: __m256i,
    /// Set for edges that go up.
    up: __m256i,
}

impl Lines {
    #[target_feature(enable = "avx2")]
    #[inline]
    pub(super) fn new(batch: &Batch<'_>, edges: &EdgeBuffer, first: usize) -> Self {
        let levels = batch.levels;
        let from = End::new(batch, edges, 0, first);
        let to = End::new(batch, edges, 1, first);
        let q_from = q(levels, from.v, from.w);
        let between = _mm256_sub_ps(q(levels, to.v, to.w), q_from);
        let inverse = _mm256_div_ps(_mm256_set1_ps(1.0), between);
        let u_per_level = _mm256_mul_ps(_mm256_sub_ps(to.u, from.u), inverse);
        let w_per_level = _mm256_mul_ps(_mm256_sub_ps(to.w, from.w), inverse);
        let sign = _mm256_set1_ps(-0.0);
        let changes = _mm256_add_ps(
            _mm256_andnot_ps(sign, u_per_level),
            _mm256_andnot_ps(sign, w_per_level),
        );
        let changes = _mm256_add_ps(_mm256_set1_ps(1.0), changes);
        let column_error = _mm256_mul_ps(_mm256_set1_ps(batch.rounding()), changes);
        let low = _mm256_min_epi32(from.rank, to.rank);
        let high = _mm256_max_epi32(from.rank, to.rank);
        let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
        let n = _mm256_set1_epi32((edges.n - first) as i32);
        let is_edge = _mm256_cmpgt_epi32(n, lanes);
        let end = _mm256_min_epi32(high, _mm256_set1_epi32(levels.range[1]));
        Self {
            u: from.u,
            w: from.w,
            q: q_from,
            u_per_level,
            w_per_level,
            column_error: _mm256_min_ps(column_error, _mm256_set1_ps(MAX_COLUMN_ERROR)),
            level: _mm256_max_epi32(low, _mm256_set1_epi32(levels.range[0])),
            end: _mm256_blendv_epi8(_mm256_set1_epi32(i32::MIN), end, is_edge),
            up: _mm256_cmpgt_epi32(to.rank, from.rank),
        }
    }
}

/// The [`LaneDeltas`](crate::sweep::data::LaneDeltas) of eight edges in one block, and the part of
/// them that is taken at a time: up to eight neighboring lanes of one sign.
pub(super) struct Directions {
    active: __m256i,
    negative: __m256i,
    /// A bit for each edge that has lanes in the present part.
    pub taken: u32,
}

impl Directions {
    /// Computes `LaneDeltas::new` of eight edges.
    #[target_feature(enable = "avx2")]
    #[inline]
    pub(super) fn new(
        lines: &Lines,
        batch: &Batch<'_>,
        edges: &EdgeBuffer,
        first: usize,
        block: usize,
    ) -> Self {
        let facings = lanes_at(&edges.facings, first).map(|facing| facing.bits().into());
        let facings = unsigned(&facings);
        let one = front_lanes(facings, block);
        let other = front_lanes(_mm256_srli_epi32::<8>(facings), block);
        let lanes = _mm256_set1_epi32(i32::from(batch.frame.lanes(block)));
        let active = _mm256_andnot_si256(_mm256_xor_si256(one, other), lanes);
        let down = _mm256_andnot_si256(lines.up, _mm256_set1_epi32(-1));
        let mut all = Self {
            active,
            negative: _mm256_xor_si256(one, down),
            taken: 0,
        };
        all.advance();
        all
    }

    /// Returns whether lanes are left, and those of which edges.
    #[target_feature(enable = "avx2")]
    #[inline]
    pub(super) fn advance(&mut self) -> bool {
        let none = _mm256_cmpeq_epi32(self.active, _mm256_setzero_si256());
        self.taken = !lane_bits(none) & 0xff;
        self.taken != 0
    }

    /// Takes the next lanes of each edge: from its lowest active lane on, those of the same sign.
    /// Returns their [words](listed::word), without the group.
    #[target_feature(enable = "avx2")]
    #[inline]
    pub(super) fn take_runs(&mut self, first: usize) -> __m256i {
        let zero = _mm256_setzero_si256();
        let lowest = _mm256_and_si256(self.active, _mm256_sub_epi32(zero, self.active));
        // The exponent of a power of two is the number of its bit.
        let exponent = _mm256_srli_epi32::<23>(_mm256_castps_si256(_mm256_cvtepi32_ps(lowest)));
        let start = _mm256_sub_epi32(exponent, _mm256_set1_epi32(127));
        // Edges without lanes start at lane 0.
        let start = _mm256_max_epi32(start, zero);
        let is_positive = _mm256_cmpeq_epi32(_mm256_and_si256(lowest, self.negative), zero);
        let of_sign = _mm256_xor_si256(self.negative, is_positive);
        let same = _mm256_and_si256(self.active, of_sign);
        let run = _mm256_and_si256(_mm256_srlv_epi32(same, start), _mm256_set1_epi32(0xff));
        self.active = _mm256_andnot_si256(_mm256_sllv_epi32(run, start), self.active);
        let negative = _mm256_add_epi32(is_positive, _mm256_set1_epi32(1));
        listed::word(first, start, run, negative)
    }
}

/// Computes `FacingInterval::front_lanes` of eight facings.
#[target_feature(enable = "avx2")]
#[inline]
fn front_lanes(facings: __m256i, block: usize) -> __m256i {
    let front_bit = _mm256_set1_epi32(0x80);
    let front_first = _mm256_cmpeq_epi32(_mm256_and_si256(facings, front_bit), front_bit);
    let flip_texel = _mm256_and_si256(facings, _mm256_set1_epi32(0x7f));
    let before = _mm256_set1_epi32((block * sweep::LANES) as i32);
    let flip_texel = _mm256_sub_epi32(flip_texel, before);
    let flip_texel = _mm256_max_epi32(flip_texel, _mm256_setzero_si256());
    let flip_texel = _mm256_min_epi32(flip_texel, _mm256_set1_epi32(sweep::LANES as i32));
    let second = _mm256_sllv_epi32(_mm256_set1_epi32(0xffff), flip_texel);
    _mm256_xor_si256(second, front_first)
}
