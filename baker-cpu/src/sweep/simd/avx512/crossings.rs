//! Crossings of sixteen edges at a time: the SIMD version of
//! [`count`](crate::sweep::simd::portable::crossings::count).

#![allow(
    unsafe_code,
    reason = "callers hold an `Avx512`, which proves that the CPU has these instructions"
)]

use std::arch::x86_64::*;

use aogrid_bake_core::sweep::LANES;

use super::{
    LaneArray, Table, UP, array, floats, int_array, ints, lane_deltas, load_facings, q, store,
    unsigned,
};
use crate::sweep::data::{
    Batch, COLUMN, Delta, DeltaBuffer, EdgeBuffer, FRACTION_BITS, FRACTIONS, Layout, Levels,
    MAX_COLUMN_ERROR,
};
use crate::sweep::simd::avx2::{PREFETCH_DISTANCE, prefetch_positions};

/// The tables of [`Batch::levels`], in registers.
struct LevelTables {
    fractions: Table,
    k: Table,
    first_row: Table,
    first_j: Table,
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
pub(super) fn count(batch: &Batch<'_>, edges: &EdgeBuffer, unit: i8, deltas: &mut DeltaBuffer) {
    let tables = LevelTables {
        fractions: Table::floats(&batch.levels.fractions),
        k: Table::floats(&batch.levels.k),
        first_row: Table::ints(&batch.levels.first_row),
        first_j: Table::ints(&batch.levels.first_j),
    };
    for first in (0..edges.n).step_by(LANES) {
        let alive = u16::MAX >> (LANES - (edges.n - first).min(LANES));
        prefetch_positions(batch, edges, (first + PREFETCH_DISTANCE, LANES));
        let lines = Lines::new(batch, edges, first, alive);
        for (block, slopes) in batch.slopes.iter().enumerate() {
            let lanes = lines.lane_deltas(batch, edges, first, block);
            let crossings = Crossings {
                batch,
                edges,
                first,
                lines: &lines,
                lanes: &lanes,
                block: block as i32,
                slopes: floats(slopes),
                signed_deltas: [lane_deltas(unit), lane_deltas(-unit)],
            };
            crossings.count(batch.levels, &tables, deltas);
        }
    }
}

/// Sixteen [ends](crate::sweep::data::End) of edges.
struct End {
    rank: __m512i,
    u: __m512,
    v: __m512,
    w: __m512,
}

impl End {
    /// Returns [`Batch::end`] of sixteen edges.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn new(
        batch: &Batch<'_>,
        edges: &EdgeBuffer,
        end: usize,
        first: usize,
        alive: __mmask16,
    ) -> Self {
        let vertices = unsigned(lanes_at(&edges.vertices[end], first));
        let positions = batch.positions.as_flattened();
        let first_of = _mm512_add_epi32(vertices, _mm512_slli_epi32::<1>(vertices));
        let coordinate = |axis: usize| {
            let coordinates = positions[axis..].as_ptr();
            // SAFETY: every vertex of an edge has a position of three floats; three times its index
            // fits a lane (`MAX_VERTICES`).
            unsafe {
                let zero = _mm512_setzero_ps();
                _mm512_mask_i32gather_ps::<4>(zero, alive, first_of, coordinates.cast())
            }
        };
        Self {
            rank: ints(lanes_at(&edges.ranks[end], first)),
            u: coordinate(batch.frame.axes[0]),
            v: coordinate(batch.frame.axes[1]),
            w: coordinate(batch.frame.axes[2]),
        }
    }
}

/// Sixteen [lines](crate::sweep::data::Line).
struct Lines {
    u: __m512,
    w: __m512,
    q: __m512,
    u_per_level: __m512,
    w_per_level: __m512,
    column_error: __m512,
    /// The number of the first level, and one above that of the last.
    levels: [__m512i; 2],
    up: __mmask16,
    alive: __mmask16,
}

/// The [`LaneDeltas`](crate::sweep::data::LaneDeltas) of sixteen edges in one block.
struct EdgeDeltas {
    active: LaneArray<u32>,
    negative: LaneArray<u32>,
    any: __mmask16,
}

#[inline(always)]
fn lanes_at<T, const N: usize>(values: &[T; N], first: usize) -> &[T; LANES] {
    values[first..]
        .first_chunk()
        .expect("the capacity is a multiple of sixteen")
}

impl Lines {
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn new(batch: &Batch<'_>, edges: &EdgeBuffer, first: usize, alive: __mmask16) -> Self {
        let levels = batch.levels;
        let from = End::new(batch, edges, 0, first, alive);
        let to = End::new(batch, edges, 1, first, alive);
        let q_from = q(levels, from.v, from.w);
        let between = _mm512_sub_ps(q(levels, to.v, to.w), q_from);
        let inverse = _mm512_div_ps(_mm512_set1_ps(1.0), between);
        let [low, high] = [
            _mm512_set1_epi32(levels.range[0]),
            _mm512_set1_epi32(levels.range[1]),
        ];
        let low = _mm512_max_epi32(_mm512_min_epi32(from.rank, to.rank), low);
        let high = _mm512_min_epi32(_mm512_max_epi32(from.rank, to.rank), high);
        let u_per_level = _mm512_mul_ps(_mm512_sub_ps(to.u, from.u), inverse);
        let w_per_level = _mm512_mul_ps(_mm512_sub_ps(to.w, from.w), inverse);
        let changes = _mm512_add_ps(_mm512_abs_ps(u_per_level), _mm512_abs_ps(w_per_level));
        let changes = _mm512_add_ps(_mm512_set1_ps(1.0), changes);
        let column_error = _mm512_mul_ps(_mm512_set1_ps(batch.rounding()), changes);
        Self {
            u: from.u,
            w: from.w,
            q: q_from,
            u_per_level,
            w_per_level,
            column_error: _mm512_min_ps(column_error, _mm512_set1_ps(MAX_COLUMN_ERROR)),
            levels: [low, high],
            up: _mm512_cmplt_epi32_mask(from.rank, to.rank),
            alive: _mm512_mask_cmplt_epi32_mask(alive, low, high),
        }
    }

    /// Computes `LaneDeltas::new` of sixteen edges.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn lane_deltas(
        &self,
        batch: &Batch<'_>,
        edges: &EdgeBuffer,
        first: usize,
        block: usize,
    ) -> EdgeDeltas {
        let facings = load_facings(lanes_at(&edges.facings, first));
        let one = front_lanes(facings, block);
        let other = front_lanes(_mm512_srli_epi32::<8>(facings), block);
        let lanes = _mm512_set1_epi32(i32::from(batch.frame.lanes(block)));
        let active = _mm512_andnot_si512(_mm512_xor_si512(one, other), lanes);
        let all = _mm512_set1_epi32(-1);
        let negative = _mm512_mask_xor_epi32(one, !self.up, one, all);
        EdgeDeltas {
            active: int_array(active),
            negative: int_array(negative),
            any: _mm512_test_epi32_mask(active, active),
        }
    }
}

/// Computes `FacingInterval::front_lanes` of sixteen facings.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn front_lanes(facings: __m512i, block: usize) -> __m512i {
    let front_first = _mm512_test_epi32_mask(facings, _mm512_set1_epi32(0x80));
    let flip_texel = _mm512_and_si512(facings, _mm512_set1_epi32(0x7f));
    let flip_texel = _mm512_sub_epi32(flip_texel, _mm512_set1_epi32((block * LANES) as i32));
    let flip_texel = _mm512_max_epi32(flip_texel, _mm512_setzero_si512());
    let flip_texel = _mm512_min_epi32(flip_texel, _mm512_set1_epi32(LANES as i32));
    let second = _mm512_sllv_epi32(_mm512_set1_epi32(0xffff), flip_texel);
    _mm512_mask_xor_epi32(second, front_first, second, _mm512_set1_epi32(-1))
}

/// One of sixteen edges at its level.
struct Crossing {
    edge: usize,
    /// u minus and plus its error bound: where both give the same column, it is certain.
    u_low: f32,
    u_high: f32,
    height: f32,
    /// The group of its deltas, and the slot of the first column.
    group: usize,
    first: Delta,
}

/// The inputs for counting sixteen edges in one block.
struct Crossings<'a> {
    batch: &'a Batch<'a>,
    edges: &'a EdgeBuffer,
    /// The first of the sixteen.
    first: usize,
    lines: &'a Lines,
    lanes: &'a EdgeDeltas,
    block: i32,
    slopes: __m512,
    /// The part of each lane's delta besides its column: layers more, or fewer.
    signed_deltas: [__m512i; 2],
}

impl Crossings<'_> {
    /// Steps all edges from level to level in parallel, until the longest has reached its last.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn count(&self, levels: &Levels, tables: &LevelTables, deltas: &mut DeltaBuffer) {
        let lines = self.lines;
        let [mut level, end] = lines.levels;
        let mut alive = lines.alive & self.lanes.any;
        let last_fraction = _mm512_set1_epi32(levels.n as i32 - 1);
        let to_next_whole = _mm512_set1_epi32((FRACTIONS - levels.n) as i32);
        let fraction_bits = _mm512_set1_epi32(FRACTIONS as i32 - 1);
        let width = _mm512_set1_epi32(levels.width as i32);
        while alive != 0 {
            let s = _mm512_and_si512(level, fraction_bits);
            let whole = _mm512_srai_epi32::<FRACTION_BITS>(level);
            let j = _mm512_add_epi32(whole, tables.first_j.int(s));
            let inside = _mm512_mask_cmplt_epu32_mask(alive, j, width);
            if inside != 0 {
                self.count_level(inside, whole, s, tables, deltas);
            }
            // Level numbers skip the unused fractions at the end of each whole part.
            let is_last = _mm512_cmpeq_epi32_mask(s, last_fraction);
            level = _mm512_add_epi32(level, _mm512_set1_epi32(1));
            level = _mm512_mask_add_epi32(level, is_last, level, to_next_whole);
            alive = _mm512_mask_cmplt_epi32_mask(alive, level, end);
        }
    }

    /// Counts each edge at its level: computes `Line::at` for all, then the deltas of one after the
    /// other.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn count_level(
        &self,
        inside: __mmask16,
        whole: __m512i,
        s: __m512i,
        tables: &LevelTables,
        deltas: &mut DeltaBuffer,
    ) {
        let lines = self.lines;
        let value = _mm512_add_ps(_mm512_cvtepi32_ps(whole), tables.fractions.float(s));
        let t = _mm512_sub_ps(value, lines.q);
        let u = _mm512_add_ps(lines.u, _mm512_mul_ps(t, lines.u_per_level));
        let w = _mm512_add_ps(lines.w, _mm512_mul_ps(t, lines.w_per_level));
        let height = _mm512_sub_ps(w, tables.k.float(s));
        let row = _mm512_add_epi32(whole, tables.first_row.int(s));
        let (groups, first) = self.first_slots(deltas, row, height);
        let u_low = array(_mm512_sub_ps(u, lines.column_error));
        let u_high = array(_mm512_add_ps(u, lines.column_error));
        let (height, groups, first) = (array(height), int_array(groups), int_array(first));
        let mut remaining = inside;
        while remaining != 0 {
            let edge = remaining.trailing_zeros() as usize & (LANES - 1);
            remaining &= remaining - 1;
            let lanes = [
                self.lanes.active.0[edge] as u16,
                self.lanes.negative.0[edge] as u16,
            ];
            let crossing = Crossing {
                edge,
                u_low: u_low.0[edge],
                u_high: u_high.0[edge],
                height: height.0[edge],
                group: groups.0[edge] as usize,
                first: first.0[edge],
            };
            self.count_edge(crossing, lanes, deltas);
        }
    }

    /// Returns the group, and the slot of the first column on the side of the crossing.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn first_slots(
        &self,
        deltas: &DeltaBuffer,
        row: __m512i,
        height: __m512,
    ) -> (__m512i, __m512i) {
        let layout = deltas.layout;
        let strip = _mm512_mullo_epi32(row, _mm512_set1_epi32(layout.blocks as i32));
        let strip = _mm512_add_epi32(strip, _mm512_set1_epi32(self.block));
        let group = _mm512_srl_epi32(strip, _mm_cvtsi32_si128(layout.shift as i32));
        let within = _mm512_set1_epi32((1 << layout.shift) - 1);
        let within = _mm512_and_si512(strip, within);
        let first = _mm512_mullo_epi32(within, _mm512_set1_epi32(layout.strip() as i32));
        let below = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(height, _mm512_setzero_ps());
        let second_side = _mm512_set1_epi32(LANES as i32);
        (
            group,
            _mm512_mask_add_epi32(first, below, first, second_side),
        )
    }

    /// Computes `first_columns` and [`DeltaBuffer::push`] of one edge.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn count_edge(
        &self,
        crossing: Crossing,
        [lanes, negative]: [u16; 2],
        deltas: &mut DeltaBuffer,
    ) {
        let away = _mm512_mul_ps(_mm512_set1_ps(crossing.height), self.slopes);
        let mut column = first_columns(crossing.u_low, away);
        let last = first_columns(crossing.u_high, away);
        let n_u = _mm512_set1_epi32(deltas.layout.n_u as i32);
        let mut in_grid = _mm512_mask_cmplt_epi32_mask(lanes, column, n_u);
        let uncertain = _mm512_mask_cmpneq_epi32_mask(in_grid, column, last);
        if uncertain != 0 {
            let slot = (crossing.group, crossing.first);
            column = self.exact_columns(crossing.edge, slot, uncertain, column, deltas.layout);
            in_grid = _mm512_mask_cmplt_epi32_mask(lanes, column, n_u);
        }
        let slot = _mm512_slli_epi32::<{ COLUMN.ilog2() }>(column);
        let slot = _mm512_add_epi32(slot, _mm512_set1_epi32(crossing.first.cast_signed()));
        let sign = _mm512_mask_mov_epi32(self.signed_deltas[0], negative, self.signed_deltas[1]);
        let delta = _mm512_add_epi32(slot, sign);
        store(
            _mm512_maskz_compress_epi32(in_grid, delta),
            deltas.reserve(crossing.group),
        );
        deltas.commit(crossing.group, in_grid.count_ones());
    }

    /// Computes the columns of some lanes again, by [`Batch::exact_column`].
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[cold]
    fn exact_columns(
        &self,
        edge: usize,
        (group, first): (usize, Delta),
        lanes: u16,
        columns: __m512i,
        layout: Layout,
    ) -> __m512i {
        let mut columns = int_array(columns);
        let vertices = self.edges.vertices.map(|all| all[self.first + edge]);
        let strip = (group << layout.shift) + first as usize / layout.strip();
        let row = strip as u32 / layout.blocks;
        for lane in (0..LANES).filter(|lane| lanes >> lane & 1 != 0) {
            let z = (self.block as usize * LANES + lane) as u32;
            columns.0[lane] = self.batch.exact_column(vertices, row, z);
        }
        unsigned(&columns.0)
    }
}

/// Computes [`first_columns`](crate::sweep::data::first_columns), without the upper clamp at
/// the row's end.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn first_columns(u: f32, away: __m512) -> __m512i {
    let crossings = _mm512_sub_ps(_mm512_set1_ps(u), away);
    _mm512_max_epi32(
        _mm512_cvt_roundps_epi32::<UP>(crossings),
        _mm512_setzero_si512(),
    )
}
