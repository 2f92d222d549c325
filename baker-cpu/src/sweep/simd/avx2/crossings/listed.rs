//! The list of crossings between the two stages.

use std::arch::x86_64::*;

use aogrid_bake_core::sweep;

use crate::sweep::data::{Batch, COLUMN, Delta, DeltaBuffer, EdgeBuffer, delta_bits};
use crate::sweep::simd::avx2::compress::Selected;
use crate::sweep::simd::avx2::{LANES, floats, int_array, lane_bits, unsigned_array};

/// The number of crossings after which they are counted.
const MAX_CROSSINGS: usize = 512;

/// Crossings, as a structure of arrays, with space for eight more.
#[repr(align(64))]
pub(super) struct Crossings {
    /// u minus and plus its error bound: where both give the same column, it is certain.
    u_low: [f32; MAX_CROSSINGS + LANES],
    u_high: [f32; MAX_CROSSINGS + LANES],
    height: [f32; MAX_CROSSINGS + LANES],
    /// The slot of the first column.
    first: [Delta; MAX_CROSSINGS + LANES],
    words: [u32; MAX_CROSSINGS + LANES],
    n: usize,
}

/// The places of a word: the edge in bits 0–7, the first direction in bits 8–11, the run of directions
/// from there on in bits 16–23, whether layers become fewer in bit 24, the group in bits 25–31.
const START_SHIFT: u32 = 8;
const RUN_SHIFT: u32 = 16;
const SIGN_SHIFT: u32 = 24;
pub(super) const GROUP_SHIFT: u32 = 25;

/// Returns the words of eight edges from `first` on, in group 0.
#[target_feature(enable = "avx2")]
#[inline]
pub(super) fn word(first: usize, start: __m256i, run: __m256i, negative: __m256i) -> __m256i {
    let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    let edges = _mm256_add_epi32(_mm256_set1_epi32(first as i32), lanes);
    let start = _mm256_slli_epi32::<{ START_SHIFT as i32 }>(start);
    let run = _mm256_slli_epi32::<{ RUN_SHIFT as i32 }>(run);
    let sign = _mm256_slli_epi32::<{ SIGN_SHIFT as i32 }>(negative);
    _mm256_or_si256(_mm256_or_si256(edges, start), _mm256_or_si256(run, sign))
}

#[inline(always)]
fn slots<T, const N: usize>(values: &mut [T; N], at: usize) -> &mut [T; LANES] {
    let slots = values[at..].first_chunk_mut();
    slots.expect("eight slots are free")
}

impl Crossings {
    pub(super) fn new() -> Self {
        Self {
            u_low: [0.0; MAX_CROSSINGS + LANES],
            u_high: [0.0; MAX_CROSSINGS + LANES],
            height: [0.0; MAX_CROSSINGS + LANES],
            first: [0; MAX_CROSSINGS + LANES],
            words: [0; MAX_CROSSINGS + LANES],
            n: 0,
        }
    }

    /// Whether there is no space for eight more.
    #[inline(always)]
    pub(super) fn is_full(&self) -> bool {
        self.n > MAX_CROSSINGS
    }

    /// Appends crossings, which are in the first lanes: as many as `inside` has bits.
    #[target_feature(enable = "avx2,popcnt")]
    #[inline]
    pub(super) fn append(
        &mut self,
        inside: u32,
        [u_low, u_high, height, first, words]: [__m256i; 5],
    ) {
        let at = self.n;
        let float = |lanes| int_array(lanes).map(|bits| f32::from_bits(bits.cast_unsigned()));
        *slots(&mut self.u_low, at) = float(u_low);
        *slots(&mut self.u_high, at) = float(u_high);
        *slots(&mut self.height, at) = float(height);
        *slots(&mut self.first, at) = unsigned_array(first);
        *slots(&mut self.words, at) = unsigned_array(words);
        self.n = at + inside.count_ones() as usize;
    }

    /// Counts all crossings, `unit` layers each, and empties the list.
    #[target_feature(enable = "avx2,popcnt,bmi1,bmi2")]
    #[inline]
    pub(super) fn count(
        &mut self,
        batch: &Batch<'_>,
        edges: &EdgeBuffer,
        (block, unit): (usize, i8),
        deltas: &mut DeltaBuffer,
    ) {
        // Space for eight directions from the last on.
        let mut slopes = [0.0; sweep::LANES + LANES];
        slopes[..sweep::LANES].copy_from_slice(&batch.slopes[block]);
        let signs = [delta_bits(unit), delta_bits(-unit)];
        let n_u = _mm256_set1_ps(deltas.layout.n_u as f32);
        let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
        for at in 0..self.n.min(MAX_CROSSINGS + LANES) {
            let word = self.words[at];
            let start = (word >> START_SHIFT) as usize % sweep::LANES;
            let run = word >> RUN_SHIFT & 0xff;
            let slopes = slopes[start..].first_chunk().expect("eight slopes");
            let away = _mm256_mul_ps(_mm256_set1_ps(self.height[at]), floats(slopes));
            let mut columns = first_columns(self.u_low[at], away);
            let last = first_columns(self.u_high[at], away);
            let mut in_grid = run & bits(_mm256_cmp_ps::<_CMP_LT_OQ>(columns, n_u));
            let uncertain = in_grid & bits(_mm256_cmp_ps::<_CMP_NEQ_UQ>(columns, last));
            if uncertain != 0 {
                columns = self.exact_columns(at, (batch, edges, block), uncertain, columns, deltas);
                in_grid = run & bits(_mm256_cmp_ps::<_CMP_LT_OQ>(columns, n_u));
            }
            let columns = _mm256_cvttps_epi32(_mm256_min_ps(columns, n_u));
            let sign = signs[(word >> SIGN_SHIFT) as usize & 1];
            let base = (self.first[at] + start as u32) | sign;
            let slot = _mm256_slli_epi32::<{ COLUMN.ilog2() as i32 }>(columns);
            let slot = _mm256_add_epi32(slot, lanes);
            let delta = _mm256_add_epi32(slot, _mm256_set1_epi32(base.cast_signed()));
            let group = (word >> GROUP_SHIFT) as usize;
            *slots(deltas.reserve(group), 0) = unsigned_array(Selected::new(in_grid).front(delta));
            deltas.commit(group, in_grid.count_ones());
        }
        self.n = 0;
    }

    /// Computes the columns of some lanes again, by [`Batch::exact_column`].
    #[target_feature(enable = "avx2")]
    #[cold]
    fn exact_columns(
        &self,
        at: usize,
        (batch, edges, block): (&Batch<'_>, &EdgeBuffer, usize),
        lanes: u32,
        columns: __m256,
        deltas: &DeltaBuffer,
    ) -> __m256 {
        let layout = deltas.layout;
        let word = self.words[at];
        let vertices = edges.vertices.map(|all| all[word as usize & 0xff]);
        let group = (word >> GROUP_SHIFT) as usize;
        let strip = (group << layout.shift) + self.first[at] as usize / layout.strip();
        let row = strip as u32 / layout.blocks;
        let start = (word >> START_SHIFT) as usize % sweep::LANES;
        let mut columns = int_array(_mm256_cvttps_epi32(columns));
        for lane in (0..LANES).filter(|lane| lanes >> lane & 1 != 0) {
            let z = (block * sweep::LANES + start + lane) as u32;
            columns[lane] = batch.exact_column(vertices, row, z).cast_signed();
        }
        floats(&columns.map(|column| column as f32))
    }
}

#[target_feature(enable = "avx2")]
#[inline]
fn bits(mask: __m256) -> u32 {
    lane_bits(_mm256_castps_si256(mask))
}

/// Computes [`first_columns`](crate::sweep::data::first_columns), without the upper clamp at the row's
/// end.
#[target_feature(enable = "avx2")]
#[inline]
fn first_columns(u: f32, away: __m256) -> __m256 {
    let at = _mm256_sub_ps(_mm256_set1_ps(u), away);
    _mm256_max_ps(_mm256_ceil_ps(at), _mm256_setzero_ps())
}
