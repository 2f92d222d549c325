//! The watertight ray–triangle test of Woop, Benthin and Wald (JCGT 2013), in double precision.
//!
//! Two triangles that share an edge evaluate the same expression for it, up to its sign, so that no
//! ray passes between them. A ray exactly on an edge is a hit. Reversing the winding or mirroring
//! the scene flips signs and changes nothing else.

/// A ray with the constants of the test precomputed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub origin: [f64; 3],
    /// The axis of the direction's largest component, then the other two.
    pub axes: [usize; 3],
    /// The other two components of the direction, divided by its largest.
    pub shear: [f64; 2],
    /// The inverse of the direction's largest component.
    pub scale: f64,
    /// The maximum distance of a hit, in lengths of the direction: 0 < t ≤ t_max.
    pub t_max: f64,
}

impl Ray {
    /// Creates a ray. `direction` is neither zero nor NaN, but need not have length 1.
    #[inline(always)]
    pub(crate) fn new(origin: [f64; 3], direction: [f64; 3], t_max: f64) -> Self {
        let size = [direction[0].abs(), direction[1].abs(), direction[2].abs()];
        let major = if size[0] >= size[1] && size[0] >= size[2] {
            0
        } else if size[1] >= size[2] {
            1
        } else {
            2
        };
        let axes = [[0, 1, 2], [1, 2, 0], [2, 0, 1]][major];
        let scale = 1.0 / direction[major];
        Self {
            origin,
            axes,
            shear: [direction[axes[1]] * scale, direction[axes[2]] * scale],
            scale,
            t_max,
        }
    }

    /// Returns a corner in the ray's sheared space: two coordinates across the ray, then the one
    /// along its major axis.
    fn sheared(&self, corner: [f64; 3]) -> [f64; 3] {
        let from_origin = |axis: usize| corner[axis] - self.origin[axis];
        let [major, u, v] = self.axes;
        let along = from_origin(major);
        [
            from_origin(u) - self.shear[0] * along,
            from_origin(v) - self.shear[1] * along,
            along,
        ]
    }

    /// Whether the ray hits the triangle within its maximum distance.
    pub(crate) fn hits(&self, corners: &[[f64; 3]; 3]) -> bool {
        // Comparing without a division keeps the sign exact.
        self.intersection(corners)
            .is_some_and(|[t, det]| t > 0.0 && t <= self.t_max * det)
    }

    /// Returns the distance of the hit, in lengths of the direction, if the ray hits the triangle.
    pub(crate) fn hit_distance(&self, corners: &[[f64; 3]; 3]) -> Option<f64> {
        let [t, det] = self.intersection(corners)?;
        (t > 0.0 && t <= self.t_max * det).then(|| t / det)
    }

    /// Returns t and det > 0 if the ray's line intersects the triangle; t/det is the distance.
    #[inline(always)]
    fn intersection(&self, corners: &[[f64; 3]; 3]) -> Option<[f64; 2]> {
        let [a, b, c] = [
            self.sheared(corners[0]),
            self.sheared(corners[1]),
            self.sheared(corners[2]),
        ];
        // Twice the signed areas of the triangles that the ray spans with each edge, in the plane
        // across the ray.
        let (u, v, w) = (area(c, b), area(a, c), area(b, a));
        let negative = u < 0.0 || v < 0.0 || w < 0.0;
        let positive = u > 0.0 || v > 0.0 || w > 0.0;
        if negative == positive {
            // The ray misses, or sees the triangle edge-on and a neighbor is hit instead.
            return None;
        }
        let det = u + v + w;
        let t = self.scale * (u * a[2] + v * b[2] + w * c[2]);
        // Make det positive for both windings, so that the triangle is two-sided.
        Some([if det > 0.0 { t } else { -t }, det.abs()])
    }
}

/// Returns twice the signed area of the triangle of the origin, `p` and `q`.
fn area(p: [f64; 3], q: [f64; 3]) -> f64 {
    p[0] * q[1] - p[1] * q[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[[f64; 3]; 3]; 2] = [
        [[-1.0, -1.0, 2.0], [1.0, -1.0, 2.0], [1.0, 1.0, 2.0]],
        [[-1.0, -1.0, 2.0], [1.0, 1.0, 2.0], [-1.0, 1.0, 2.0]],
    ];

    fn hits_square(direction: [f64; 3], t_max: f64) -> bool {
        let ray = Ray::new([0.0; 3], direction, t_max);
        SQUARE.iter().any(|t| ray.hits(t))
    }

    #[test]
    fn the_whole_square_and_nothing_else_is_hit() {
        let inf = f64::INFINITY;
        // The center lies on the shared edge.
        assert!(hits_square([0.0, 0.0, 1.0], inf));
        assert!(!hits_square([0.0, 0.0, -1.0], inf), "behind");
        for step in -40..=40_i32 {
            let x = f64::from(step) / 40.0;
            for y in [x, -x, 0.3, -0.9] {
                let inside = x.abs() <= 0.5 && y.abs() <= 0.5;
                assert_eq!(hits_square([x, y, 1.0], inf), inside, "{x} {y}");
            }
        }
        assert!(!hits_square([1.0, 0.0, 0.0], inf), "parallel");
    }

    #[test]
    fn winding_and_order_of_corners_do_not_matter() {
        let [a, b, c] = SQUARE[0];
        let inside = [[0.3, 0.1, 1.0], [0.49, -0.49, 1.0]];
        // Rays through the edges and corners hit too, or they would pass between neighbors.
        let on_edges = [[0.1, 0.1, 1.0], [0.5, 0.1, 1.0], [0.1, -0.5, 1.0]];
        let on_corners = [[0.5, 0.5, 1.0], [-0.5, -0.5, 1.0], [0.5, -0.5, 1.0]];
        let outside = [[0.1, 0.3, 1.0], [0.5001, 0.1, 1.0]];
        let hits = inside.into_iter().chain(on_edges).chain(on_corners);
        for direction in hits.chain(outside) {
            let ray = Ray::new([0.0; 3], direction, f64::INFINITY);
            let orders = [
                [a, b, c],
                [b, c, a],
                [c, a, b],
                [a, c, b],
                [c, b, a],
                [b, a, c],
            ];
            for order in orders {
                assert_eq!(
                    ray.hits(&order),
                    !outside.contains(&direction),
                    "{direction:?}"
                );
            }
        }
    }

    #[test]
    fn the_maximum_distance_is_in_lengths_of_the_direction() {
        assert!(hits_square([0.1, 0.2, 1.0], 2.0));
        assert!(!hits_square([0.1, 0.2, 1.0], 1.999_999));
        assert!(hits_square([0.1, 0.2, 2.0], 1.0));
        assert!(!hits_square([0.1, 0.2, 2.0], 0.999_999));
    }

    #[test]
    fn no_ray_passes_through_a_fan() {
        // Thin triangles around a point that no float represents exactly, seen from far away.
        let n = 1000;
        let ring = |i: i32| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / f64::from(n)).sin_cos();
            [cos, sin, 0.1 * cos]
        };
        let tip = [1.0 / 3.0, 0.1, 0.7];
        let fan: Vec<_> = (0..n).map(|i| [tip, ring(i), ring((i + 1) % n)]).collect();
        for i in 0..n {
            // Aim at points on the shared edges.
            let s = f64::from(i) / f64::from(n);
            let to: [f64; 3] = std::array::from_fn(|x| tip[x] * (1.0 - s) + ring(i)[x] * s * 0.99);
            let origin = [0.123, -0.456, 100.0];
            let direction = std::array::from_fn(|x| to[x] - origin[x]);
            let ray = Ray::new(origin, direction, f64::INFINITY);
            assert!(fan.iter().any(|t| ray.hits(t)), "ray {i}");
        }
    }

    #[test]
    fn degenerate_triangles_are_not_hit() {
        let ray = Ray::new([0.0; 3], [0.0, 0.0, 1.0], f64::INFINITY);
        let point = [0.0, 0.0, 1.0];
        assert!(!ray.hits(&[point; 3]));
        assert!(!ray.hits(&[[-1.0, 0.0, 1.0], point, [1.0, 0.0, 1.0]]));
    }
}
