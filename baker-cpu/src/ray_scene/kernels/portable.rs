//! The code for every machine, which the AVX2 version is tested against.

use super::{Kernel, LeafHits};
use crate::ray_scene::packed_ray::PackedRay;
use crate::ray_scene::tree::{Lanes, Leaf, Node, WIDTH};

/// The level that every machine has.
#[derive(Clone, Copy, Debug)]
pub(in crate::ray_scene) struct Portable;

impl Kernel for Portable {
    #[inline(always)]
    fn boxes(self, node: &Node, ray: &PackedRay, distances: &mut Lanes) -> u32 {
        let mut exits = [ray.t_max; WIDTH];
        *distances = [0.0; WIDTH];
        for axis in 0..3 {
            let (inverse, start) = (ray.inverse[axis], ray.start_by_direction[axis]);
            let [near, far] = [ray.near[axis], ray.far[axis]].map(|plane| &node.planes[plane]);
            for lane in 0..WIDTH {
                distances[lane] = max(distances[lane], near[lane] * inverse - start);
                exits[lane] = min(exits[lane], far[lane] * inverse - start);
            }
        }
        bits(|lane| distances[lane] <= exits[lane])
    }

    #[inline(always)]
    fn triangles(self, leaf: &Leaf, ray: &PackedRay) -> LeafHits {
        let [a, b, c] = leaf.corners.each_ref().map(|corner| sheared(corner, ray));
        let areas = [area(&c, &b), area(&a, &c), area(&b, &a)];
        let (mut certain, mut doubt) = (0, 0);
        for lane in 0..WIDTH {
            let [along_max, across_max] = sizes([&a, &b, &c], lane);
            let e = ray.errors.of_areas(across_max);
            let [u, v, w] = [0, 1, 2].map(|n| areas[n][lane]);
            let det = u + v + w;
            let t = ray.scale * (u * a[0][lane] + v * b[0][lane] + w * c[0][lane]);
            let (t, det) = if det < 0.0 { (-t, -det) } else { (t, det) };
            let [t_error, det_error] = ray.errors.of_distance(e, det, along_max);
            let (least, most) = (min(min(u, v), w), max(max(u, v), w));
            let ahead = t + ray.before * det;
            let ahead_error = t_error + ray.before * det_error;
            let left = ray.after * det - t;
            let left_error = t_error + ray.after.abs() * det_error;
            let is_missed = (most > e && least < -e) || ahead < -ahead_error || left < -left_error;
            let is_inside = least > e || most < -e;
            let is_hit = is_inside && ahead > ahead_error && left > left_error;
            certain |= u32::from(is_hit) << lane;
            doubt |= u32::from(!is_missed && !is_hit) << lane;
        }
        LeafHits {
            certain: certain & leaf.used,
            doubt: doubt & leaf.used,
        }
    }
}

/// Returns the larger of two numbers, as one instruction: `f32::max` treats NaN in another way.
#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn bits(is: impl Fn(usize) -> bool) -> u32 {
    (0..WIDTH).fold(0, |bits, lane| bits | u32::from(is(lane)) << lane)
}

/// Returns corners in the ray's sheared space: along the major axis, then across the ray.
#[inline(always)]
fn sheared(corner: &[Lanes; 3], ray: &PackedRay) -> [Lanes; 3] {
    let [along, u, v] = ray.axes.map(|axis| &corner[axis]);
    let mut sheared = [[0.0; WIDTH]; 3];
    for lane in 0..WIDTH {
        sheared[0][lane] = along[lane] - ray.start[0];
        sheared[1][lane] = (u[lane] - ray.shear[0] * along[lane]) - ray.start[1];
        sheared[2][lane] = (v[lane] - ray.shear[1] * along[lane]) - ray.start[2];
    }
    sheared
}

/// Returns twice the signed areas of the triangles of the origin, `p` and `q`.
#[inline(always)]
fn area(p: &[Lanes; 3], q: &[Lanes; 3]) -> Lanes {
    std::array::from_fn(|lane| p[1][lane] * q[2][lane] - p[2][lane] * q[1][lane])
}

/// Returns the largest magnitudes of three corners' coordinates: along the ray, and across it.
#[inline(always)]
fn sizes(corners: [&[Lanes; 3]; 3], lane: usize) -> [f32; 2] {
    let size = |of: usize| {
        let [a, b, c] = corners.map(|corner| corner[of][lane].abs());
        max(max(a, b), c)
    };
    [size(0), max(size(1), size(2))]
}
