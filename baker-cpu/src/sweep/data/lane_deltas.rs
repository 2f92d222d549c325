//! The lanes of a block whose layer counts change at a crossing.

use aogrid_bake_core::sweep::AxisFrame;

use super::facing::FacingInterval;

/// The lanes of a block that have a delta, and its sign.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::sweep) struct LaneDeltas {
    pub active: u16,
    /// The active lanes whose layer count decreases.
    pub negative: u16,
}

impl LaneDeltas {
    /// Returns the layer changes from an edge's crossing on, for the directions of a block. Each of
    /// its two triangles adds a layer to the right of the triangle's left edge and removes it to
    /// the right of its right edge. Seen along d, a triangle with n·d > 0 has the edges that go
    /// `up` (in V − b·W) at its right. The triangle of a boundary edge is given twice.
    #[inline(always)]
    pub(in crate::sweep) fn new(
        facings: [FacingInterval; 2],
        up: bool,
        frame: &AxisFrame,
        block: usize,
    ) -> Self {
        let [one, other] = [facings[0].front_lanes(block), facings[1].front_lanes(block)];
        let active = !(one ^ other) & frame.lanes(block);
        let negative = if up { one } else { !one };
        Self { active, negative }
    }
}
