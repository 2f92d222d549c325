//! Whether a ray meets a triangle: the watertight test of Woop, Benthin and Wald (JCGT 2013)
//! in double precision.
//!
//! Two triangles that share an edge evaluate the same expression for it, up to its sign, so
//! that no ray slips between them; a ray exactly on an edge hits. Reversing the winding or
//! mirroring everything flips signs and changes nothing else.

/// A ray in the form that the test wants.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    origin: [f64; 3],
    /// The axis of the direction's largest component, then the other two.
    axes: [usize; 3],
    /// The direction's other two components over its largest.
    shear: [f64; 2],
    /// One over the direction's largest component.
    scale: f64,
    /// Hits are at distances in 0 < t ≤ reach, in lengths of the direction.
    reach: f64,
}

impl Ray {
    /// `direction` is neither zero nor NaN; it need not have length 1.
    pub(crate) fn new(origin: [f64; 3], direction: [f64; 3], reach: f64) -> Self {
        let size = direction.map(f64::abs);
        let major = if size[0] >= size[1] && size[0] >= size[2] {
            0
        } else if size[1] >= size[2] {
            1
        } else {
            2
        };
        let axes = [major, (major + 1) % 3, (major + 2) % 3];
        let scale = 1.0 / direction[major];
        Self {
            origin,
            axes,
            shear: [direction[axes[1]] * scale, direction[axes[2]] * scale],
            scale,
            reach,
        }
    }

    /// The corner as the ray sees it: across (twice) and along.
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

    /// Whether the triangle lies on the ray, within its reach.
    pub(crate) fn meets(&self, corners: &[[f64; 3]; 3]) -> bool {
        // Comparing without dividing keeps the sign exact.
        self.crossing(corners)
            .is_some_and(|[t, det]| t > 0.0 && t <= self.reach * det)
    }

    /// How far along the ray the triangle lies, in lengths of the direction, if it is met.
    pub(crate) fn distance(&self, corners: &[[f64; 3]; 3]) -> Option<f64> {
        let [t, det] = self.crossing(corners)?;
        (t > 0.0 && t <= self.reach * det).then(|| t / det)
    }

    /// Where the ray's line crosses the triangle: t and det > 0, of which t/det is the distance.
    #[inline(always)]
    fn crossing(&self, corners: &[[f64; 3]; 3]) -> Option<[f64; 2]> {
        let [a, b, c] = [
            self.sheared(corners[0]),
            self.sheared(corners[1]),
            self.sheared(corners[2]),
        ];
        // Twice the areas that the ray's point in the plane across it spans with each edge.
        let (u, v, w) = (area(c, b), area(a, c), area(b, a));
        let negative = u < 0.0 || v < 0.0 || w < 0.0;
        let positive = u > 0.0 || v > 0.0 || w > 0.0;
        if negative == positive {
            // Outside; or the triangle is seen edge-on, and its neighbours decide.
            return None;
        }
        let det = u + v + w;
        let t = self.scale * (u * a[2] + v * b[2] + w * c[2]);
        Some([if det > 0.0 { t } else { -t }, det.abs()])
    }
}

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

    fn hits(direction: [f64; 3], reach: f64) -> bool {
        let ray = Ray::new([0.0; 3], direction, reach);
        SQUARE.iter().any(|t| ray.meets(t))
    }

    #[test]
    fn the_whole_square_and_nothing_else_is_hit() {
        let inf = f64::INFINITY;
        // The centre lies on the shared edge.
        assert!(hits([0.0, 0.0, 1.0], inf));
        assert!(!hits([0.0, 0.0, -1.0], inf), "behind");
        for step in -40..=40_i32 {
            let x = f64::from(step) / 40.0;
            for y in [x, -x, 0.3, -0.9] {
                let inside = x.abs() <= 0.5 && y.abs() <= 0.5;
                assert_eq!(hits([x, y, 1.0], inf), inside, "{x} {y}");
            }
        }
        assert!(!hits([1.0, 0.0, 0.0], inf), "parallel");
    }

    #[test]
    fn winding_and_order_of_corners_do_not_matter() {
        let [a, b, c] = SQUARE[0];
        let inside = [[0.3, 0.1, 1.0], [0.49, -0.49, 1.0]];
        // On each of its edges and corners: hits, too, or rays would slip between neighbours.
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
                    ray.meets(&order),
                    !outside.contains(&direction),
                    "{direction:?}"
                );
            }
        }
    }

    #[test]
    fn reach_counts_in_lengths_of_the_direction() {
        assert!(hits([0.1, 0.2, 1.0], 2.0));
        assert!(!hits([0.1, 0.2, 1.0], 1.999_999));
        assert!(hits([0.1, 0.2, 2.0], 1.0));
        assert!(!hits([0.1, 0.2, 2.0], 0.999_999));
    }

    #[test]
    fn no_ray_slips_through_a_fan() {
        // Needles around a point that no float hits exactly, seen from far off.
        let n = 1000;
        let rim = |i: i32| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / f64::from(n)).sin_cos();
            [cos, sin, 0.1 * cos]
        };
        let tip = [1.0 / 3.0, 0.1, 0.7];
        let fan: Vec<_> = (0..n).map(|i| [tip, rim(i), rim((i + 1) % n)]).collect();
        for i in 0..n {
            // Towards points on the needles' common edges.
            let s = f64::from(i) / f64::from(n);
            let to: [f64; 3] = std::array::from_fn(|x| tip[x] * (1.0 - s) + rim(i)[x] * s * 0.99);
            let origin = [0.123, -0.456, 100.0];
            let direction = std::array::from_fn(|x| to[x] - origin[x]);
            let ray = Ray::new(origin, direction, f64::INFINITY);
            assert!(fan.iter().any(|t| ray.meets(t)), "ray {i}");
        }
    }

    #[test]
    fn degenerate_triangles_are_not_hit() {
        let ray = Ray::new([0.0; 3], [0.0, 0.0, 1.0], f64::INFINITY);
        let point = [0.0, 0.0, 1.0];
        assert!(!ray.meets(&[point; 3]));
        assert!(!ray.meets(&[[-1.0, 0.0, 1.0], point, [1.0, 0.0, 1.0]]));
    }
}
