//! Vertices at the same place are one vertex, whatever the file says.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use super::TriangleMesh;

/// Triangles over welded vertices: corners at exactly the same position have the same index,
/// that of the first vertex at the place.
pub(super) fn weld(mesh: &TriangleMesh) -> Vec<[u32; 3]> {
    // Adding zero turns −0 into +0, which are the same place.
    let bits = |p: &[f32; 3]| p.map(|v| (v + 0.0).to_bits());
    let places: Vec<[u32; 3]> = mesh.positions().iter().map(bits).collect();
    let welded = first_at_place(&places);
    let renumber = |vertex: u32| welded[vertex as usize];
    mesh.triangles().iter().map(|t| t.map(renumber)).collect()
}

/// For each place, the index of the first equal one. On all threads; the result does not depend
/// on their number.
///
/// Equal places have equal hashes. So places are dealt out to parts by their hashes first: so
/// few a part that all look-ups stay in a core's first cache, where those of one large table
/// would each wait for memory.
pub(crate) fn first_at_place(places: &[[u32; 3]]) -> Vec<u32> {
    let n_parts = (places.len() / A_PART).max(1).next_power_of_two();
    let dealt: Vec<Dealt> = places
        .par_chunks(A_PIECE)
        .enumerate()
        .map(|(piece, places)| Dealt::new(places, piece * A_PIECE, n_parts))
        .collect();
    let first: Vec<AtomicU32> = (0..places.len() as u32).map(AtomicU32::new).collect();
    (0..n_parts)
        .into_par_iter()
        .with_min_len(4)
        .for_each(|part| {
            let entries = dealt.iter().flat_map(|dealt| dealt.part(part));
            let mut table = Table::new(dealt.iter().map(|dealt| dealt.part(part).len()).sum());
            for entry in entries {
                let found = table.find(*entry, places);
                if found != entry.idx {
                    first[entry.idx as usize].store(found, Ordering::Relaxed);
                }
            }
        });
    first.into_iter().map(AtomicU32::into_inner).collect()
}

/// Places in a part, on average: its table is 32 kB.
const A_PART: usize = 1 << 11;

/// Places that are dealt out in one piece.
const A_PIECE: usize = 1 << 15;

/// A place's index, and 32 bits of its hash by which most that are not equal are told apart.
#[derive(Clone, Copy, Default)]
struct Entry {
    hash: u32,
    idx: u32,
}

/// Some places, sorted by parts; each part in the places' order.
struct Dealt {
    entries: Vec<Entry>,
    /// Where each part ends.
    ends: Vec<u32>,
}

impl Dealt {
    fn new(places: &[[u32; 3]], first: usize, n_parts: usize) -> Self {
        let part = |hash: u64| (hash >> 32) as usize & (n_parts - 1);
        let hashes: Vec<u64> = places.iter().map(|place| mix(*place)).collect();
        let mut ends = vec![0; n_parts];
        for hash in &hashes {
            ends[part(*hash)] += 1;
        }
        let mut before = 0;
        for end in &mut ends {
            before += std::mem::replace(end, before);
        }
        // These are the starts; dealing moves each to its part's end.
        let mut entries = vec![Entry::default(); places.len()];
        for (idx, &hash) in (first as u32..).zip(&hashes) {
            let end = &mut ends[part(hash)];
            let hash = hash as u32;
            entries[*end as usize] = Entry { hash, idx };
            *end += 1;
        }
        Self { entries, ends }
    }

    fn part(&self, part: usize) -> &[Entry] {
        let start = part.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.entries[start as usize..self.ends[part] as usize]
    }
}

/// An open-addressing table of places, half full at most: where a general hash map needs
/// several times as long.
struct Table {
    /// The index is [`FREE`] where there is none.
    slots: Vec<Entry>,
}

const FREE: u32 = u32::MAX;

impl Table {
    /// For up to `n` different places.
    fn new(n: usize) -> Self {
        let free = Entry { hash: 0, idx: FREE };
        let n_slots = (2 * n).next_power_of_two().max(2);
        Self {
            slots: vec![free; n_slots],
        }
    }

    /// The first index at the place of `entry`, which is added if there is none.
    fn find(&mut self, entry: Entry, places: &[[u32; 3]]) -> u32 {
        let last = self.slots.len() - 1;
        let mut slot = entry.hash as usize & last;
        loop {
            let here = &mut self.slots[slot];
            if here.idx == FREE {
                *here = entry;
                return entry.idx;
            }
            let place = |entry: &Entry| places[entry.idx as usize];
            if here.hash == entry.hash && place(here) == place(&entry) {
                return here.idx;
            }
            slot = (slot + 1) & last;
        }
    }
}

/// Spreads a place over 64 bits, with the multipliers of SplitMix64 (Steele, Lea, Flood:
/// *Fast Splittable Pseudorandom Number Generators*, OOPSLA 2014).
fn mix([x, y, z]: [u32; 3]) -> u64 {
    let mut hash = u64::from(x) | u64::from(y) << 32;
    hash = (hash ^ hash >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    hash ^= u64::from(z).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    hash = (hash ^ hash >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    hash ^ hash >> 31
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    #[test]
    fn equal_places_get_the_first_index() {
        let place = |i: u32| [i % 7, i % 3, 1 << (i % 5)];
        let places: Vec<_> = (0..1000).map(place).collect();
        let first = first_at_place(&places);
        for (idx, place) in places.iter().enumerate() {
            let expected = places.iter().position(|other| other == place);
            assert_eq!(Some(first[idx] as usize), expected);
        }
        assert!(first_at_place(&[]).is_empty());
    }

    #[test]
    fn pieces_and_parts_do_not_matter() {
        let place = |i: u32| [i.wrapping_mul(i) % 50_021, i % 3, 5];
        let places: Vec<_> = (0..3 * A_PIECE as u32 + 7).map(place).collect();
        let mut seen = HashMap::new();
        let expected: Vec<u32> = (0_u32..)
            .zip(&places)
            .map(|(idx, place)| *seen.entry(*place).or_insert(idx))
            .collect();
        assert!((0..).zip(&expected).any(|(idx, first)| idx != *first));
        for n in [1, 2, 3, 8] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
            let found = pool.unwrap().install(|| first_at_place(&places));
            assert!(found == expected, "{n}");
        }
    }

    #[test]
    fn equal_hashes_are_not_equal_places() {
        let places = [[1, 2, 3], [4, 5, 6], [1, 2, 3]];
        let mut table = Table::new(3);
        let found = [0, 1, 2].map(|idx| table.find(Entry { hash: 7, idx }, &places));
        assert_eq!(found, [0, 1, 0]);
    }
}
