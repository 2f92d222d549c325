//! The AVX2 level: eight points at once, by the operations of [`Test::point`] in their order.

#![allow(
    unsafe_code,
    reason = "the value of the SIMD level proves that the CPU has these instructions"
)]

use std::arch::x86_64::*;
use std::ops::Range;

use crate::surface::zbuffer::bins::{Bins, LANES};
use crate::surface::zbuffer::triangle::{Level, Projected, Side, Test};
use crate::surface::zbuffer::{DOUBT, OCCLUDED};

/// A proof that the machine has AVX2.
#[derive(Clone, Copy)]
pub(super) struct Avx2(());

impl Avx2 {
    pub(super) fn new() -> Option<Self> {
        is_x86_feature_detected!("avx2").then_some(Self(()))
    }

    pub(super) fn test(self, triangles: &Projected<'_>, bins: &mut Bins) {
        #[target_feature(enable = "avx2")]
        fn test(level: Avx2, triangles: &Projected<'_>, bins: &mut Bins) {
            triangles.test(level, bins);
        }
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { test(self, triangles, bins) }
    }
}

impl Level for Avx2 {
    #[inline(always)]
    fn points<const SLIVER: bool, const BOUNDED: bool>(
        self,
        test: &Test,
        side: Side,
        points: Range<usize>,
        bins: &mut Bins,
    ) {
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { test_points::<SLIVER, BOUNDED>(test, side, points, bins) }
    }
}

#[target_feature(enable = "avx2")]
#[inline]
fn load(lanes: &[f32], from: usize) -> __m256 {
    let lanes = &lanes[from..from + LANES];
    // SAFETY: the slice has eight floats, which need not be aligned.
    unsafe { _mm256_loadu_ps(lanes.as_ptr()) }
}

/// Adds bits to the states of eight points.
#[target_feature(enable = "avx2")]
#[inline]
fn add(state: &mut [u32], from: usize, bits: __m256i) {
    let lanes = &mut state[from..from + LANES];
    // SAFETY: the slice has eight integers, which need not be aligned.
    unsafe {
        let old = _mm256_loadu_si256(lanes.as_ptr().cast());
        _mm256_storeu_si256(lanes.as_mut_ptr().cast(), _mm256_or_si256(old, bits));
    }
}

/// The comparisons of two vectors, without exceptions for NaN, which none is.
#[target_feature(enable = "avx2")]
#[inline]
fn less(a: __m256, b: __m256) -> __m256 {
    _mm256_cmp_ps::<_CMP_LT_OQ>(a, b)
}

#[target_feature(enable = "avx2")]
#[inline]
fn test_points<const SLIVER: bool, const BOUNDED: bool>(
    test: &Test,
    side: Side,
    points: Range<usize>,
    bins: &mut Bins,
) {
    let set = |v: f32| _mm256_set1_ps(v);
    let (mul, sub) = (_mm256_mul_ps, _mm256_sub_ps);
    let iota = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    let [bound, below] = [set(test.edge_bound), set(-test.edge_bound)];
    let det = set(test.det);
    for from in points.clone().step_by(LANES) {
        let x = sub(load(&bins.x, from), set(test.a[0]));
        let y = sub(load(&bins.y, from), set(test.a[1]));
        let z = sub(load(&bins.z, from), set(side.a));
        let v = sub(mul(x, set(test.c[1])), mul(y, set(test.c[0])));
        let w = sub(mul(set(test.b[0]), y), mul(set(test.b[1]), x));
        let u = sub(sub(det, v), w);
        let smallest = _mm256_min_ps(_mm256_min_ps(u, v), w);
        let outside = less(smallest, below);
        let (miss, hit) = if SLIVER {
            let largest = _mm256_max_ps(_mm256_max_ps(u, v), w);
            let mixed = _mm256_and_ps(outside, less(bound, largest));
            (mixed, _mm256_setzero_ps())
        } else {
            let along = _mm256_add_ps(mul(v, set(side.b)), mul(w, set(side.c)));
            let depth = sub(along, mul(z, det));
            let size = _mm256_andnot_ps(set(-0.0), z);
            let [base, growth] = test.depth_bound.map(|v| _mm256_set1_ps(v));
            let depth_bound = _mm256_add_ps(base, mul(growth, size));
            let before = less(depth, sub(_mm256_setzero_ps(), depth_bound));
            let behind = less(depth_bound, depth);
            let mut miss = _mm256_or_ps(outside, before);
            let mut hit = _mm256_and_ps(less(bound, smallest), behind);
            if BOUNDED {
                let [reach, reach_bound] = test.reach.map(|v| _mm256_set1_ps(v));
                let margin = _mm256_add_ps(depth_bound, reach_bound);
                miss = _mm256_or_ps(miss, less(_mm256_add_ps(reach, margin), depth));
                hit = _mm256_and_ps(hit, less(depth, sub(reach, margin)));
            }
            (miss, hit)
        };
        // Lanes beyond the row belong to other cells.
        let n = _mm256_set1_epi32((points.end - from) as i32);
        let is_in_row = _mm256_cmpgt_epi32(n, iota);
        let occluded = _mm256_and_si256(_mm256_castps_si256(hit), set_bits(OCCLUDED));
        let known = _mm256_castps_si256(_mm256_or_ps(miss, hit));
        let doubt = _mm256_andnot_si256(known, set_bits(DOUBT));
        let bits = _mm256_and_si256(is_in_row, _mm256_or_si256(occluded, doubt));
        add(&mut bins.state, from, bits);
    }
}

#[target_feature(enable = "avx2")]
#[inline]
fn set_bits(bits: u32) -> __m256i {
    _mm256_set1_epi32(bits as i32)
}
