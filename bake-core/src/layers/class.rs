//! The rule: which cells are inside, and how sure that is.

use super::{LAYER_DIRECTIONS, LayerCounts, SignedLayers};

/// The position of a cell relative to the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CellClass {
    /// Whether it is inside.
    pub is_interior: bool,
    /// Whether that is a guess: the mesh is open there, or a sheet.
    pub is_doubtful: bool,
    /// Whether it is inside, and more faces point towards it than away from it: the walls of a
    /// room, or a mesh that is inside out.
    pub is_inward: bool,
}

impl SignedLayers {
    /// Classifies a cell, given whether its every texel is occluded. Strict comparisons of
    /// integers: beside a flat sheet exactly half of the directions count, and it has no inside.
    pub fn class(&self, cell: [u32; 3], is_enclosed: bool) -> CellClass {
        let counts = self.counts(cell);
        let LayerCounts {
            positive,
            negative,
            odd,
        } = counts;
        let n = LAYER_DIRECTIONS;
        let is_inside = match self.winding_is_consistent() {
            // Seven inward rooms and dishes lose least where nine in ten directions must agree;
            // three inside-out meshes still pass.
            true => 2 * positive > n || 10 * odd.max(negative) > 9 * n,
            false => 2 * odd > n,
        };
        let largest = positive.max(negative).max(odd);
        let is_interior = is_enclosed || is_inside;
        CellClass {
            is_interior,
            is_doubtful: !is_enclosed && 4 * largest > n && 4 * largest < 3 * n,
            is_inward: is_interior && negative > positive,
        }
    }
}
