//! x86-64 with registers of 64 bytes: sixteen vertices, edges or directions at once.

#![allow(
    unsafe_code,
    reason = "that the machine has the instructions is known here, and not to the compiler"
)]

use std::arch::x86_64::*;

use super::avx2::Avx2;
use super::{Batch, Edges, Find, Levels, Mask, Row, Steps, Vectors, Work};
use crate::sweep::counters::COLUMN;
use crate::sweep::frame::LANES;
use crate::sweep::levels::{FRACTION_BITS, FRACTIONS};
use crate::sweep::silhouettes::{Facings, List, Sides as EdgeSides};
use crate::sweep::steps::{Step, delta_bits};

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
    #[inline(always)]
    fn find(self, find: Find<'_>) {
        // SAFETY: the machine has the instructions, or there were no `self`.
        unsafe { self::find(find) }
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
        unsafe { count(batch, edges, unit, steps) }
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

/// The chosen ones of sixteen numbers.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn append<T: Number>(chosen: __mmask16, from: __m512i, to: &mut Vec<T>) {
    to.reserve(LANES);
    let n = chosen.count_ones() as usize;
    // SAFETY: there is room for sixteen numbers of four bytes, of which the first n are chosen.
    unsafe {
        let from = _mm512_maskz_compress_epi32(chosen, from);
        _mm512_storeu_si512(to.as_mut_ptr().add(to.len()).cast(), from);
        to.set_len(to.len() + n);
    }
}

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn store<T: Number>(from: __m512i, to: &mut [T; LANES]) {
    // SAFETY: sixteen numbers of four bytes are 64 bytes; they need not be aligned.
    unsafe { _mm512_storeu_si512(to.as_mut_ptr().cast(), from) }
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
impl Number for EdgeSides {}

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
    let (chunks, rest) = row.edges.as_chunks::<LANES>();
    let (sides, rest_sides) = row.sides.as_chunks::<LANES>();
    for (idx, sides) in chunks.iter().zip(sides) {
        // In numbers of eight bytes: an edge has two, of which the first are its vertices.
        let of = _mm512_slli_epi32::<1>(unsigned(idx));
        let all = row.of.as_ptr();
        // SAFETY: the numbers are those of edges; edges are 16 bytes, with their vertices first,
        // and so few that twice their number fits (`MOST_EDGES`).
        let vertices = unsafe {
            [
                _mm512_i32gather_epi32::<8>(of, all.cast()),
                _mm512_i32gather_epi32::<8>(of, all.cast::<u32>().add(1).cast()),
            ]
        };
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
        put(crossing, load_sides(sides), &mut edges.sides, n);
        edges.n += crossing.count_ones() as usize;
    }
    for (&idx, &sides) in rest.iter().zip(rest_sides) {
        edges.push(row.of[idx as usize].vertices, row.ranks, sides);
    }
}

/// Puts the chosen ones of sixteen numbers at a place where there is room for all.
#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn put<T: Number, const N: usize>(chosen: __mmask16, from: __m512i, to: &mut [T; N], at: usize) {
    let room = to[at..].first_chunk_mut::<LANES>();
    let room = room.expect("there is room for sixteen");
    store(_mm512_maskz_compress_epi32(chosen, from), room);
}

/// [`Batch::levels`] and the layout of its counters.
struct Tables {
    fractions: Table,
    k: Table,
    first_row: Table,
    first_j: Table,
}

#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
fn count(batch: &Batch<'_>, edges: &Edges, unit: i8, steps: &mut Steps) {
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
        Self {
            u: from.u,
            w: from.w,
            q: q_from,
            u_per_level: _mm512_mul_ps(_mm512_sub_ps(to.u, from.u), inverse),
            w_per_level: _mm512_mul_ps(_mm512_sub_ps(to.w, from.w), inverse),
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

#[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
#[inline]
fn load_sides(from: &[EdgeSides; LANES]) -> __m512i {
    // SAFETY: as `floats`.
    unsafe { _mm512_loadu_si512(from.as_ptr().cast()) }
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

/// What is needed to count sixteen edges in one block.
struct Crossings<'a> {
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
        let (u, height, groups) = (array(u), array(height), int_array(groups));
        let first = int_array(first);
        let mut left = inside;
        while left != 0 {
            let edge = left.trailing_zeros() as usize & (LANES - 1);
            left &= left - 1;
            let lanes = [
                self.sides.steps.0[edge] as u16,
                self.sides.fewer.0[edge] as u16,
            ];
            let group = groups.0[edge] as usize;
            self.edge(
                u.0[edge],
                height.0[edge],
                group,
                first.0[edge],
                lanes,
                steps,
            );
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

    /// `columns`, and [`Steps::add`], of one edge.
    #[target_feature(enable = "avx512f,popcnt,bmi1,bmi2")]
    #[inline]
    fn edge(
        &self,
        u: f32,
        height: f32,
        group: usize,
        first: Step,
        [lanes, fewer]: [u16; 2],
        steps: &mut Steps,
    ) {
        let away = _mm512_mul_ps(_mm512_set1_ps(height), self.slopes);
        let at = _mm512_sub_ps(_mm512_set1_ps(u), away);
        let column = _mm512_cvt_roundps_epi32::<UP>(at);
        let column = _mm512_max_epi32(column, _mm512_setzero_si512());
        let n_u = _mm512_set1_epi32(steps.layout.n_u as i32);
        let in_grid = _mm512_mask_cmplt_epi32_mask(lanes, column, n_u);
        let place = _mm512_slli_epi32::<{ COLUMN.ilog2() }>(column);
        let place = _mm512_add_epi32(place, _mm512_set1_epi32(first.cast_signed()));
        let delta = _mm512_mask_mov_epi32(self.deltas[0], fewer, self.deltas[1]);
        let step = _mm512_add_epi32(place, delta);
        store(
            _mm512_maskz_compress_epi32(in_grid, step),
            steps.room(group),
        );
        steps.keep(group, in_grid.count_ones());
    }
}

/// [`Find::run_portable`]: silhouettes are gathered until there are sixteen, and then shared
/// out to the lists of all rows.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
#[inline]
fn find(find: Find<'_>) {
    let rows = u16::MAX >> (LANES - find.n_rows);
    let mut some = Silhouettes::default();
    for (idx, edge) in (find.first..).zip(find.edges) {
        let [one, other] = find.sides(edge);
        let [one, other] = [along(one.0, one.1), along(other.0, other.1)];
        let differ = _mm_xor_si128(one, other);
        // The one along the edge and the other against it: they cancel where they are equal.
        let odd = rows & !_mm_cmpeq_epi8_mask(differ, _mm_set1_epi8(i8::MIN));
        some.put(idx, odd, one, other);
        if some.n == LANES {
            some.share_out(find.n_rows, find.lists);
        }
    }
    some.share_out(find.n_rows, find.lists);
}

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
struct Silhouettes {
    edges: [u32; LANES],
    rows: [u32; LANES],
    /// The facings of the two triangles in each row: a number of 16 bits for each.
    sides: [[u32; LANES / 2]; LANES],
    n: usize,
}

impl Silhouettes {
    /// Adds an edge, unless there is no row in which it is a silhouette.
    #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,popcnt,bmi1,bmi2")]
    #[inline]
    fn put(&mut self, edge: u32, rows: u16, one: __m128i, other: __m128i) {
        let n = self.n & (LANES - 1);
        self.edges[n] = edge;
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
        let edges = unsigned(&self.edges);
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
                append(chosen, edges, &mut list.edges);
                append(chosen, sides, &mut list.sides);
            }
        }
        self.n = 0;
    }
}
