//! Crossings of eight edges at a time: the SIMD version of
//! [`count`](crate::sweep::simd::portable::crossings::count).
//!
//! It has two stages. The first steps eight edges from level to level together and lists the
//! crossings. The second takes one crossing after the other, eight directions at once, without a
//! branch that cannot be foreseen.

mod edges;
mod listed;

use std::arch::x86_64::*;

use super::compress::Selected;
use super::{LANES, PREFETCH_DISTANCE, four, int_array, lane_bits, prefetch_positions};
use crate::sweep::data::{
    Batch, DeltaBuffer, EdgeBuffer, FRACTION_BITS, FRACTIONS, Layout, Levels,
};
use edges::{Directions, Lines, transposed};
use listed::Crossings;

/// The level tables, an entry for each fraction: its value, k, the first row and the first j.
struct LevelTable([[u32; 4]; FRACTIONS]);

impl LevelTable {
    fn new(levels: &Levels) -> Self {
        Self(std::array::from_fn(|s| {
            [
                levels.fractions[s].to_bits(),
                levels.k[s].to_bits(),
                levels.first_row[s].cast_unsigned(),
                levels.first_j[s].cast_unsigned(),
            ]
        }))
    }

    /// Returns the entries of eight fractions.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn entries(&self, s: __m256i) -> [__m256i; 4] {
        let mut entries = [_mm_setzero_si128(); LANES];
        for (entry, s) in entries.iter_mut().zip(int_array(s)) {
            *entry = four(&self.0[s as usize & (FRACTIONS - 1)]);
        }
        transposed(entries)
    }
}

#[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
#[inline]
pub(super) fn count(batch: &Batch<'_>, edges: &EdgeBuffer, unit: i8, deltas: &mut DeltaBuffer) {
    let table = LevelTable::new(batch.levels);
    let mut found = Crossings::new();
    for block in 0..batch.slopes.len() {
        for first in (0..edges.n).step_by(LANES) {
            prefetch_positions(batch, edges, (first + PREFETCH_DISTANCE, LANES));
            let lines = Lines::new(batch, edges, first);
            let mut directions = Directions::new(&lines, batch, edges, first, block);
            // Nearly all edges have one run of at most eight directions of one sign.
            loop {
                let step = Step {
                    batch,
                    block,
                    table: &table,
                    layout: deltas.layout,
                    lines: &lines,
                    runs: directions.take_runs(first),
                };
                let mut position = step.start(&directions);
                while step.list(&mut position, &mut found) {
                    if found.is_full() {
                        found.count(batch, edges, (block, unit), deltas);
                    }
                }
                if !directions.advance() {
                    break;
                }
            }
        }
        found.count(batch, edges, (block, unit), deltas);
    }
}

/// Eight edges on their way from level to level.
struct Step<'a> {
    batch: &'a Batch<'a>,
    block: usize,
    table: &'a LevelTable,
    layout: Layout,
    lines: &'a Lines,
    /// The [words](listed::word) of the edges' runs of directions.
    runs: __m256i,
}

/// The levels of eight edges, and which of them have not passed their last.
struct Position {
    level: __m256i,
    /// A bit for each edge.
    alive: u32,
}

impl Step<'_> {
    #[target_feature(enable = "avx2")]
    #[inline]
    fn start(&self, directions: &Directions) -> Position {
        let has_levels = _mm256_cmpgt_epi32(self.lines.end, self.lines.level);
        Position {
            level: self.lines.level,
            alive: lane_bits(has_levels) & directions.taken,
        }
    }

    /// Lists the crossings of eight edges with their levels and goes to the next levels. Returns
    /// whether there are any.
    #[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
    #[inline]
    fn list(&self, position: &mut Position, found: &mut Crossings) -> bool {
        if position.alive == 0 {
            return false;
        }
        let levels = self.batch.levels;
        let s = _mm256_and_si256(position.level, _mm256_set1_epi32(FRACTIONS as i32 - 1));
        let whole = _mm256_srai_epi32::<{ FRACTION_BITS as i32 }>(position.level);
        let [fraction, k, first_row, first_j] = self.table.entries(s);
        let j = _mm256_add_epi32(whole, first_j);
        // Unsigned: j below zero counts as large.
        let last_j = _mm256_set1_epi32(levels.width as i32 - 1);
        let in_tile = _mm256_cmpeq_epi32(_mm256_min_epu32(j, last_j), j);
        let inside = lane_bits(in_tile) & position.alive;
        let value = _mm256_add_ps(_mm256_cvtepi32_ps(whole), _mm256_castsi256_ps(fraction));
        let row = _mm256_add_epi32(whole, first_row);
        self.list_at(inside, value, _mm256_castsi256_ps(k), row, found);
        // Level numbers skip the unused fractions at the end of each whole part.
        let is_last = _mm256_cmpeq_epi32(s, _mm256_set1_epi32(levels.n as i32 - 1));
        let to_next_whole = _mm256_set1_epi32((FRACTIONS - levels.n) as i32);
        let skipped = _mm256_and_si256(is_last, to_next_whole);
        let next = _mm256_add_epi32(position.level, _mm256_set1_epi32(1));
        position.level = _mm256_add_epi32(next, skipped);
        position.alive &= lane_bits(_mm256_cmpgt_epi32(self.lines.end, position.level));
        true
    }

    /// Computes `Line::at` of eight edges, and lists those that are inside the tile.
    #[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
    #[inline]
    fn list_at(&self, inside: u32, value: __m256, k: __m256, row: __m256i, found: &mut Crossings) {
        let lines = self.lines;
        let t = _mm256_sub_ps(value, lines.q);
        let u = _mm256_add_ps(lines.u, _mm256_mul_ps(t, lines.u_per_level));
        let w = _mm256_add_ps(lines.w, _mm256_mul_ps(t, lines.w_per_level));
        let height = _mm256_sub_ps(w, k);
        let (group, first) = self.first_slots(row, height);
        let selected = Selected::new(inside);
        found.append(
            inside,
            [
                selected.front(_mm256_castps_si256(_mm256_sub_ps(u, lines.column_error))),
                selected.front(_mm256_castps_si256(_mm256_add_ps(u, lines.column_error))),
                selected.front(_mm256_castps_si256(height)),
                selected.front(first),
                selected.front(_mm256_or_si256(self.runs, group)),
            ],
        );
    }

    /// Returns the group, in its bits of a [word](listed::word), and the slot of the first column on
    /// the side of the crossing.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn first_slots(&self, row: __m256i, height: __m256) -> (__m256i, __m256i) {
        let layout = self.layout;
        let strip = _mm256_mullo_epi32(row, _mm256_set1_epi32(layout.blocks as i32));
        let strip = _mm256_add_epi32(strip, _mm256_set1_epi32(self.block as i32));
        let group = _mm256_srl_epi32(strip, _mm_cvtsi32_si128(layout.shift as i32));
        let group = _mm256_slli_epi32::<{ listed::GROUP_SHIFT as i32 }>(group);
        let within = _mm256_and_si256(strip, _mm256_set1_epi32((1 << layout.shift) - 1));
        let first = _mm256_mullo_epi32(within, _mm256_set1_epi32(layout.strip() as i32));
        let below = _mm256_cmp_ps::<_CMP_LE_OQ>(height, _mm256_setzero_ps());
        let second_side = _mm256_set1_epi32(aogrid_bake_core::sweep::LANES as i32);
        let side = _mm256_and_si256(_mm256_castps_si256(below), second_side);
        (group, _mm256_add_epi32(first, side))
    }
}
