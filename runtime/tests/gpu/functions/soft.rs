use std::sync::LazyLock;

use super::*;

/// A look-up in the middle of the box.
const AT_CENTER: AogridLookup = AogridLookup {
    position: [0.5; 3],
    is_reached: true,
    outward: [0.0; 3],
    distance: 1.0,
    remainder: 1.0,
    flatness: 0.0,
};

/// Returns an occluder of the moment encoding in place, with strength 1.
fn occluder() -> AogridOccluder {
    static OCCLUDER: LazyLock<AogridOccluder> = LazyLock::new(|| {
        let identity = glam::Mat4::IDENTITY.to_cols_array_2d();
        let grid = ball(Encoding::Moment, TexelFormat::F32);
        AogridOccluder::new(&grid, &Instance::at(identity)).unwrap()
    });
    *OCCLUDER
}

/// Returns AO of the soft cone with fraction `a` and vector `v` for a receiver with normal `n`.
fn occlusion(a: f32, v: [f32; 3], n: [f32; 3]) -> f32 {
    let cone = aogrid_cone_of(&occluder(), [v[0], v[1], v[2], a.sqrt()], AT_CENTER);
    let cos_beta = (0..3).map(|x| cone.axis[x] * n[x]).sum();
    cone.density * (1.0 - aogrid_clip_transmittance_closed_form(cone.fraction, cos_beta))
}

/// The occluded directions enter AO(n) by their projection on n: the difference of both sides of a
/// plane is AO(n) − AO(−n) = 4 m·n for any set of directions, and the mean over all normals is a.
/// A soft cone keeps both exactly, whatever the length of v.
#[test]
fn soft_cones_keep_both_moments() {
    // The closed form rounds angles up to π at a quarter of a unit in the last place each.
    const TOLERANCE: f32 = 4e-6;
    for a in [0.001_f32, 0.2, 0.5, 0.8, 0.999] {
        for length in [0.0_f32, 0.3, 0.8, 1.0] {
            let v = [0.6 * length, 0.0, -0.8 * length];
            let (mut sum, count) = (0.0_f64, 4000);
            for idx in 0..count {
                let n = spiral(idx);
                let [front, back] = [n, n.map(|x| -x)].map(|n| occlusion(a, v, n));
                let expected = 4.0 * a * (1.0 - a) * (v[0] * n[0] + v[1] * n[1] + v[2] * n[2]);
                assert!((front - back - expected).abs() <= TOLERANCE, "{a} {length}");
                sum += f64::from(front);
            }
            // The spiral is a quasi-random sequence: its error falls nearly as 1/n.
            let mean = sum / count as f64;
            assert!((mean - f64::from(a)).abs() <= 1e-3, "{a} {length}: {mean}");
        }
    }
}

#[test]
fn a_vector_of_unit_length_is_a_hard_cone_and_zero_a_uniform_haze() {
    for a in [0.05_f32, 0.5, 0.9] {
        let [hard, haze] = [[0.0, 1.0, 0.0], [0.0; 3]].map(|v| occlusion(a, v, [0.0, 1.0, 0.0]));
        let expected = 4.0 * a * (1.0 - a);
        let full = if a > 0.5 { 1.0 } else { expected };
        assert!((hard - full).abs() < 4e-6, "{a}: {hard}");
        // Every direction is occluded with probability a.
        assert!((haze - a).abs() < 4e-6, "{a}: {haze}");
    }
}

#[test]
fn hard_cones_ignore_the_length_of_the_axis_unless_soft_ones_are_asked_for() {
    let identity = glam::Mat4::IDENTITY.to_cols_array_2d();
    let cone = |soft_cones: bool, length: f32| {
        let instance = Instance {
            soft_cones,
            ..Instance::at(identity)
        };
        let grid = ball(Encoding::Cone, TexelFormat::F32);
        let occluder = AogridOccluder::new(&grid, &instance).unwrap();
        aogrid_cone_of(&occluder, [0.0, length, 0.0, 0.25], AT_CENTER)
    };
    let hard = cone(false, 0.5);
    assert_eq!(
        (hard.axis, hard.fraction, hard.density),
        ([0.0, 1.0, 0.0], 0.25, 1.0)
    );
    let soft = cone(true, 0.5);
    assert_eq!(
        (soft.axis, soft.fraction, soft.density),
        ([0.0, 1.0, 0.0], 0.625, 0.4)
    );
}

impl Harness<'_> {
    /// Returns the error of a transmittance from moments: that of a cone, with a = A² twice as
    /// steep, and that of |v|, along which AO changes by at most AO(w)/w ≤ 4.
    fn soft_cone_error(&self) -> f32 {
        2.0 * self.cone_error() + 4.0 * self.channel_error()
    }
}

#[test]
fn look_ups_of_moments_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let (table, clip) = (CpuTexture::transmittance_table(), CpuTexture::clip_table());
    for format in TexelFormat::ALL {
        let harness = Harness::new(&gpu, ball(Encoding::Moment, format), &transformed());
        let grid = CpuTexture::of_grid(&harness.grid);
        let worst = harness.max_difference(
            "return vec4f(aogrid_cone(occluder, grid, transmittance, linear_clamp, p, n));",
            &outside(),
            |p, n| [aogrid_cone(&harness.occluder, &grid, &table, p, n); 4],
        );
        let tolerance = harness.soft_cone_error();
        assert!(worst[0] <= tolerance, "{format:?}: {worst:?} {tolerance}");
        let worst = harness.max_difference(
            "let lookup = aogrid_lookup(occluder, p);
             return aogrid_cone_with_axis_at(occluder, grid, clip, linear_clamp, lookup, n);",
            &outside(),
            |p, n| {
                let lookup = aogrid_lookup(&harness.occluder, p);
                aogrid_cone_with_axis_at(&harness.occluder, &grid, &clip, lookup, n)
            },
        );
        assert!(
            worst.iter().all(|w| *w <= tolerance),
            "{format:?}: {worst:?}"
        );
    }
}
