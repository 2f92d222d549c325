//! Deltas: changes of a row's layer counts, from some column on.
//!
//! Deltas arrive in the order of edges and would touch counters all over a tile. They are first
//! buffered by groups of rows; then each group is counted while its counters are in the L1 cache.

use aogrid_bake_core::sweep::LANES;

use super::counters::{COLUMN, Counter, Layout, MAX_GROUP_COUNTERS, Tile};
use super::lane_deltas::LaneDeltas;

/// The maximum number of deltas that a group buffers before they have to be counted.
const MAX_GROUP_DELTAS: usize = 1 << 14;

/// A counter's slot in its group (bits 0–15) and the amount to add (bits 24–31, signed).
pub(in crate::sweep) type Delta = u32;

/// Returns the bits of a [`Delta`] that hold the amount.
#[inline(always)]
pub(in crate::sweep) fn delta_bits(delta: i8) -> Delta {
    Delta::from(delta.cast_unsigned()) << 24
}

/// The deltas of one batch in one tile.
pub(in crate::sweep) struct DeltaBuffer {
    pub layout: Layout,
    /// Space for [`MAX_GROUP_DELTAS`] of each group.
    pending: Vec<Delta>,
    lens: Vec<u32>,
    /// The 32-bit counters of groups that overflowed their buffer; else empty.
    wide: Vec<Vec<i32>>,
}

impl Default for DeltaBuffer {
    fn default() -> Self {
        let layout = Layout {
            n_u: 0,
            blocks: 0,
            shift: 0,
        };
        Self {
            layout,
            pending: Vec::new(),
            lens: Vec::new(),
            wide: Vec::new(),
        }
    }
}

impl DeltaBuffer {
    /// Starts a batch. Nothing is left of the one before, as all its groups have been accumulated.
    pub(in crate::sweep) fn reset(&mut self, layout: Layout, tile: &Tile) {
        let n_groups = layout.groups(tile);
        self.layout = layout;
        self.lens.clear();
        self.lens.resize(n_groups, 0);
        if self.pending.len() < n_groups * MAX_GROUP_DELTAS {
            self.pending = vec![0; n_groups * MAX_GROUP_DELTAS];
        }
        if self.wide.len() < n_groups {
            self.wide.resize_with(n_groups, Vec::new);
        }
    }

    /// Reserves space for a delta of every lane of one block.
    #[inline(always)]
    pub(in crate::sweep) fn reserve(&mut self, group: usize) -> &mut [Delta; LANES] {
        if self.lens[group] as usize > MAX_GROUP_DELTAS - LANES {
            self.count(group);
        }
        let start = group * MAX_GROUP_DELTAS + self.lens[group] as usize;
        let reserved = self.pending[start..].first_chunk_mut();
        reserved.expect("a group is longer than a block")
    }

    /// Appends the first `n` deltas of the [reserved](Self::reserve) space.
    #[inline(always)]
    pub(in crate::sweep) fn commit(&mut self, group: usize, n: u32) {
        self.lens[group] += n;
    }

    /// Appends the deltas of a row's block, from `columns` on: `unit` layers more or fewer for each
    /// active lane. Columns past the last cell are dropped.
    #[inline(always)]
    pub(in crate::sweep) fn push(
        &mut self,
        (row, block): (u32, u32),
        side: usize,
        columns: &[u32; LANES],
        lanes: LaneDeltas,
        unit: i8,
    ) {
        let n_u = self.layout.n_u;
        let (group, first) = self.layout.first_slot(row, block);
        let first = first + (side * LANES) as u32;
        let signs = [delta_bits(unit), delta_bits(-unit)];
        let reserved = self.reserve(group);
        let mut n = 0;
        let mut remaining = lanes.active;
        while remaining != 0 {
            let lane = remaining.trailing_zeros();
            remaining &= remaining - 1;
            let column = columns[lane as usize & (LANES - 1)];
            let sign = signs[usize::from(lanes.negative >> lane & 1)];
            // Overwritten by the next one if the column is past the last cell.
            reserved[n as usize & (LANES - 1)] = (first + column * COLUMN as u32 + lane) | sign;
            n += u32::from(column < n_u);
        }
        self.commit(group, n);
    }

    /// Appends as [`DeltaBuffer::push`] does, one layer in all active lanes, at one column.
    #[inline(always)]
    pub(in crate::sweep) fn push_at_column(
        &mut self,
        (row, block): (u32, u32),
        side: usize,
        column: u32,
        lanes: LaneDeltas,
    ) {
        if column >= self.layout.n_u {
            return;
        }
        let (group, first) = self.layout.first_slot(row, block);
        let first = first + (side * LANES) as u32 + column * COLUMN as u32;
        for (lane, slot) in (0..).zip(self.reserve(group)) {
            let delta = delta_bits(if lanes.negative >> lane & 1 != 0 {
                -1
            } else {
                1
            });
            *slot = (first + lane) | delta;
        }
        // The active lanes are the first ones.
        self.commit(group, lanes.active.count_ones());
    }

    /// Counts the pending deltas of a group in 32 bits.
    #[cold]
    fn count(&mut self, group: usize) {
        let counters = &mut self.wide[group];
        counters.resize(self.layout.group(), 0);
        let pending = &self.pending[group * MAX_GROUP_DELTAS..][..self.lens[group] as usize];
        count(pending, counters);
        self.lens[group] = 0;
    }

    /// Accumulates a group's deltas into counters that are zero. It uses bytes unless they
    /// overflow; then it leaves them zero and returns 32-bit counters.
    #[inline(always)]
    pub(in crate::sweep) fn accumulate(
        &mut self,
        group: usize,
        bytes: &mut ByteCounters,
    ) -> GroupCounters {
        let n = std::mem::take(&mut self.lens[group]) as usize;
        let pending = &self.pending[group * MAX_GROUP_DELTAS..][..n];
        let n_counters = self.layout.group();
        let wide = &mut self.wide[group];
        if wide.is_empty() {
            if pending.is_empty() {
                return GroupCounters::Empty;
            }
            if !count_bytes(pending, bytes) {
                return GroupCounters::Narrow;
            }
            bytes[..n_counters].fill(0);
        }
        let mut counters = std::mem::take(wide);
        counters.resize(n_counters, 0);
        count(pending, &mut counters);
        GroupCounters::Wide(counters)
    }
}

/// The one-byte counters of a group.
pub(in crate::sweep) type ByteCounters = [i8; MAX_GROUP_COUNTERS];

/// The accumulated counters of a group.
pub(in crate::sweep) enum GroupCounters {
    /// All are zero.
    Empty,
    /// The bytes hold them.
    Narrow,
    Wide(Vec<i32>),
}

fn count(deltas: &[Delta], counters: &mut [i32]) {
    for &delta in deltas {
        counters[usize::from(delta as u16)].add((delta >> 24) as i8);
    }
}

/// Counts in bytes; returns whether one overflowed.
#[inline(always)]
fn count_bytes(deltas: &[Delta], counters: &mut ByteCounters) -> bool {
    let mut wrapped = false;
    for &delta in deltas {
        wrapped |= counters[usize::from(delta as u16)].add((delta >> 24) as i8);
    }
    wrapped
}

#[cfg(test)]
mod tests {
    use super::*;
    use aogrid_bake_core::sweep::AxisFrame;

    /// Adds `n` varied deltas, and compares all groups with directly computed counters.
    fn check(n: u32, size: u32, single_row: bool) -> [bool; 3] {
        let frame = AxisFrame {
            axes: [0, 1, 2],
            first: [0; 3],
            cells: [40, 12, 9],
            size,
            shear: [1.0; 2],
        };
        let tile = Tile { j: 0..12, k: 0..9 };
        let layout = Layout::new(&frame);
        let mut deltas = DeltaBuffer::default();
        deltas.reset(layout, &tile);
        let mut expected = vec![0; layout.groups(&tile) * layout.group()];
        for i in 0..n {
            let row = if single_row { 5 } else { (i * 7) % 108 };
            let (block, side) = (i % layout.blocks, i as usize % 2);
            let columns: [u32; LANES] = std::array::from_fn(|lane| (i + lane as u32) % 41);
            let lanes = LaneDeltas {
                active: (i * 40_503) as u16,
                negative: (i * 977) as u16,
            };
            deltas.push((row, block), side, &columns, lanes, 2);
            let (group, first) = layout.first_slot(row, block);
            for lane in (0..LANES).filter(|lane| lanes.active >> lane & 1 != 0) {
                let slot = first as usize + columns[lane] as usize * COLUMN + side * LANES + lane;
                let negative = lanes.negative >> lane & 1 != 0;
                if columns[lane] < 40 {
                    expected[group * layout.group() + slot] += if negative { -2 } else { 2 };
                }
            }
        }
        let mut bytes = vec![0; MAX_GROUP_COUNTERS].into_boxed_slice();
        let bytes: &mut ByteCounters = (&mut *bytes).try_into().unwrap();
        let mut seen = [false; 3];
        for (group, expected) in expected.chunks_exact(layout.group()).enumerate() {
            let found = match deltas.accumulate(group, bytes) {
                GroupCounters::Empty => {
                    seen[0] = true;
                    vec![0; layout.group()]
                }
                GroupCounters::Narrow => {
                    seen[1] = true;
                    let counters = &mut bytes[..layout.group()];
                    let found = counters.iter().map(|n| i32::from(*n)).collect();
                    counters.fill(0);
                    found
                }
                GroupCounters::Wide(counters) => {
                    seen[2] = true;
                    counters
                }
            };
            assert!(found == expected, "{group}");
            assert!(bytes.iter().all(|n| *n == 0));
        }
        seen
    }

    #[test]
    fn group_counters_equal_the_sum_of_deltas() {
        assert_eq!(check(0, 16, false), [true, false, false]);
        assert_eq!(check(500, 16, false), [false, true, false]);
        assert_eq!(check(500, 40, false), [false, true, false]);
    }

    #[test]
    fn overflowing_bytes_and_full_buffers_are_counted_wide() {
        assert_eq!(check(15_000, 16, true), [true, false, true]);
        assert_eq!(check(60_000, 24, false), [false, false, true]);
    }
}
