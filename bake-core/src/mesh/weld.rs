//! Vertices at the same place are one vertex, whatever the file says.

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

/// A slot of the table that no vertex has taken.
const FREE: u32 = u32::MAX;

/// For each place, the index of the first equal one.
///
/// An open-addressing table of indices, half full at most: the time is that of one or two
/// cache misses a vertex, where a general hash map needs ten times as long.
pub(crate) fn first_at_place(places: &[[u32; 3]]) -> Vec<u32> {
    let slots = (2 * places.len()).next_power_of_two().max(2);
    let shift = u64::BITS - slots.trailing_zeros();
    let mut table = vec![FREE; slots];
    let mut first = Vec::with_capacity(places.len());
    for (idx, place) in (0_u32..).zip(places) {
        let mut slot = (mix(*place) >> shift) as usize;
        let found = loop {
            match table[slot] {
                FREE => {
                    table[slot] = idx;
                    break idx;
                }
                other if places[other as usize] == *place => break other,
                _ => slot = (slot + 1) & (slots - 1),
            }
        };
        first.push(found);
    }
    first
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
}
