//! Compression: moving the selected lanes of a register to its front.

use std::arch::x86_64::*;

use super::LANES;

/// The indices of the selected lanes, in order, for each set of lanes.
static SELECTED: [[u8; LANES]; 1 << LANES] = selected();

const fn selected() -> [[u8; LANES]; 1 << LANES] {
    let mut table = [[0; LANES]; 1 << LANES];
    let mut set = 0;
    while set < table.len() {
        let (mut n, mut lane) = (0, 0);
        while lane < LANES {
            if set >> lane & 1 != 0 {
                table[set][n] = lane as u8;
                n += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
}

/// Selected lanes, as the order that moves them to the front.
#[derive(Clone, Copy)]
pub(super) struct Selected(__m256i);

impl Selected {
    #[target_feature(enable = "avx2")]
    #[inline]
    pub(super) fn new(lanes: u32) -> Self {
        let order = u64::from_le_bytes(SELECTED[lanes as usize & (SELECTED.len() - 1)]);
        Self(_mm256_cvtepu8_epi32(_mm_cvtsi64_si128(order.cast_signed())))
    }

    /// Returns the selected lanes first. The others are undefined.
    #[target_feature(enable = "avx2")]
    #[inline]
    pub(super) fn front(self, lanes: __m256i) -> __m256i {
        _mm256_permutevar8x32_epi32(lanes, self.0)
    }
}
