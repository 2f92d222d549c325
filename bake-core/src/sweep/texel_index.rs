//! The texels of a mask's bits.

use crate::cube_face;

/// The number of directions in a block, a part of a texel row: what one wide register holds. A mask
/// has a bit for each of them, and then one for each opposite direction.
pub const LANES: usize = 16;

/// Returns the index of the texel of a bit of a mask, or `None` for a lane beyond the end of the
/// texel row. The mask is that of the axis `w`, the texel row `b` and a block of it; `size` is the
/// number of texels along a face's side.
#[inline]
pub fn texel_idx(size: u32, w: usize, b: u32, block: usize, bit: usize) -> Option<usize> {
    let z = (block * LANES + bit % LANES) as u32;
    let opposite = |i: u32| size - 1 - i;
    (z < size).then(|| match bit < LANES {
        true => cube_face::texel_idx(size, w, true, [z, b]),
        // The upper half of a mask holds the opposite directions, on the opposite face.
        false => cube_face::texel_idx(size, w, false, [opposite(z), opposite(b)]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_texel_has_one_bit_and_opposite_bits_opposite_directions() {
        for size in [8, 16, 21] {
            let texels = cube_face::texels(size);
            let mut seen = vec![false; texels.len()];
            let blocks = (size as usize).div_ceil(LANES);
            for (w, b) in (0..3).flat_map(|w| (0..size).map(move |b| (w, b))) {
                for (block, lane) in (0..blocks).flat_map(|i| (0..LANES).map(move |l| (i, l))) {
                    let texel = |bit| texel_idx(size, w, b, block, bit);
                    let (Some(one), Some(other)) = (texel(lane), texel(lane + LANES)) else {
                        assert!(block * LANES + lane >= size as usize);
                        continue;
                    };
                    for idx in [one, other] {
                        assert!(!seen[idx]);
                        seen[idx] = true;
                    }
                    let [d, opposite] = [one, other].map(|idx| texels[idx].direction);
                    for x in 0..3 {
                        assert!((d[x] + opposite[x]).abs() < 1e-12, "{d:?} {opposite:?}");
                    }
                }
            }
            assert!(seen.iter().all(|seen| *seen), "{size}");
        }
    }
}
