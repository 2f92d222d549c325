//! The facings of triangles and of edges: for which directions of a texel row they face d.

use aogrid_bake_core::prepared::HalfEdge;
use aogrid_bake_core::sweep::LANES;

/// The directions of a texel row that a triangle faces: n·d is linear in the texel's index z and
/// changes its sign once. Bits 0–6: the flip texel, the first z of the second part (never `size`
/// itself: an empty second part is stored as an empty first part with bit 7 inverted). Bit 7: set
/// if the first part faces d and the second faces away.
///
/// It is computed once for each triangle and texel row, so that all edges of a triangle agree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub(in crate::sweep) struct FacingInterval(u8);

const FRONT_FIRST: u8 = 1 << 7;

impl FacingInterval {
    /// Returns the interval of a flip texel and of whether the first part faces d.
    #[inline(always)]
    pub(in crate::sweep) fn new(flip_texel: u8, front_first: bool) -> Self {
        Self(flip_texel | u8::from(front_first) << 7)
    }

    /// Whether two half-edges with these facings cancel: they have opposite signs, or the same if
    /// they run along the edge in opposite directions.
    #[inline(always)]
    pub(in crate::sweep) fn cancels(self, other: Self, same_direction: bool) -> bool {
        self.0 ^ other.0 == if same_direction { FRONT_FIRST } else { 0 }
    }

    /// Returns the first texel of the second part.
    #[inline(always)]
    fn flip_texel(self) -> u8 {
        self.0 & !FRONT_FIRST
    }

    /// Returns +1 where n·d > 0, else −1.
    #[cfg(test)]
    pub(in crate::sweep) fn sign(self, z: u8) -> i8 {
        let front_first = (self.0 & FRONT_FIRST) >> 7;
        let front = u8::from(z >= self.flip_texel()) ^ front_first;
        (2 * front).cast_signed() - 1
    }

    /// Returns the lanes of a block where n·d > 0.
    #[inline(always)]
    pub(in crate::sweep) fn front_lanes(self, block: usize) -> u16 {
        let flip_texel = u32::from(self.flip_texel()).saturating_sub((block * LANES) as u32);
        let second = (0xffff_u32 << flip_texel.min(LANES as u32)) as u16;
        let front_first = self.0 & FRONT_FIRST != 0;
        if front_first { !second } else { second }
    }

    /// Returns the sign times that of the half-edge's direction: what it adds to an edge's sum.
    #[inline(always)]
    pub(in crate::sweep) fn oriented(self, half_edge: HalfEdge) -> Self {
        Self(self.0 ^ u8::from(half_edge.is_reversed()) << 7)
    }
}

/// The facing of a triangle, for each of [`LANES`] texel rows of a face.
pub(in crate::sweep) type TriangleFacing = [FacingInterval; LANES];

/// The oriented facings of an edge's two triangles, in bits 0–7 and 8–15.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub(in crate::sweep) struct EdgeFacing(u16);

impl EdgeFacing {
    #[inline(always)]
    pub(in crate::sweep) fn new(one: FacingInterval, other: FacingInterval) -> Self {
        Self(u16::from_le_bytes([one.0, other.0]))
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub(in crate::sweep) fn bits(self) -> u16 {
        self.0
    }

    #[inline(always)]
    pub(in crate::sweep) fn intervals(self) -> [FacingInterval; 2] {
        self.0.to_le_bytes().map(FacingInterval)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facing_interval_stores_flip_texel_and_first_sign() {
        let facing = |flip_texel: u8, first: u8| FacingInterval::new(flip_texel, first != 0);
        assert_eq!(facing(3, 0).flip_texel(), 3);
        let signs = |f: FacingInterval| [0, 2, 3, 15].map(|z| f.sign(z));
        assert_eq!(signs(facing(3, 0)), [-1, -1, 1, 1]);
        assert_eq!(signs(facing(3, 1)), [1, 1, -1, -1]);
        assert_eq!(signs(facing(0, 0)), [1; 4]);
    }
}
