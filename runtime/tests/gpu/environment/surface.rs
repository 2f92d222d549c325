use aogrid_gpu_support::gpu;
use aogrid_runtime::surface::*;

use super::harness::{ARC_TANGENT_ERROR, Harness, ROUNDING, receivers, with, xyz};

#[test]
fn open_cones_blurs_and_coordinates_match_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu);
    let cones = harness.max_difference(
        "let b = aogrid_latlong_blur(q.w);
         return vec4f(aogrid_open_cone(q.w, r.xyz).fraction, b, 0.0);",
        &receivers(),
        |[_, q, r, _]| {
            let [u, v] = aogrid_latlong_blur(q[3]);
            [aogrid_open_cone(q[3], xyz(*r)).fraction, u, v, 0.0]
        },
    );
    assert!(cones <= ROUNDING, "{cones}");
    // No direction of the inputs but the axes lies between two texels, and both look up one texel.
    let off_center: Vec<_> = receivers().into_iter().skip(6).collect();
    let coordinates = harness.max_difference(
        "return vec4f(aogrid_cube_coordinate(coordinates, coordinates_sampler, p.xyz), 0.0, 0.0);",
        &off_center,
        |[p, ..]| {
            let [u, v] = aogrid_cube_coordinate(&harness.cube, xyz(*p));
            [u, v, 0.0, 0.0]
        },
    );
    assert!(coordinates <= ROUNDING, "{coordinates}");
}

#[test]
fn light_on_surfaces_matches_the_cpu_twin() {
    let Some(gpu) = gpu() else { return };
    let harness = Harness::new(&gpu);
    let light = harness.max_difference(
        "let open = aogrid_open_cone(1.0 - s.x, r.xyz);
         let light = aogrid_surface_light(environment, radiance, radiance_sampler, q, p.xyz,
                                          1.0 - s.x, open);
         return vec4f(light, 0.0);",
        &receivers(),
        |[p, q, r, s]| {
            let open = aogrid_open_cone(1.0 - s[0], xyz(*r));
            let accessibility = 1.0 - s[0];
            let light = aogrid_surface_light(
                &harness.environment,
                &harness.map,
                *q,
                xyz(*p),
                accessibility,
                &open,
            );
            with(light, 0.0)
        },
    );
    // Two look-ups, each as wrong as the irradiance's.
    let tolerance = harness.filter_error() + 1.5 * 20.0 / 0.17 * ARC_TANGENT_ERROR / 100.0;
    assert!(light <= 2.0 * tolerance, "{light}");
}
