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
pub(crate) fn first_at_place(places: &[[u32; 3]]) -> Vec<u32> {
    let n_parts = rayon::current_num_threads().clamp(1, MOST_PARTS);
    if n_parts == 1 || places.len() < FEW {
        return Table::new(places.len())
            .fill(places)
            .expect("it is large enough");
    }
    // Equal places have equal hashes, so that parts by hash have nothing to do with each other.
    let first: Vec<AtomicU32> = places.par_iter().map(|_| AtomicU32::new(0)).collect();
    let all_fit = (0..n_parts).into_par_iter().all(|part| {
        let mut table = Table::new(2 * places.len() / n_parts);
        (0_u32..).zip(places).all(|(idx, place)| {
            let hash = mix(*place);
            if hash as usize % n_parts != part {
                return true;
            }
            let found = table.find(hash, idx, places);
            found
                .map(|found| first[idx as usize].store(found, Ordering::Relaxed))
                .is_some()
        })
    });
    if !all_fit {
        // Hashes as uneven as this do not come by chance.
        return Table::new(places.len())
            .fill(places)
            .expect("it is large enough");
    }
    first.into_iter().map(AtomicU32::into_inner).collect()
}

/// Places up to which several threads are not worth it.
const FEW: usize = 1 << 14;

/// More parts than this would look at the places more often than it saves.
const MOST_PARTS: usize = 8;

/// A slot of the table that no vertex has taken.
const FREE: u32 = u32::MAX;

/// An open-addressing table of indices, half full at most: the time is that of one or two cache
/// misses a vertex, where a general hash map needs ten times as long.
struct Table {
    slots: Vec<u32>,
    shift: u32,
    left: usize,
}

impl Table {
    /// For up to `n` different places.
    fn new(n: usize) -> Self {
        let n_slots = (2 * n).next_power_of_two().max(2);
        Self {
            slots: vec![FREE; n_slots],
            shift: u64::BITS - n_slots.trailing_zeros(),
            left: n_slots / 2,
        }
    }

    /// The first index at the place of `idx`, which is added if there is none; nothing if the
    /// table is too full for that.
    fn find(&mut self, hash: u64, idx: u32, places: &[[u32; 3]]) -> Option<u32> {
        let mut slot = (hash >> self.shift) as usize;
        loop {
            match self.slots[slot] {
                FREE => break,
                other if places[other as usize] == places[idx as usize] => return Some(other),
                _ => slot = (slot + 1) & (self.slots.len() - 1),
            }
        }
        self.left = self.left.checked_sub(1)?;
        self.slots[slot] = idx;
        Some(idx)
    }

    fn fill(mut self, places: &[[u32; 3]]) -> Option<Vec<u32>> {
        (0_u32..)
            .zip(places)
            .map(|(idx, place)| self.find(mix(*place), idx, places))
            .collect()
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
    fn threads_do_not_matter() {
        let place = |i: u32| [i.wrapping_mul(i) % 20_011, i % 3, 5];
        let places: Vec<_> = (0..2 * FEW as u32).map(place).collect();
        let with_threads = |n: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
            pool.unwrap().install(|| first_at_place(&places))
        };
        let one = with_threads(1);
        assert!((0..).zip(&one).any(|(idx, first)| idx != *first));
        for n in [2, 3, 8] {
            assert!(with_threads(n) == one, "{n}");
        }
    }

    #[test]
    fn a_table_that_is_too_small_says_so() {
        let places: Vec<_> = (0..100).map(|i| [i, 0, 0]).collect();
        assert_eq!(Table::new(50).fill(&places), None);
        assert!(Table::new(100).fill(&places).is_some());
    }
}
