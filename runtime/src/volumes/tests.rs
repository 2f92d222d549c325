//! Closed forms first, then symmetry, then random triangles against rays, and the twin against both.

use glam::{DMat3, DVec3};

use super::*;

const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// The rounding of double precision over some tens of operations, and of the closed forms as printed.
const TOLERANCE: f64 = 1e-9;

/// A generator of numbers in [0,1): the additive sequence of the plastic number, at a start of its own.
struct Sequence(u32);

impl Sequence {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1 << 24)
    }

    fn signed(&mut self) -> DVec3 {
        DVec3::from([self.next(), self.next(), self.next()].map(|x| 2.0 * x - 1.0))
    }

    /// Returns a triangle above the horizon in part, or in one case of ten hardly at all, and not
    /// through the receiver.
    fn triangle(&mut self) -> [[f64; 3]; 3] {
        let lift = if self.next() < 0.1 { -0.7 } else { 0.6 };
        let size = 0.3 + 2.7 * self.next();
        let center = DVec3::new(0.0, 0.0, lift) + self.signed();
        let corners = [(); 3].map(|()| center + size * self.signed());
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        if a.dot(normal).abs() < 0.05 * normal.length() {
            return self.triangle();
        }
        corners.map(|p| p.to_array())
    }
}

fn rectangle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> [[f64; 3]; 4] {
    [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]]
}

/// Returns a regular polygon of circumradius 1 at height 1 over the receiver.
fn disc(corners: u32) -> Vec<[f64; 3]> {
    let corner = |i: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(corners)).sin_cos();
        [cos, sin, 1.0]
    };
    (0..corners).map(corner).collect()
}

#[test]
fn polygons_with_closed_forms_are_exact() {
    let square = rectangle([-1.0, 1.0], [-1.0, 1.0], 1.0);
    // Four times the corner of a rectangle: 4/√2 atan(1/√2) · 2/2π.
    let corner = 1.0 / 2.0_f64.sqrt();
    let of_square = 4.0 / std::f64::consts::PI * corner * corner.atan();
    assert!((of_square - 0.554_126_424_0).abs() < 1e-10);
    assert!((polygon_occlusion(&square, UP) - of_square).abs() < TOLERANCE);
    for (corners, expected) in [(16, 0.493_524_9), (64, 0.499_598_2)] {
        let found = polygon_occlusion(&disc(corners), UP);
        assert!((found - expected).abs() < 5e-8, "{corners}: {found}");
    }
    let triangle = [[1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0]];
    assert!((polygon_occlusion(&triangle, UP) - 0.057_549_9).abs() < 5e-8);
}

#[test]
fn walls_hide_half_of_the_hemisphere_at_most() {
    let wall = |half: f64, x: f64| {
        let (y0, y1, z0, z1) = (-half, half, -2.0, 1.0);
        let corners = [[x, y0, z0], [x, y1, z0], [x, y1, z1], [x, y0, z1]];
        polygon_occlusion(&corners, UP)
    };
    let endless = 0.5 * (1.0 - 0.5_f64.sqrt());
    // Its ends are 1e4 away, which leaves 1e-8 of the hemisphere.
    assert!((wall(1e4, 1.0) - endless).abs() < 1e-7);
    let near = [
        (0.1, 0.450_237_6),
        (0.01, 0.494_999_2),
        (0.001, 0.499_499_9),
    ];
    for (x, expected) in near {
        let found = wall(10.0, x);
        assert!((found - expected).abs() < 1e-7, "{x}: {found}");
    }
}

#[test]
fn cutting_turning_and_reordering_change_nothing() {
    let mut sequence = Sequence(1);
    for _ in 0..200 {
        let [a, b, c] = sequence.triangle();
        let whole = polygon_occlusion(&[a, b, c], UP);
        let middle = [a, b].map(DVec3::from);
        let middle = ((middle[0] + middle[1]) / 2.0).to_array();
        let halves = [[a, middle, c], [middle, b, c]];
        let sum: f64 = halves.iter().map(|half| polygon_occlusion(half, UP)).sum();
        assert!((whole - sum).abs() < TOLERANCE, "{whole} {sum}");
        let turn = DMat3::from_axis_angle(sequence.signed().normalize(), 6.0 * sequence.next());
        let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
        for map in [turn, mirror, turn * mirror] {
            let moved = [a, b, c].map(|p| (map * DVec3::from(p)).to_array());
            let normal = (map * DVec3::from(UP)).to_array();
            let found = polygon_occlusion(&moved, normal);
            assert!((whole - found).abs() < TOLERANCE, "{whole} {found}");
        }
        for order in [[c, a, b], [b, c, a], [c, b, a]] {
            assert!((whole - polygon_occlusion(&order, UP)).abs() < TOLERANCE);
        }
    }
}

#[test]
fn what_is_coplanar_below_or_without_area_hides_nothing() {
    let cases: [[[f64; 3]; 3]; 5] = [
        // In the horizon's plane, and around the receiver.
        [[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [0.0, 2.0, 0.0]],
        // Below.
        [[-1.0, -1.0, -0.5], [2.0, -1.0, -0.5], [0.0, 2.0, -1.0]],
        // In a plane through the receiver, seen from its edge.
        [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 0.0, 1.0]],
        // A segment, and a point.
        [[1.0, 0.0, 1.0], [2.0, 0.0, 1.0], [3.0, 0.0, 1.0]],
        [[1.0, 0.0, 1.0]; 3],
    ];
    let volume = AogridVolume::new(10.0, VolumeWeight::None, true).unwrap();
    for triangle in cases {
        assert!(polygon_occlusion(&triangle, UP) < TOLERANCE, "{triangle:?}");
        let single = triangle.map(|p| p.map(|x| x as f32));
        let found = aogrid_volume_occlusion(volume, single, [0.0, 0.0, 1.0]);
        assert_eq!(found, 0.0, "{triangle:?}");
    }
    // A receiver at a corner has no exact value, but a finite one.
    let corner = [[0.0; 3], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    assert!((0.0..=1.0).contains(&polygon_occlusion(&corner, UP)));
    let corner = corner.map(|p| p.map(|x| x as f32));
    let polygon = aogrid_above_horizon(corner, [0.0, 0.0, 1.0]);
    assert!((0.0..=1.0).contains(&aogrid_form_factor(polygon, [0.0, 0.0, 1.0])));
    let nan = [[f32::NAN; 3], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    assert_eq!(aogrid_volume_occlusion(volume, nan, [0.0, 0.0, 1.0]), 0.0);
}

/// Returns AO of a triangle by stratified cosine-distributed rays.
fn by_rays(triangle: [[f64; 3]; 3], strata: u32, sequence: &mut Sequence) -> f64 {
    let [a, b, c] = triangle.map(DVec3::from);
    let sides = [a.cross(b), b.cross(c), c.cross(a)];
    let orientation = a.dot((b - a).cross(c - a)).signum();
    let mut hits = 0_u32;
    for cell in 0..strata * strata {
        let u = (f64::from(cell % strata) + sequence.next()) / f64::from(strata);
        let v = (f64::from(cell / strata) + sequence.next()) / f64::from(strata);
        let (sin, cos) = (std::f64::consts::TAU * u).sin_cos();
        let ray = DVec3::new(v.sqrt() * cos, v.sqrt() * sin, (1.0 - v).sqrt());
        hits += u32::from(sides.iter().all(|side| side.dot(ray) * orientation > 0.0));
    }
    f64::from(hits) / f64::from(strata * strata)
}

#[test]
fn random_triangles_agree_with_rays() {
    /// The noise of 50,176 stratified rays is 1.1e-4; an error of the term would be far larger.
    const MAX_RMS: f64 = 2e-4;
    let mut sequence = Sequence(7);
    let (count, mut squares) = (300, 0.0);
    for _ in 0..count {
        let triangle = sequence.triangle();
        let rays = by_rays(triangle, 224, &mut sequence);
        squares += (polygon_occlusion(&triangle, UP) - rays).powi(2);
    }
    let rms = (squares / f64::from(count)).sqrt();
    println!("against rays: {rms:.1e}");
    assert!(rms <= MAX_RMS, "{rms}");
}

#[test]
fn the_twin_in_single_precision_agrees_with_the_exact_term() {
    /// Some tens of roundings of numbers up to 1.
    const MAX_ERROR: f64 = 1e-6;
    let mut sequence = Sequence(3);
    let mut worst = 0.0_f64;
    for _ in 0..2000 {
        let single = sequence.triangle().map(|p| p.map(|x| x as f32));
        let exact = polygon_occlusion(&single.map(|p| p.map(f64::from)), UP);
        let normal = [0.0, 0.0, 1.0];
        let found = aogrid_form_factor(aogrid_above_horizon(single, normal), normal);
        worst = worst.max((f64::from(found) - exact).abs());
    }
    println!("twin: {worst:.1e}");
    assert!(worst <= MAX_ERROR, "{worst}");
}

#[test]
fn weights_fall_from_the_triangle_to_the_end_of_its_volume() {
    /// Single precision's rounding of a few operations.
    const ROUNDING: f32 = 1e-6;
    // The triangle faces up; the receiver is at the origin, and `place` puts the triangle around it.
    let place = |x: f32, y: f32, height: f32| {
        [[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]].map(|[u, v]: [f32; 2]| [u - x, v - y, -height])
    };
    let weight = |kind, [x, y]: [f32; 2], height| {
        let volume = AogridVolume::new(2.0, kind, false).unwrap();
        aogrid_volume_weight(volume, place(x, y, height), height)
    };
    let linear = VolumeWeight::Linear { exponent: 1.0 };
    let edges = VolumeWeight::Edges { exponent: 1.0 };
    let close = |a: f32, b: f32| assert!((a - b).abs() <= ROUNDING, "{a} {b}");
    for kind in [linear, edges] {
        close(weight(kind, [1.0, 1.0], 0.5), 0.75);
        // Beyond one edge both have one ramp.
        close(weight(kind, [1.0, -0.5], 0.5), 0.75 * 0.75);
    }
    // Beyond a corner the ramps of two edges multiply; the distance is that of the corner.
    close(weight(edges, [-0.5, -1.0], 0.0), 0.75 * 0.5);
    close(weight(linear, [-0.6, -0.8], 0.0), 0.5);
    close(weight(VolumeWeight::None, [-1.0, -1.0], 1.9), 1.0);
    close(weight(VolumeWeight::None, [-1.5, -1.5], 0.1), 0.0);
    close(
        weight(VolumeWeight::Linear { exponent: 2.0 }, [1.0, 1.0], 1.0),
        0.25,
    );
    close(
        weight(VolumeWeight::Linear { exponent: 0.0 }, [1.0, 1.0], 1.9),
        1.0,
    );
}

#[test]
fn triangles_occlude_in_front_of_them_or_on_both_sides() {
    let above = [[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [0.0, 2.0, 1.0]];
    let [a, b, c] = above;
    let normal = [0.0, 0.0, 1.0];
    let kind = VolumeWeight::None;
    let occlusion = |two_sided, triangle| {
        let volume = AogridVolume::new(5.0, kind, two_sided).unwrap();
        aogrid_volume_occlusion(volume, triangle, normal)
    };
    // Counter-clockwise from above, so that its back is towards the receiver.
    assert_eq!(occlusion(false, above), 0.0);
    let seen = occlusion(false, [a, c, b]);
    assert!(seen > 0.2, "{seen}");
    assert_eq!(occlusion(true, above), seen);
    assert_eq!(occlusion(true, [a, c, b]), seen);
    let exact = polygon_occlusion(&above.map(|p| p.map(f64::from)), UP);
    assert!((f64::from(seen) - exact).abs() < 1e-6);
}

#[test]
fn volumes_that_cannot_be_are_refused() {
    for extent in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let refused = AogridVolume::new(extent, VolumeWeight::None, false);
        assert!(matches!(refused, Err(VolumeError::Extent(_))));
    }
    for exponent in [-1.0, f32::NAN, f32::INFINITY] {
        let refused = AogridVolume::new(1.0, VolumeWeight::Linear { exponent }, false);
        assert!(matches!(refused, Err(VolumeError::Exponent(_))));
    }
}

/// Small triangles keep their share: an arc cosine would lose them, and sums in 16 bits do.
#[test]
fn a_square_cut_into_thousands_of_triangles_is_whole_in_wide_sums() {
    /// The rounding of 8,192 additions to a sum below 1, and of each term.
    const TOLERANCE: f32 = 1e-4;
    const WHOLE: f32 = 0.554_126_4;
    let at = |i: u32| i as f32 / 32.0 - 1.0;
    let volume = AogridVolume::new(10.0, VolumeWeight::None, false).unwrap();
    let triangles = (0..64 * 64).flat_map(|cell| {
        let (x, y) = (cell % 64, cell / 64);
        // Clockwise from above, so that they face the receiver below.
        let corner = |i: u32, j: u32| [at(x + i), at(y + j), 1.0];
        let [a, b, c, d] = [corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)];
        [[a, b, c], [a, c, d]]
    });
    let terms: Vec<f32> = triangles
        .map(|triangle| aogrid_volume_occlusion(volume, triangle, [0.0, 0.0, 1.0]))
        .collect();
    let sum: f32 = terms.iter().sum();
    let add = |sum: half::f16, term: &f32| half::f16::from_f32(sum.to_f32() + term);
    let in_16_bits = terms.iter().fold(half::f16::ZERO, add).to_f32();
    println!("in 32 bits {sum}, in 16 bits {in_16_bits}");
    assert!((sum - WHOLE).abs() <= TOLERANCE, "{sum}");
    assert!(in_16_bits < WHOLE - 0.05, "{in_16_bits}");
}
