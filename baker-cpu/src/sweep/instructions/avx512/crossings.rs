//! Crossings of sixteen edges at a time: the twin of [`count`](crate::sweep::crossings::count).

#![allow(
    unsafe_code,
    reason = "the functions are for a machine whose instructions `Avx512` is the proof of"
)]

use std::arch::x86_64::*;

use super::{
    Array, Table, UP, array, floats, int_array, ints, lane_deltas, load_sides, q, store, unsigned,
};
use crate::sweep::counters::{COLUMN, Layout};
use crate::sweep::crossings::{Batch, Edges, FARTHEST};
use crate::sweep::frame::LANES;
use crate::sweep::levels::{FRACTION_BITS, FRACTIONS, Levels};
use crate::sweep::steps::{Step, Steps};

/// [`Batch::levels`] and the layout of its counters.
struct Tables {
    fractions: Table,
    k: Table,
    first_row: Table,
    first_j: Table,
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
pub(super) fn count(batch: &Batch<'_>, edges: &Edges, unit: i8, steps: &mut Steps) {
    let tables = Tables {
        fractions: Table::floats(&batch.levels.fractions),
        k: Table::floats(&batch.levels.k),
        first_row: Table::ints(&batch.levels.first_row),
        first_j: Table::ints(&batch.levels.first_j),
    };
    for first in (0..edges.n).step_by(LANES) {
        let alive = u16::MAX >> (LANES - (edges.n - first).min(LANES));
        let lines = Lines::new(batch, edges, first, alive);
        for (block, slopes) in batch.slopes.iter().enumerate() {
            let sides = lines.sides(batch, edges, first, block);
            let at = Crossings {
                batch,
                edges,
                first,
                lines: &lines,
                sides: &sides,
                block: block as i32,
                slopes: floats(slopes),
                deltas: [lane_deltas(unit), lane_deltas(-unit)],
            };
            at.count(batch.levels, &tables, steps);
        }
    }
}

/// Sixteen [ends](crate::sweep::crossings::End) of edges.
struct End {
    rank: __m512i,
    u: __m512,
    v: __m512,
    w: __m512,
}

impl End {
    /// [`Batch::end`] of sixteen edges.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn new(batch: &Batch<'_>, edges: &Edges, end: usize, first: usize, alive: __mmask16) -> Self {
        let vertices = unsigned(sixteen(&edges.vertices[end], first));
        let positions = batch.positions.as_flattened();
        let first_of = _mm512_add_epi32(vertices, _mm512_slli_epi32::<1>(vertices));
        let coordinate = |axis: usize| {
            let coordinates = positions[axis..].as_ptr();
            // SAFETY: edges are of vertices that have positions, three floats each; and they
            // are so few that three times their number fits (`MOST_VERTICES`).
            unsafe {
                let zero = _mm512_setzero_ps();
                _mm512_mask_i32gather_ps::<4>(zero, alive, first_of, coordinates.cast())
            }
        };
        Self {
            rank: ints(sixteen(&edges.ranks[end], first)),
            u: coordinate(batch.frame.u),
            v: coordinate(batch.frame.v),
            w: coordinate(batch.frame.w),
        }
    }
}

/// Sixteen [lines](crate::sweep::crossings::Line).
struct Lines {
    u: __m512,
    w: __m512,
    q: __m512,
    u_per_level: __m512,
    w_per_level: __m512,
    near: __m512,
    /// The first level's number, and one above the last's.
    levels: [__m512i; 2],
    up: __mmask16,
    alive: __mmask16,
}

/// The [lanes](crate::sweep::steps::Lanes) of sixteen edges in one block.
struct Sides {
    steps: Array<u32>,
    fewer: Array<u32>,
    some: __mmask16,
}

#[inline(always)]
fn sixteen<T, const N: usize>(of: &[T; N], first: usize) -> &[T; LANES] {
    of[first..].first_chunk().expect("edges come in sixteens")
}

impl Lines {
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn new(batch: &Batch<'_>, edges: &Edges, first: usize, alive: __mmask16) -> Self {
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
        let near = _mm512_mul_ps(_mm512_set1_ps(batch.rounding()), changes);
        Self {
            u: from.u,
            w: from.w,
            q: q_from,
            u_per_level,
            w_per_level,
            near: _mm512_min_ps(near, _mm512_set1_ps(FARTHEST)),
            levels: [low, high],
            up: _mm512_cmplt_epi32_mask(from.rank, to.rank),
            alive: _mm512_mask_cmplt_epi32_mask(alive, low, high),
        }
    }

    /// `Lanes::new` of sixteen edges.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn sides(&self, batch: &Batch<'_>, edges: &Edges, first: usize, block: usize) -> Sides {
        let sides = load_sides(sixteen(&edges.sides, first));
        let one = towards(sides, block);
        let other = towards(_mm512_srli_epi32::<8>(sides), block);
        let lanes = _mm512_set1_epi32(i32::from(batch.frame.lanes(block)));
        let steps = _mm512_andnot_si512(_mm512_xor_si512(one, other), lanes);
        let all = _mm512_set1_epi32(-1);
        let fewer = _mm512_mask_xor_epi32(one, !self.up, one, all);
        Sides {
            steps: int_array(steps),
            fewer: int_array(fewer),
            some: _mm512_test_epi32_mask(steps, steps),
        }
    }
}

/// `Facing::towards` of sixteen facings.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn towards(facings: __m512i, block: usize) -> __m512i {
    let first_towards = _mm512_test_epi32_mask(facings, _mm512_set1_epi32(0x80));
    let turn = _mm512_and_si512(facings, _mm512_set1_epi32(0x7f));
    let turn = _mm512_sub_epi32(turn, _mm512_set1_epi32((block * LANES) as i32));
    let turn = _mm512_max_epi32(turn, _mm512_setzero_si512());
    let turn = _mm512_min_epi32(turn, _mm512_set1_epi32(LANES as i32));
    let second = _mm512_sllv_epi32(_mm512_set1_epi32(0xffff), turn);
    _mm512_mask_xor_epi32(second, first_towards, second, _mm512_set1_epi32(-1))
}

/// One of sixteen edges at its level.
struct Crossing {
    edge: usize,
    /// u, a little less and a little more: where both say the same column, it is certain.
    less: f32,
    more: f32,
    height: f32,
    /// Where its steps are counted, from the first column on.
    group: usize,
    first: Step,
}

/// What is needed to count sixteen edges in one block.
struct Crossings<'a> {
    batch: &'a Batch<'a>,
    edges: &'a Edges,
    /// The first of the sixteen.
    first: usize,
    lines: &'a Lines,
    sides: &'a Sides,
    block: i32,
    slopes: __m512,
    /// What each lane adds to the place of its column: layers more, or fewer.
    deltas: [__m512i; 2],
}

impl Crossings<'_> {
    /// All edges go from level to level in step, until the longest has met its last.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn count(&self, levels: &Levels, tables: &Tables, steps: &mut Steps) {
        let lines = self.lines;
        let [mut level, end] = lines.levels;
        let mut alive = lines.alive & self.sides.some;
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
                self.step(inside, whole, s, tables, steps);
            }
            let is_last = _mm512_cmpeq_epi32_mask(s, last_fraction);
            level = _mm512_add_epi32(level, _mm512_set1_epi32(1));
            level = _mm512_mask_add_epi32(level, is_last, level, to_next_whole);
            alive = _mm512_mask_cmplt_epi32_mask(alive, level, end);
        }
    }

    /// Each edge at its level: `Line::at`, and then the steps of one after the other.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn step(
        &self,
        inside: __mmask16,
        whole: __m512i,
        s: __m512i,
        tables: &Tables,
        steps: &mut Steps,
    ) {
        let lines = self.lines;
        let value = _mm512_add_ps(_mm512_cvtepi32_ps(whole), tables.fractions.float(s));
        let t = _mm512_sub_ps(value, lines.q);
        let u = _mm512_add_ps(lines.u, _mm512_mul_ps(t, lines.u_per_level));
        let w = _mm512_add_ps(lines.w, _mm512_mul_ps(t, lines.w_per_level));
        let height = _mm512_sub_ps(w, tables.k.float(s));
        let row = _mm512_add_epi32(whole, tables.first_row.int(s));
        let (groups, first) = self.places(steps, row, height);
        let less = array(_mm512_sub_ps(u, lines.near));
        let more = array(_mm512_add_ps(u, lines.near));
        let (height, groups, first) = (array(height), int_array(groups), int_array(first));
        let mut left = inside;
        while left != 0 {
            let edge = left.trailing_zeros() as usize & (LANES - 1);
            left &= left - 1;
            let lanes = [
                self.sides.steps.0[edge] as u16,
                self.sides.fewer.0[edge] as u16,
            ];
            let crossing = Crossing {
                edge,
                less: less.0[edge],
                more: more.0[edge],
                height: height.0[edge],
                group: groups.0[edge] as usize,
                first: first.0[edge],
            };
            self.edge(crossing, lanes, steps);
        }
    }

    /// The group, and the place there of the first column on the side of the crossing.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn places(&self, steps: &Steps, row: __m512i, height: __m512) -> (__m512i, __m512i) {
        let layout = steps.layout;
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

    /// `first_columns`, and [`Steps::add`], of one edge.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn edge(&self, crossing: Crossing, [lanes, fewer]: [u16; 2], steps: &mut Steps) {
        let away = _mm512_mul_ps(_mm512_set1_ps(crossing.height), self.slopes);
        let mut column = first_columns(crossing.less, away);
        let last = first_columns(crossing.more, away);
        let n_u = _mm512_set1_epi32(steps.layout.n_u as i32);
        let mut in_grid = _mm512_mask_cmplt_epi32_mask(lanes, column, n_u);
        let near = _mm512_mask_cmpneq_epi32_mask(in_grid, column, last);
        if near != 0 {
            let place = (crossing.group, crossing.first);
            column = self.exact_columns(crossing.edge, place, near, column, steps.layout);
            in_grid = _mm512_mask_cmplt_epi32_mask(lanes, column, n_u);
        }
        let place = _mm512_slli_epi32::<{ COLUMN.ilog2() }>(column);
        let place = _mm512_add_epi32(place, _mm512_set1_epi32(crossing.first.cast_signed()));
        let delta = _mm512_mask_mov_epi32(self.deltas[0], fewer, self.deltas[1]);
        let step = _mm512_add_epi32(place, delta);
        store(
            _mm512_maskz_compress_epi32(in_grid, step),
            steps.room(crossing.group),
        );
        steps.keep(crossing.group, in_grid.count_ones());
    }

    /// Those of some lanes again, by [`Batch::exact_column`].
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[cold]
    fn exact_columns(
        &self,
        edge: usize,
        (group, first): (usize, Step),
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

/// [`first_columns`](crate::sweep::crossings::first_columns), which are not cut off at the row's end.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn first_columns(u: f32, away: __m512) -> __m512i {
    let at = _mm512_sub_ps(_mm512_set1_ps(u), away);
    _mm512_max_epi32(_mm512_cvt_roundps_epi32::<UP>(at), _mm512_setzero_si512())
}
