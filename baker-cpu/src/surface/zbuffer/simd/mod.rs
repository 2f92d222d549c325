//! The test of triangles at the SIMD level of the machine. Rust neither fuses nor reorders operations on
//! floats, so that all levels give the same bits.

#[cfg(target_arch = "x86_64")]
mod avx2;

use std::ops::Range;

use super::bins::Bins;
use super::triangle::{Level, Projected, Side, Test};

/// Tests all triangles against all points.
pub(super) fn test(triangles: &Projected<'_>, bins: &mut Bins) {
    #[cfg(target_arch = "x86_64")]
    if let Some(level) = avx2::Avx2::new() {
        return level.test(triangles, bins);
    }
    triangles.test(Portable, bins);
}

/// One point at a time, on any machine.
#[derive(Clone, Copy)]
struct Portable;

impl Level for Portable {
    #[inline(always)]
    fn points<const SLIVER: bool, const BOUNDED: bool>(
        self,
        test: &Test,
        side: Side,
        points: Range<usize>,
        bins: &mut Bins,
    ) {
        let Bins { x, y, z, state, .. } = bins;
        let xyz = x[points.clone()].iter().zip(&y[points.clone()]);
        let xyz = xyz.zip(&z[points.clone()]);
        for (((&x, &y), &z), state) in xyz.zip(&mut state[points]) {
            *state |= test.point::<SLIVER, BOUNDED>(side, [x, y, z]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::random_bits;
    use crate::surface::zbuffer::bins::Vertex;
    use crate::surface::zbuffer::{DOUBT, OCCLUDED};

    /// Random triangles and points, with and without a maximum distance: the states of all levels.
    #[test]
    fn levels_agree() {
        let mut bits = random_bits(3);
        let mut number = || (bits() >> 40) as f32 / (1 << 23) as f32 - 1.0;
        let mut random =
            |n| -> Vec<[f32; 3]> { (0..n).map(|_| [number(), number(), number()]).collect() };
        for reach in [f32::INFINITY, 0.3] {
            let (corners, points) = (random(200), random(400));
            let mut bins = Bins::default();
            // Points at corners are in doubt.
            for (idx, point) in (0..).zip(points.iter().chain(&corners)) {
                bins.push(idx, *point, idx % 3 == 0);
            }
            bins.sort();
            let vertices: Vec<Vertex> = corners.iter().map(|p| bins.grid.vertex(*p)).collect();
            let triangles: Vec<_> = (0..198).map(|v| [v, v + 1, v + 2]).collect();
            let projected = Projected {
                vertices: &vertices,
                triangles: &triangles,
                reach,
                fronts_alone: false,
            };
            projected.test(Portable, &mut bins);
            let expected: Vec<_> = bins.states().collect();
            assert!(
                [OCCLUDED, DOUBT]
                    .iter()
                    .all(|bit| expected.iter().any(|(_, state)| state & bit != 0))
            );
            bins.state.fill(0);
            test(&projected, &mut bins);
            assert!(bins.states().eq(expected));
        }
    }
}
