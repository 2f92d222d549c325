//! Steps: from which column on a row has how many layers more or fewer.
//!
//! Steps come in the order of edges, and would touch counters all over a tile. They are kept
//! by groups of rows first, and each group is counted by itself while it is in a core's first
//! cache.

use super::counters::{COLUMN, Counter, Layout, MOST_PLACES, Tile};
use super::frame::LANES;

/// Steps that a group can keep before they have to be counted.
const MOST_STEPS: usize = 1 << 14;

/// A counter's place in its group (bits 0–15) and what is added to it (bits 24–31, signed).
pub(super) type Step = u32;

/// The bits of what a [`Step`] adds.
#[inline(always)]
pub(super) fn delta_bits(delta: i8) -> Step {
    Step::from(delta.cast_unsigned()) << 24
}

/// Which lanes of a block have a step, and of which sign.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Lanes {
    pub steps: u16,
    /// Of the steps, those that are layers fewer.
    pub fewer: u16,
}

/// The steps of one batch in one tile.
pub(super) struct Steps {
    pub layout: Layout,
    /// [`MOST_STEPS`] for each group.
    kept: Vec<Step>,
    lens: Vec<u32>,
    /// Counters of groups with more steps than they could keep; else empty.
    counted: Vec<Vec<i32>>,
}

impl Default for Steps {
    fn default() -> Self {
        let layout = Layout {
            n_u: 0,
            blocks: 0,
            shift: 0,
        };
        Self {
            layout,
            kept: Vec::new(),
            lens: Vec::new(),
            counted: Vec::new(),
        }
    }
}

impl Steps {
    /// Starts a batch. Nothing is left of the one before, as all its groups have been taken.
    pub(super) fn start(&mut self, layout: Layout, tile: &Tile) {
        let n_groups = layout.groups(tile);
        self.layout = layout;
        self.lens.clear();
        self.lens.resize(n_groups, 0);
        if self.kept.len() < n_groups * MOST_STEPS {
            self.kept = vec![0; n_groups * MOST_STEPS];
        }
        if self.counted.len() < n_groups {
            self.counted.resize_with(n_groups, Vec::new);
        }
    }

    /// Room for a step of every lane of one block.
    #[inline(always)]
    pub(super) fn room(&mut self, group: usize) -> &mut [Step; LANES] {
        if self.lens[group] as usize > MOST_STEPS - LANES {
            self.count(group);
        }
        let start = group * MOST_STEPS + self.lens[group] as usize;
        let room = self.kept[start..].first_chunk_mut();
        room.expect("a group is longer than a block")
    }

    /// Keeps the first `n` of what has been put into the [room](Self::room).
    #[inline(always)]
    pub(super) fn keep(&mut self, group: usize, n: u32) {
        self.lens[group] += n;
    }

    /// A row's block from `columns` on: for each of the lanes `unit` layers more or fewer.
    /// Columns past the last cell are nowhere.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        (row, block): (u32, u32),
        side: usize,
        columns: &[u32; LANES],
        lanes: Lanes,
        unit: i8,
    ) {
        let n_u = self.layout.n_u;
        let (group, first) = self.layout.place(row, block);
        let first = first + (side * LANES) as u32;
        let signs = [delta_bits(unit), delta_bits(-unit)];
        let room = self.room(group);
        let mut n = 0;
        let mut left = lanes.steps;
        while left != 0 {
            let lane = left.trailing_zeros();
            left &= left - 1;
            let column = columns[lane as usize & (LANES - 1)];
            let sign = signs[usize::from(lanes.fewer >> lane & 1)];
            // Overwritten by the next if it is nowhere.
            room[n as usize & (LANES - 1)] = (first + column * COLUMN as u32 + lane) | sign;
            n += u32::from(column < n_u);
        }
        self.keep(group, n);
    }

    /// [`Steps::add`] of a layer in all lanes that there are, at one column.
    #[inline(always)]
    pub(super) fn add_all(
        &mut self,
        (row, block): (u32, u32),
        side: usize,
        column: u32,
        lanes: Lanes,
    ) {
        if column >= self.layout.n_u {
            return;
        }
        let (group, first) = self.layout.place(row, block);
        let first = first + (side * LANES) as u32 + column * COLUMN as u32;
        for (lane, step) in (0..).zip(self.room(group)) {
            let delta = delta_bits(if lanes.fewer >> lane & 1 != 0 { -1 } else { 1 });
            *step = (first + lane) | delta;
        }
        // They are the first ones.
        self.keep(group, lanes.steps.count_ones());
    }

    /// Counts what a group has kept.
    #[cold]
    fn count(&mut self, group: usize) {
        let counters = &mut self.counted[group];
        counters.resize(self.layout.group(), 0);
        let kept = &self.kept[group * MOST_STEPS..][..self.lens[group] as usize];
        count(kept, counters);
        self.lens[group] = 0;
    }

    /// Takes a group's steps into counters that are zero. Bytes, unless they are too small: then
    /// they are left zero.
    #[inline(always)]
    pub(super) fn take(&mut self, group: usize, bytes: &mut Bytes) -> Taken {
        let n = std::mem::take(&mut self.lens[group]) as usize;
        let kept = &self.kept[group * MOST_STEPS..][..n];
        let n_places = self.layout.group();
        let counted = &mut self.counted[group];
        if counted.is_empty() {
            if kept.is_empty() {
                return Taken::Nothing;
            }
            if !count_bytes(kept, bytes) {
                return Taken::Narrow;
            }
            bytes[..n_places].fill(0);
        }
        let mut counters = std::mem::take(counted);
        counters.resize(n_places, 0);
        count(kept, &mut counters);
        Taken::Wide(counters)
    }
}

/// The counters of a group, if bytes are enough.
pub(super) type Bytes = [i8; MOST_PLACES];

/// The counters of a group.
pub(super) enum Taken {
    /// All are zero.
    Nothing,
    /// In the bytes.
    Narrow,
    Wide(Vec<i32>),
}

fn count(steps: &[Step], counters: &mut [i32]) {
    for &step in steps {
        counters[usize::from(step as u16)].add((step >> 24) as i8);
    }
}

/// Whether a counter was too small.
#[inline(always)]
fn count_bytes(steps: &[Step], counters: &mut Bytes) -> bool {
    let mut wrapped = false;
    for &step in steps {
        wrapped |= counters[usize::from(step as u16)].add((step >> 24) as i8);
    }
    wrapped
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::frame::Frame;

    /// Adds `n` steps of many kinds, and checks all groups against counters of all.
    fn check(n: u32, size: u32, one_place: bool) -> [bool; 3] {
        let frame = Frame {
            u: 0,
            v: 1,
            w: 2,
            n: [40, 12, 9],
            size,
            shear: [1.0; 2],
        };
        let tile = Tile { j: 0..12, k: 0..9 };
        let layout = Layout::new(&frame);
        let mut steps = Steps::default();
        steps.start(layout, &tile);
        let mut expected = vec![0; layout.groups(&tile) * layout.group()];
        for i in 0..n {
            let row = if one_place { 5 } else { (i * 7) % 108 };
            let (block, side) = (i % layout.blocks, i as usize % 2);
            let columns: [u32; LANES] = std::array::from_fn(|lane| (i + lane as u32) % 41);
            let lanes = Lanes {
                steps: (i * 40_503) as u16,
                fewer: (i * 977) as u16,
            };
            steps.add((row, block), side, &columns, lanes, 2);
            let (group, first) = layout.place(row, block);
            for lane in (0..LANES).filter(|lane| lanes.steps >> lane & 1 != 0) {
                let place = first as usize + columns[lane] as usize * COLUMN + side * LANES + lane;
                let fewer = lanes.fewer >> lane & 1 != 0;
                if columns[lane] < 40 {
                    expected[group * layout.group() + place] += if fewer { -2 } else { 2 };
                }
            }
        }
        let mut bytes = vec![0; MOST_PLACES].into_boxed_slice();
        let bytes: &mut Bytes = (&mut *bytes).try_into().unwrap();
        let mut seen = [false; 3];
        for (group, expected) in expected.chunks_exact(layout.group()).enumerate() {
            let taken = match steps.take(group, bytes) {
                Taken::Nothing => {
                    seen[0] = true;
                    vec![0; layout.group()]
                }
                Taken::Narrow => {
                    seen[1] = true;
                    let counters = &mut bytes[..layout.group()];
                    let taken = counters.iter().map(|n| i32::from(*n)).collect();
                    counters.fill(0);
                    taken
                }
                Taken::Wide(counters) => {
                    seen[2] = true;
                    counters
                }
            };
            assert!(taken == expected, "{group}");
            assert!(bytes.iter().all(|n| *n == 0));
        }
        seen
    }

    #[test]
    fn groups_count_what_was_added() {
        assert_eq!(check(0, 16, false), [true, false, false]);
        assert_eq!(check(500, 16, false), [false, true, false]);
        assert_eq!(check(500, 40, false), [false, true, false]);
    }

    #[test]
    fn more_than_bytes_hold_and_more_than_groups_keep_is_counted_too() {
        assert_eq!(check(15_000, 16, true), [true, false, true]);
        assert_eq!(check(60_000, 24, false), [false, false, true]);
    }
}
