//! Welding: vertices at exactly the same position become one vertex.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use super::TriangleMesh;

/// Returns triangles over welded vertices: corners at exactly the same position have the same
/// index, that of the first vertex at this position.
pub(super) fn weld(mesh: &TriangleMesh) -> Vec<[u32; 3]> {
    // Adding zero turns −0 into +0, which are the same position.
    let bits = |p: &[f32; 3]| p.map(|v| (v + 0.0).to_bits());
    let keys: Vec<[u32; 3]> = mesh.positions().iter().map(bits).collect();
    let welded = first_duplicate(&keys);
    let renumber = |vertex: u32| welded[vertex as usize];
    mesh.triangles().iter().map(|t| t.map(renumber)).collect()
}

/// Returns, for each key, the index of the first equal key. Uses all threads; the result does not
/// depend on their number.
///
/// Keys are partitioned by hash, so that equal keys are in the same partition and each partition's
/// table fits the L1 cache; a single large table would miss the cache on every look-up.
pub(crate) fn first_duplicate(keys: &[[u32; 3]]) -> Vec<u32> {
    let n_partitions = (keys.len() / KEYS_PER_PARTITION).max(1).next_power_of_two();
    let chunks: Vec<Partitioned> = keys
        .par_chunks(CHUNK_LEN)
        .enumerate()
        .map(|(chunk, keys)| Partitioned::new(keys, chunk * CHUNK_LEN, n_partitions))
        .collect();
    // Each partition writes only the entries of its own keys, so that relaxed stores suffice.
    let first: Vec<AtomicU32> = (0..keys.len() as u32).map(AtomicU32::new).collect();
    (0..n_partitions)
        .into_par_iter()
        .with_min_len(4)
        .for_each(|partition| {
            // The chunks are in key order, so that the first key found is the first of all.
            let entries = chunks.iter().flat_map(|chunk| chunk.partition(partition));
            let lengths = chunks.iter().map(|chunk| chunk.partition(partition).len());
            let mut table = Table::new(lengths.sum());
            for entry in entries {
                let found = table.find(*entry, keys);
                if found != entry.idx {
                    first[entry.idx as usize].store(found, Ordering::Relaxed);
                }
            }
        });
    first.into_iter().map(AtomicU32::into_inner).collect()
}

/// Keys in a partition, on average: its table is 32 kB.
const KEYS_PER_PARTITION: usize = 1 << 11;

/// Keys that one task partitions.
const CHUNK_LEN: usize = 1 << 15;

/// The index of a key, and 32 bits of its hash, which distinguish most keys that differ.
#[derive(Clone, Copy, Default)]
struct Entry {
    hash: u32,
    idx: u32,
}

/// A chunk of keys, sorted by partition; each partition is in key order.
struct Partitioned {
    entries: Vec<Entry>,
    /// The end of each partition within `entries`.
    ends: Vec<u32>,
}

impl Partitioned {
    fn new(keys: &[[u32; 3]], first: usize, n_partitions: usize) -> Self {
        let partition = |hash: u64| (hash >> 32) as usize & (n_partitions - 1);
        let hashes: Vec<u64> = keys.iter().map(|key| mix(*key)).collect();
        let mut ends = vec![0; n_partitions];
        for hash in &hashes {
            ends[partition(*hash)] += 1;
        }
        // A counting sort: an exclusive prefix sum turns the counts into starts.
        let mut before = 0;
        for end in &mut ends {
            before += std::mem::replace(end, before);
        }
        // Each insertion advances the start of its partition, which ends up as the end.
        let mut entries = vec![Entry::default(); keys.len()];
        for (idx, &hash) in (first as u32..).zip(&hashes) {
            let end = &mut ends[partition(hash)];
            let hash = hash as u32;
            entries[*end as usize] = Entry { hash, idx };
            *end += 1;
        }
        Self { entries, ends }
    }

    fn partition(&self, idx: usize) -> &[Entry] {
        let start = idx.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.entries[start as usize..self.ends[idx] as usize]
    }
}

/// An open-addressing hash table of keys with linear probing, at most half full. A general hash map
/// takes several times as long.
struct Table {
    /// Entries; the index of an empty slot is [`FREE`].
    slots: Vec<Entry>,
}

const FREE: u32 = u32::MAX;

impl Table {
    /// Creates a table for up to `n` different keys.
    fn new(n: usize) -> Self {
        let free = Entry { hash: 0, idx: FREE };
        let n_slots = (2 * n).next_power_of_two().max(2);
        Self {
            slots: vec![free; n_slots],
        }
    }

    /// Returns the index of the key in the table that equals the key of `entry`. Inserts `entry`
    /// and returns its own index if there is none.
    fn find(&mut self, entry: Entry, keys: &[[u32; 3]]) -> u32 {
        let mask = self.slots.len() - 1;
        let mut idx = entry.hash as usize & mask;
        loop {
            let slot = &mut self.slots[idx];
            if slot.idx == FREE {
                *slot = entry;
                return entry.idx;
            }
            let key = |entry: &Entry| keys[entry.idx as usize];
            if slot.hash == entry.hash && key(slot) == key(&entry) {
                return slot.idx;
            }
            idx = (idx + 1) & mask;
        }
    }
}

/// Hashes a key to 64 bits with the multipliers of SplitMix64 (Steele, Lea, Flood: *Fast Splittable
/// Pseudorandom Number Generators*, OOPSLA 2014).
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
    fn equal_keys_get_the_first_index() {
        let key = |i: u32| [i % 7, i % 3, 1 << (i % 5)];
        let keys: Vec<_> = (0..1000).map(key).collect();
        let first = first_duplicate(&keys);
        for (idx, key) in keys.iter().enumerate() {
            let expected = keys.iter().position(|other| other == key);
            assert_eq!(Some(first[idx] as usize), expected);
        }
        assert!(first_duplicate(&[]).is_empty());
    }

    #[test]
    fn the_result_does_not_depend_on_chunks_partitions_or_threads() {
        let key = |i: u32| [i.wrapping_mul(i) % 50_021, i % 3, 5];
        let keys: Vec<_> = (0..3 * CHUNK_LEN as u32 + 7).map(key).collect();
        let mut seen = HashMap::new();
        let expected: Vec<u32> = (0_u32..)
            .zip(&keys)
            .map(|(idx, key)| *seen.entry(*key).or_insert(idx))
            .collect();
        assert!((0..).zip(&expected).any(|(idx, first)| idx != *first));
        for n in [1, 2, 3, 8] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
            let found = pool.unwrap().install(|| first_duplicate(&keys));
            assert!(found == expected, "{n}");
        }
    }

    #[test]
    fn different_keys_with_equal_hashes_are_told_apart() {
        let keys = [[1, 2, 3], [4, 5, 6], [1, 2, 3]];
        let mut table = Table::new(3);
        let found = [0, 1, 2].map(|idx| table.find(Entry { hash: 7, idx }, &keys));
        assert_eq!(found, [0, 1, 0]);
    }
}
