//! Silhouettes: the edges whose two half-edges do not cancel.

use aogrid_bake_core::sweep::LANES;

use crate::sweep::data::{EdgeFacing, SilhouetteSearch, TriangleFacing};

/// Searches one edge after the other. The SIMD versions are tested against this one.
#[inline(always)]
pub(in crate::sweep) fn find(search: SilhouetteSearch<'_>) {
    let rows = u16::MAX >> (LANES - search.n_rows);
    for edge in search.edges {
        let facings = search.facings_of(edge);
        let mut rows_left = rows & silhouette_rows(facings);
        while rows_left != 0 {
            let row = rows_left.trailing_zeros() as usize & (LANES - 1);
            rows_left &= rows_left - 1;
            // Rows where the oriented facings differ get the edge in their list.
            let [one, other] = edge.sides;
            let [one, other] = [
                facings[0].0[row].oriented(one),
                facings[1].0[row].oriented(other),
            ];
            let list = &mut search.lists[row];
            list.vertices.push(edge.vertices);
            list.facings.push(EdgeFacing::new(one, other));
        }
    }
}

/// Returns the texel rows where the two half-edges do not cancel.
#[inline(always)]
fn silhouette_rows([one, other]: [(&TriangleFacing, bool); 2]) -> u16 {
    let same_direction = one.1 == other.1;
    let mut rows = 0;
    for row in 0..LANES {
        let cancels = one.0[row].cancels(other.0[row], same_direction);
        rows |= u16::from(!cancels) << row;
    }
    rows
}
