//! The CPU twin of `surface.wgsl`: the same functions under the same names, in single floats.
//!
//! # Theory
//!
//! A surface bake has an accessibility A and a bent normal B for each point. Listing 17-3 of GPU Gems,
//! chapter 17, shades with A times the mean radiance around B. The printed A is the share of the
//! hemisphere, which under a constant sky is too dark; with A weighted by the cosine, 1 − AO, it is
//! exact there. The mean is over the *open cone*: the share A of the hemisphere, as a cone around B. A cone
//! around the normal with sin²α = A would have that accessibility, too, but narrows with the root of 1 − A:
//! what occludes little is near the horizon, and leaves most of the hemisphere.
//!
//! Listing 17-5 blurs by √A, the cone's diameter in v as a part of the map's height, and by as much in u,
//! which spans twice the angle: a blur twice as wide. Listing 17-4 scales v by 2/π in place of 1/π. An
//! [`EnvironmentMap`] has for each level the mean over cones of a size with √(2a) = 2^(l − 4), so that
//! its levels are those of √A; they have no seam, and at the poles no
//! pinch.
//!
//! Neighbors with grids occlude, too. Their accumulated occlusion is subtracted as in
//! [`aogrid_lambertian`](crate::environment::aogrid_lambertian), of which this is a generalization: an
//! open surface, A = 1 and B the normal, reflects the same. The object's own grid must be left out: its
//! bake has that occlusion already.

use crate::environment::{
    aogrid_cone_radiance, aogrid_cosine_weighted_cone, aogrid_occluded_cone, subtract_clamped,
};
use crate::shading::AogridCone;
use crate::{AogridEnvironment, EnvironmentMap, LatLongCube};

/// The light that a white diffuse surface reflects (listing 17-3): its accessibility times the mean
/// radiance of its open cone, less AO times that of what `accumulated` occludes; the latter is 0, 0, 0,
/// 1 without neighbors.
pub fn aogrid_surface_light(
    environment: &AogridEnvironment,
    map: &EnvironmentMap,
    accumulated: [f32; 4],
    normal: [f32; 3],
    accessibility: f32,
    open: &AogridCone,
) -> [f32; 3] {
    let unoccluded = aogrid_cone_radiance(environment, map, open);
    let cone = aogrid_cosine_weighted_cone(&aogrid_occluded_cone(accumulated, normal), normal);
    let blocked = aogrid_cone_radiance(environment, map, &cone);
    subtract_clamped(unoccluded, 1.0 - accumulated[3], blocked).map(|c| accessibility * c)
}

/// The open cone of a surface: around its bent normal, with the share of the hemisphere that its
/// accessibility is. The level of the map is then that of the root of the accessibility (listing 17-5).
pub fn aogrid_open_cone(accessibility: f32, bent_normal: [f32; 3]) -> AogridCone {
    AogridCone::new(bent_normal, 0.5 * accessibility.clamp(0.0, 1.0))
}

/// The extents in u and v of the blur in a latitude-longitude texture of your own, with ordinary
/// mips (listing 17-5), for a share of the hemisphere: its root is about the diameter of the open
/// cone in v, which spans π, and twice that in u, which spans 2π.
pub fn aogrid_latlong_blur(accessibility: f32) -> [f32; 2] {
    let width = accessibility.clamp(0.0, 1.0).sqrt();
    [0.5 * width, width]
}

/// The latitude-longitude coordinates of a direction in the map's axes, read from a cube map of them
/// in place of arc tangents (listing 17-4). The sampler is nearest: coordinates jump at the map's
/// edge.
pub fn aogrid_cube_coordinate(coordinates: &LatLongCube, direction: [f32; 3]) -> [f32; 2] {
    coordinates.nearest(direction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Up;
    use crate::environment::{aogrid_environment_coordinate, aogrid_irradiance, aogrid_lambertian};

    /// The relative rounding of half floats, which maps hold, with some operations of single floats.
    const HALF: f32 = 1.0 / 1024.0;

    const NORMAL: [f32; 3] = [0.0, 0.8, 0.6];

    fn gray(value: f32) -> EnvironmentMap {
        EnvironmentMap::new([1, 1], &[[value; 3]]).unwrap()
    }

    /// A map with a white half, x > 0, and a black one.
    fn halves() -> EnvironmentMap {
        let texels: Vec<_> = (0..64 * 32)
            .map(|idx| [f32::from(u8::from(idx % 64 < 32)); 3])
            .collect();
        EnvironmentMap::new([64, 32], &texels).unwrap()
    }

    #[test]
    fn under_a_constant_sky_a_surface_reflects_its_accessibility() {
        let (map, place) = (gray(2.0), AogridEnvironment::new(Up::Y, 0.3));
        for a in [0.0_f32, 0.1, 0.415, 0.9, 1.0] {
            for open in [
                aogrid_open_cone(a, NORMAL),
                aogrid_open_cone(a, [0.0, 1.0, 0.0]),
            ] {
                for occlusion in [0.0, 0.25, 1.0] {
                    let sum = NORMAL.map(|n| 0.5 * occlusion * n);
                    let accumulated = [sum[0], sum[1], sum[2], 1.0 - occlusion];
                    let found = aogrid_surface_light(&place, &map, accumulated, NORMAL, a, &open);
                    let expected = 2.0 * a * (1.0 - occlusion);
                    assert!(
                        (found[0] - expected).abs() <= 2.0 * HALF,
                        "{found:?} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn an_open_surface_reflects_what_one_without_a_bake_does() {
        let (map, place) = (halves(), AogridEnvironment::new(Up::Z, 0.3));
        let open = aogrid_open_cone(1.0, NORMAL);
        for accumulated in [[0.0, 0.0, 0.0, 1.0], [0.05, 0.1, 0.0, 0.6]] {
            let found = aogrid_surface_light(&place, &map, accumulated, NORMAL, 1.0, &open);
            let expected = aogrid_lambertian(&place, &map, accumulated, NORMAL);
            assert_eq!(found, expected);
        }
    }

    /// A slit at the foot of a wall sees the other side of the sky alone.
    #[test]
    fn light_comes_from_the_open_side() {
        let (map, place) = (halves(), AogridEnvironment::new(Up::Y, 0.0));
        let at = |x: f32| {
            let open = aogrid_open_cone(0.5, [x, 0.5, 0.0]);
            aogrid_surface_light(
                &place,
                &map,
                [0.0, 0.0, 0.0, 1.0],
                [0.0, 1.0, 0.0],
                0.5,
                &open,
            )
        };
        let (white, black) = (at(0.75_f32.sqrt())[0], at(-(0.75_f32.sqrt()))[0]);
        // A quarter of the sphere, a cone of 60°, around a direction at 60° from the zenith is beyond the
        // edge by 30°, where its weights are small.
        assert!(white > 0.4 && black < 0.1, "{white} {black}");
        let up = [0.0, 1.0, 0.0];
        assert!((aogrid_irradiance(&place, &map, up)[0] - 0.5).abs() < HALF);
    }

    #[test]
    fn the_levels_of_a_map_are_those_of_the_root() {
        use crate::environment::aogrid_environment_level;
        for accessibility in [1.0_f32, 0.5, 0.25, 0.1] {
            let cone = aogrid_open_cone(accessibility, NORMAL);
            let [_, v] = aogrid_latlong_blur(accessibility);
            let level = aogrid_environment_level(cone.fraction);
            // Level 4 has the whole height.
            assert!((level - (4.0 + v.log2())).abs() < 1e-5, "{level}");
        }
    }

    /// The looked-up light does not jump across the edge of the map, nor at its poles.
    #[test]
    fn seam_and_poles_do_not_show() {
        let (map, place) = (halves(), AogridEnvironment::new(Up::Y, 0.0));
        let light = |d: [f32; 3], a: f32| {
            let open = aogrid_open_cone(a, d);
            aogrid_surface_light(&place, &map, [0.0, 0.0, 0.0, 1.0], d, 1.0, &open)[0]
        };
        for a in [0.01, 0.3, 1.0] {
            // The map's edge is −z, where its halves meet: steps of 1e-4 in a slope of at most 5.
            let sides = [1e-4_f32, -1e-4].map(|x| light([x, 0.3, -0.954], a));
            assert!((sides[0] - sides[1]).abs() < 2e-3, "{a}: {sides:?}");
            let around = (0..16).map(|turn| {
                let (sin, cos) = (turn as f32 * 0.39).sin_cos();
                light([1e-4 * sin, 1.0, 1e-4 * cos], a)
            });
            let around: Vec<f32> = around.collect();
            let range = around
                .iter()
                .fold([1.0_f32, 0.0], |[lo, hi], v| [lo.min(*v), hi.max(*v)]);
            assert!(range[1] - range[0] < 2e-3, "{a}: {around:?}");
        }
    }

    #[test]
    fn a_cube_has_the_coordinates_within_its_texels() {
        let cube = LatLongCube::new(256);
        // The greatest angle from a texel's center, in the middle of a face: half a diagonal, and the
        // rounding of its cosine.
        let bound = 1.01 * 2.0_f32.sqrt() / 256.0;
        for idx in 0..5000 {
            let z = 1.0 - 2.0 * (idx as f32 * 0.754_877_7).fract();
            let (sin, cos) = (idx as f32 * 2.399_963_2).sin_cos();
            let r = (1.0 - z * z).sqrt();
            let d = [r * cos, z, r * sin];
            let exact = aogrid_environment_coordinate(d);
            let found = aogrid_cube_coordinate(&cube, d);
            let direction = |[u, v]: [f32; 2]| {
                let (sin, cos) = (v * std::f32::consts::PI).sin_cos();
                let (x, z) = ((0.5 - u) * std::f32::consts::TAU).sin_cos();
                glam::Vec3::new(sin * x, cos, sin * z)
            };
            let angle = direction(exact).angle_between(direction(found));
            assert!(angle <= bound, "{d:?}: {exact:?} {found:?}");
        }
    }
}
