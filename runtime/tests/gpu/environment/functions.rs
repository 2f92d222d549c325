use aogrid_gpu_support::gpu;
use aogrid_runtime::environment::*;
use aogrid_runtime::{AogridCone, AogridEnvironment, Up};

use super::harness::{ARC_TANGENT_ERROR, Harness, ROUNDING, receivers, sky, with, xyz};

#[test]
fn coordinates_levels_and_directions_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu);
    let worst = harness.max_difference(
        "let d = aogrid_map_direction(environment, p.xyz);
         return vec4f(aogrid_environment_coordinate(d), aogrid_environment_level(s.x), d.y);",
        &receivers(),
        |[p, _, _, s]| {
            let d = aogrid_map_direction(&harness.environment, xyz(*p));
            let [u, v] = aogrid_environment_coordinate(d);
            [u, v, aogrid_environment_level(s[0]), d[1]]
        },
    );
    assert!(worst <= ARC_TANGENT_ERROR, "{worst}");
    let mirrored = harness.max_difference(
        "return vec4f(aogrid_mirrored(vec4f(r.xyz * 3.0, s.x), q.xyz, p.xyz), 0.0);",
        &receivers(),
        |[p, q, r, s]| {
            let eye = with(xyz(*r).map(|x| x * 3.0), s[0]);
            with(aogrid_mirrored(eye, xyz(*q), xyz(*p)), 0.0)
        },
    );
    assert!(mirrored <= ROUNDING, "{mirrored}");
}

#[test]
fn cones_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu);
    let occluded = harness.max_difference(
        "let c = aogrid_occluded_cone(q, p.xyz);
         let w = aogrid_cosine_weighted_cone(c, p.xyz);
         return vec4f(w.axis, c.fraction + w.density + aogrid_half_angle(s.x));",
        &receivers(),
        |[p, q, _, s]| {
            let cone = aogrid_occluded_cone(*q, xyz(*p));
            let weighted = aogrid_cosine_weighted_cone(&cone, xyz(*p));
            let sum = cone.fraction + weighted.density + aogrid_half_angle(s[0]);
            with(weighted.axis, sum)
        },
    );
    // √(1 − AO/cos β) near 0 is the root of a rounding; the fraction has half of that error, and
    // the density twice the fraction's.
    assert!(
        occluded <= 1.5 * (2.0_f32 * ROUNDING).sqrt() + ARC_TANGENT_ERROR,
        "{occluded}"
    );
    let shared = harness.max_difference(
        "let both = aogrid_shared_cone(AogridCone(r.xyz, s.x, 0.5), AogridCone(p.xyz, 0.5, 1.0));
         let third = aogrid_shared_cone(both, AogridCone(r.zxy, 0.1, 0.7));
         return vec4f(both.axis, both.fraction + third.fraction * third.density);",
        &receivers(),
        |[p, _, r, s]| {
            let cone = |axis, fraction, density| AogridCone {
                axis,
                fraction,
                density,
            };
            let both = aogrid_shared_cone(&cone(xyz(*r), s[0], 0.5), &cone(xyz(*p), 0.5, 1.0));
            let turned = cone([r[2], r[0], r[1]], 0.1, 0.7);
            let third = aogrid_shared_cone(&both, &turned);
            with(both.axis, both.fraction + third.fraction * third.density)
        },
    );
    // The angles come from arc tangents; the mean axis and the lens take half of a few of them.
    assert!(shared <= 2.0 * ARC_TANGENT_ERROR, "{shared}");
}

#[test]
fn diffuse_and_glossy_light_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu);
    let args = "environment, radiance, radiance_sampler";
    let irradiance = harness.max_difference(
        &format!("return vec4f(aogrid_irradiance({args}, p.xyz), 0.0);"),
        &receivers(),
        |[p, ..]| {
            with(
                aogrid_irradiance(&harness.environment, &harness.map, xyz(*p)),
                0.0,
            )
        },
    );
    // A coordinate has the error of an arc tangent, on a slope of at most 20 in 10°.
    let tolerance = harness.filter_error() + 1.5 * 20.0 / 0.17 * ARC_TANGENT_ERROR / 100.0;
    assert!(irradiance <= tolerance, "{irradiance}");
    let lambertian = harness.max_difference(
        &format!("return vec4f(aogrid_lambertian({args}, q, p.xyz), 0.0);"),
        &receivers(),
        |[p, q, ..]| {
            with(
                aogrid_lambertian(&harness.environment, &harness.map, *q, xyz(*p)),
                0.0,
            )
        },
    );
    assert!(lambertian <= 2.0 * tolerance, "{lambertian}");
    let glossy = harness.max_difference(
        &format!("return vec4f(aogrid_glossy({args}, q, p.xyz, r.xyz, s.x), 0.0);"),
        &receivers(),
        |[p, q, r, s]| {
            let light = aogrid_glossy(
                &harness.environment,
                &harness.map,
                *q,
                xyz(*p),
                xyz(*r),
                s[0],
            );
            with(light, 0.0)
        },
    );
    assert!(glossy <= 2.0 * tolerance, "{glossy}");
}

#[test]
fn no_occlusion_keeps_all_light_and_full_occlusion_keeps_none() {
    let map = sky();
    let environment = AogridEnvironment::new(Up::Y, 0.2);
    for [normal, _, mirrored, lobe] in receivers() {
        let (n, r) = (xyz(normal), xyz(mirrored));
        let open = aogrid_lambertian(&environment, &map, [0.0, 0.0, 0.0, 1.0], n);
        assert_eq!(open, aogrid_irradiance(&environment, &map, n));
        let overhead = with(n.map(|x| 0.5 * x), 0.0);
        let dark = aogrid_lambertian(&environment, &map, overhead, n);
        assert!(dark.iter().all(|v| *v < DARKNESS_TOLERANCE), "{dark:?}");
        let dark = aogrid_glossy(&environment, &map, overhead, n, r, lobe[0]);
        assert!(dark.iter().all(|v| *v < DARKNESS_TOLERANCE), "{dark:?}");
    }
}

/// The tolerance for full occlusion. The occluded fraction is ½ up to half the root of a rounding,
/// 2e-4, and the level is the last one up to as much; the radiances of the next level, and of a
/// lobe, differ by a few units.
const DARKNESS_TOLERANCE: f32 = 1e-3;

#[test]
fn occluders_on_several_sides_become_a_wide_cone_of_low_density() {
    let n = [0.0, 0.0, 1.0];
    // For a cone around the normal AO = 4a(1 - a): 5/9 for a = 1/6, a third of the hemisphere's
    // fraction.
    let (occlusion, a) = (5.0 / 9.0, 1.0 / 6.0);
    for (together, wide) in [(1.0, a), (0.9, 0.25), (0.6, 0.5), (0.0, 0.5)] {
        let sum = 0.5 * occlusion * together;
        let cone = aogrid_occluded_cone([0.0, 0.0, sum, 1.0 - occlusion], n);
        assert!((cone.fraction - wide).abs() < ROUNDING, "{cone:?}");
        assert!((cone.density * wide - a).abs() < ROUNDING, "{cone:?}");
        // A narrow lobe in the middle of the cone finds the cone's own density.
        let lobe = aogrid_shared_cone(&AogridCone::new(n, 0.002), &cone);
        assert!((lobe.fraction - 0.002).abs() < ROUNDING && lobe.density == cone.density);
    }
}
