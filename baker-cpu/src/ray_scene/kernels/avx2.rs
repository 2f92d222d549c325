//! The AVX2 level: eight lanes in a register, and fused multiply-adds.
//!
//! Fusing changes roundings, and so which triangles are in doubt. It changes no answer: the boxes'
//! padding and the error bounds hold with it and without it.

#![allow(
    unsafe_code,
    reason = "the value of the SIMD level proves that the CPU has these instructions"
)]

use std::arch::x86_64::*;
use std::mem::transmute;

use super::{Kernel, LeafHits, Query};
use crate::ray_scene::packed_ray::{DET_BY_AREA, DET_BY_DET, PackedRay};
use crate::ray_scene::tree::{Child, Lanes, Leaf, Node, Tree};

/// A proof that the machine has AVX2, FMA and the extensions before them.
#[derive(Clone, Copy, Debug)]
pub(in crate::ray_scene) struct Avx2(());

impl Avx2 {
    pub(super) fn new() -> Option<Self> {
        let has_all = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("popcnt")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2");
        has_all.then_some(Self(()))
    }

    #[inline(always)]
    pub(super) fn run<Q: Query>(self, query: Q) -> Q::Answer {
        #[target_feature(enable = "avx2,fma,popcnt,bmi1,bmi2")]
        fn run<Q: Query>(query: Q, avx2: Avx2) -> Q::Answer {
            query.run(avx2)
        }
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { run(query, self) }
    }
}

impl Kernel for Avx2 {
    #[inline(always)]
    fn boxes(self, node: &Node, ray: &PackedRay, distances: &mut Lanes) -> u32 {
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { boxes(node, ray, distances) }
    }

    #[inline(always)]
    fn prefetch(self, tree: &Tree, child: u32) {
        match Child::new(child) {
            Child::Node(node) => prefetch(&tree.nodes[node as usize]),
            Child::Leaf(leaf) => prefetch(&tree.leaves[leaf as usize]),
        }
    }

    #[inline(always)]
    fn triangles(self, leaf: &Leaf, ray: &PackedRay) -> LeafHits {
        // SAFETY: a value of `Avx2` exists only on machines that have it.
        unsafe { triangles(leaf, ray) }
    }
}

/// Loads the cache lines of a value.
#[inline(always)]
fn prefetch<T>(value: &T) {
    let lines = std::ptr::from_ref(value).cast::<[i8; 64]>();
    for line in 0..size_of::<T>().div_ceil(64) {
        // SAFETY: prefetching has no effect but on the cache, whatever the address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(lines.wrapping_add(line).cast()) };
    }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn load(lanes: &Lanes) -> __m256 {
    // SAFETY: both are eight floats.
    unsafe { transmute::<Lanes, __m256>(*lanes) }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn boxes(node: &Node, ray: &PackedRay, distances: &mut Lanes) -> u32 {
    let mut enters = _mm256_setzero_ps();
    let mut exits = _mm256_set1_ps(ray.t_max);
    for axis in 0..3 {
        let inverse = _mm256_set1_ps(ray.inverse[axis]);
        let start = _mm256_set1_ps(ray.start_by_direction[axis]);
        let near = load(&node.planes[ray.near[axis]]);
        let far = load(&node.planes[ray.far[axis]]);
        enters = _mm256_max_ps(enters, _mm256_fmsub_ps(near, inverse, start));
        exits = _mm256_min_ps(exits, _mm256_fmsub_ps(far, inverse, start));
    }
    // SAFETY: as `load`.
    *distances = unsafe { transmute::<__m256, Lanes>(enters) };
    mask(_mm256_cmp_ps::<_CMP_LE_OQ>(enters, exits))
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn mask(lanes: __m256) -> u32 {
    _mm256_movemask_ps(lanes).cast_unsigned()
}

/// Returns corners in the ray's sheared space: along the major axis, then across the ray.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn sheared(corner: &[Lanes; 3], ray: &PackedRay) -> [__m256; 3] {
    let [along, u, v] = ray.axes.map(|axis| load(&corner[axis]));
    let across = |lanes, n: usize| {
        let skewed = _mm256_fnmadd_ps(_mm256_set1_ps(ray.shear[n]), along, lanes);
        _mm256_sub_ps(skewed, _mm256_set1_ps(ray.start[1 + n]))
    };
    let along_start = _mm256_set1_ps(ray.start[0]);
    [
        _mm256_sub_ps(along, along_start),
        across(u, 0),
        across(v, 1),
    ]
}

/// Returns twice the signed areas of the triangles of the origin, `p` and `q`.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn area(p: [__m256; 3], q: [__m256; 3]) -> __m256 {
    _mm256_fmsub_ps(p[1], q[2], _mm256_mul_ps(p[2], q[1]))
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn max3(a: __m256, b: __m256, c: __m256) -> __m256 {
    _mm256_max_ps(_mm256_max_ps(a, b), c)
}

/// Returns the largest magnitude of three numbers.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn size(a: __m256, b: __m256, c: __m256) -> __m256 {
    let sign = _mm256_set1_ps(-0.0);
    max3(
        _mm256_andnot_ps(sign, a),
        _mm256_andnot_ps(sign, b),
        _mm256_andnot_ps(sign, c),
    )
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn negated(x: __m256) -> __m256 {
    _mm256_xor_ps(x, _mm256_set1_ps(-0.0))
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn is_above(x: __m256, y: __m256) -> __m256 {
    _mm256_cmp_ps::<_CMP_GT_OQ>(x, y)
}

/// Returns c₀ + c₁x.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn linear(c: &[f32; 2], x: __m256) -> __m256 {
    _mm256_fmadd_ps(_mm256_set1_ps(c[1]), x, _mm256_set1_ps(c[0]))
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn triangles(leaf: &Leaf, ray: &PackedRay) -> LeafHits {
    let a = sheared(&leaf.corners[0], ray);
    let b = sheared(&leaf.corners[1], ray);
    let c = sheared(&leaf.corners[2], ray);
    let (u, v, w) = (area(c, b), area(a, c), area(b, a));
    let size_across = _mm256_max_ps(size(a[1], b[1], c[1]), size(a[2], b[2], c[2]));
    let bounds = &ray.errors;
    let error = _mm256_fmadd_ps(
        size_across,
        linear(&bounds.area_by_size, size_across),
        _mm256_set1_ps(bounds.area),
    );
    let most = max3(u, v, w);
    let least = _mm256_min_ps(_mm256_min_ps(u, v), w);
    // Most triangles are missed beside the ray.
    let has_positive = is_above(most, error);
    let has_negative = is_above(negated(error), least);
    let beside = _mm256_and_ps(has_positive, has_negative);
    let candidates = !mask(beside) & leaf.used;
    if candidates == 0 {
        return LeafHits {
            certain: 0,
            doubt: 0,
        };
    }
    let inside = _mm256_or_ps(is_above(least, error), is_above(negated(error), most));
    let along = _mm256_fmadd_ps(u, a[0], _mm256_fmadd_ps(v, b[0], _mm256_mul_ps(w, c[0])));
    let distances = Distances {
        t: _mm256_mul_ps(_mm256_set1_ps(ray.scale), along),
        det: _mm256_add_ps(_mm256_add_ps(u, v), w),
        area_error: error,
        size_along: size(a[0], b[0], c[0]),
    };
    let (within, beyond) = distances.compare(ray);
    let certain = candidates & mask(_mm256_and_ps(inside, within));
    LeafHits {
        certain,
        doubt: candidates & !certain & !mask(beyond),
    }
}

/// The distances t/det of eight triangles, and what the bounds of their errors depend on.
struct Distances {
    t: __m256,
    det: __m256,
    area_error: __m256,
    size_along: __m256,
}

impl Distances {
    /// Returns which distances are certainly between the start and the end of the ray, and which
    /// are certainly not.
    #[target_feature(enable = "avx2,fma")]
    #[inline]
    fn compare(&self, ray: &PackedRay) -> (__m256, __m256) {
        // Make det positive for both windings, so that the triangle is two-sided.
        let sign = _mm256_and_ps(self.det, _mm256_set1_ps(-0.0));
        let (t, det) = (_mm256_xor_ps(self.t, sign), _mm256_xor_ps(self.det, sign));
        let bounds = &ray.errors;
        let t_error = _mm256_fmadd_ps(
            linear(&bounds.t_by_det, self.size_along),
            det,
            _mm256_mul_ps(linear(&bounds.t_by_area, self.size_along), self.area_error),
        );
        let det_error = _mm256_fmadd_ps(
            _mm256_set1_ps(DET_BY_AREA),
            self.area_error,
            _mm256_mul_ps(_mm256_set1_ps(DET_BY_DET), det),
        );
        let (before, after) = (_mm256_set1_ps(ray.before), _mm256_set1_ps(ray.after));
        let after_size = _mm256_andnot_ps(_mm256_set1_ps(-0.0), after);
        let ahead = _mm256_fmadd_ps(before, det, t);
        let ahead_error = _mm256_fmadd_ps(before, det_error, t_error);
        let left = _mm256_fmsub_ps(after, det, t);
        let left_error = _mm256_fmadd_ps(after_size, det_error, t_error);
        (
            _mm256_and_ps(is_above(ahead, ahead_error), is_above(left, left_error)),
            _mm256_or_ps(
                is_above(negated(ahead_error), ahead),
                is_above(negated(left_error), left),
            ),
        )
    }
}
