//! The binary occlusion images around each cell, for inspection and comparison.

/// The occluded texels of every cell, one bit per texel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaceBits {
    texels: usize,
    words: usize,
    bits: Vec<u64>,
}

impl FaceBits {
    /// Creates unoccluded images for `cells` cells with six faces of `size`² texels.
    pub fn new(cells: usize, size: u32) -> Self {
        let texels = (crate::cube_face::FACES * size * size) as usize;
        let words = texels.div_ceil(64);
        Self {
            texels,
            words,
            bits: vec![0; words * cells],
        }
    }

    /// Returns the number of texels per cell.
    pub fn texels(&self) -> usize {
        self.texels
    }

    /// Returns the number of cells.
    pub fn cells(&self) -> usize {
        self.bits.len() / self.words
    }

    /// Whether a texel, numbered as in [`texels`](crate::cube_face::texels), is occluded.
    ///
    /// # Panics
    ///
    /// If there is no such cell or texel.
    pub fn get(&self, cell_idx: usize, texel: usize) -> bool {
        assert!(texel < self.texels);
        self.bits[cell_idx * self.words + texel / 64] >> (texel % 64) & 1 != 0
    }

    /// Marks a texel as occluded.
    ///
    /// # Panics
    ///
    /// If there is no such cell or texel.
    pub fn set(&mut self, cell_idx: usize, texel: usize) {
        assert!(texel < self.texels);
        self.bits[cell_idx * self.words + texel / 64] |= 1 << (texel % 64);
    }

    /// Returns cell and texel of every difference between two sets of images of the same shape.
    ///
    /// # Panics
    ///
    /// If the shapes differ.
    pub fn differences(&self, other: &Self) -> Vec<(usize, usize)> {
        assert_eq!(
            (self.texels, self.bits.len()),
            (other.texels, other.bits.len())
        );
        let mut found = Vec::new();
        for (word, (a, b)) in self.bits.iter().zip(&other.bits).enumerate() {
            let mut differing = a ^ b;
            while differing != 0 {
                let texel = word % self.words * 64 + differing.trailing_zeros() as usize;
                found.push((word / self.words, texel));
                // Clears the lowest bit.
                differing &= differing - 1;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_difference_is_found() {
        let mut a = FaceBits::new(5, 9);
        let mut b = a.clone();
        assert_eq!((a.cells(), a.texels()), (5, 486));
        for (cell, texel) in [(0, 0), (3, 485), (4, 63), (4, 64)] {
            a.set(cell, texel);
            assert!(a.get(cell, texel) && !b.get(cell, texel));
        }
        b.set(4, 63);
        b.set(2, 100);
        let expected = [(0, 0), (2, 100), (3, 485), (4, 64)];
        assert_eq!(a.differences(&b), expected);
        assert!(a.differences(&a).is_empty());
    }
}
