//! The table with which the shader turns masks into moments.

use aogrid_bake_core::FixedTexel;

use super::gpu_data::SUBSET_SUMS;
use super::plan::Pass;

/// Returns, for each group of four bits of each batch's masks, the moments (m, a) of each of
/// the 16 subsets of these texels.
pub(super) fn subset_sums(texels: &[FixedTexel], size: u32, pass: &Pass) -> Vec<[i32; 4]> {
    let texel = |batch, bit| pass.texel_idx(size, batch, bit);
    let moment = |texel: usize| {
        let FixedTexel { a, m: [x, y, z] } = texels[texel];
        [x, y, z, a]
    };
    let bit_moment = |batch, bit| texel(batch, bit).map_or([0; 4], moment);
    let mut sums = Vec::with_capacity((pass.n_batches() * SUBSET_SUMS) as usize);
    for batch in 0..pass.n_batches() {
        for first in (0..u32::BITS).step_by(4) {
            let moments = [0, 1, 2, 3].map(|bit| bit_moment(batch, first + bit));
            sums.extend((0..16).map(|subset| subset_sum(&moments, subset)));
        }
    }
    sums
}

/// Returns the sum of the moments whose bits are set in `subset`.
fn subset_sum(moments: &[[i32; 4]; 4], subset: u32) -> [i32; 4] {
    let is_in = |(bit, moment): (u32, &[i32; 4])| (subset >> bit & 1 != 0).then_some(*moment);
    let add = |a: [i32; 4], b: [i32; 4]| std::array::from_fn(|x| a[x] + b[x]);
    (0..).zip(moments).filter_map(is_in).fold([0; 4], add)
}
