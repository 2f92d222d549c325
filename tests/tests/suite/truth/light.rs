use aogrid_bake_core::UNOBSERVED;
use aogrid_baker_cpu::RayScene;
use aogrid_scene::reference::{
    AreaLight, Environment, Lighting, ReferenceOptions, ShadingEstimate, shade,
};
use aogrid_tests::form_factor;

use super::{UP, cube, floor, quads, rms, sunny};

#[test]
fn light_of_a_sky_with_a_sun_matches_its_integral() {
    let (environment, expected) = sunny();
    let lighting = Lighting {
        environment: Some(&environment),
        ..Lighting::default()
    };
    let options = ReferenceOptions::recommended();
    let receivers = floor(|u, v| Some([u, v]));
    let shades = shade(None, &receivers, &lighting, &options, UNOBSERVED).unwrap();
    for c in 0..3 {
        let measured = rms(shades
            .iter()
            .map(|s| f64::from(s.light[c].mean) - expected[c]));
        let estimated = rms(shades.iter().map(|s| f64::from(s.light[c].standard_error)));
        // Single rays would find the sun by chance and be off by a third of all light.
        assert!(measured < 2e-3 * expected[c], "{measured} {expected:?}");
        // Points of the integral at texels' edges: half a point's share of the sun.
        let integral = 1e-3 * expected[c];
        assert!(
            measured < 1.24 * estimated + integral,
            "{measured} {estimated}"
        );
    }
}

#[test]
fn a_lid_hides_the_sun_and_the_sky() {
    let (environment, _) = sunny();
    let lighting = Lighting {
        environment: Some(&environment),
        ..Lighting::default()
    };
    let far = 1e5;
    let lid = [
        [-far, 1.0, -far],
        [far, 1.0, -far],
        [far, 1.0, far],
        [-far, 1.0, far],
    ];
    let occluder = RayScene::new(&quads(&[lid]));
    let receivers = floor(|u, v| Some([u, v]));
    let lit = |max_distance| {
        let options = ReferenceOptions {
            max_distance,
            ..ReferenceOptions::recommended()
        };
        let shades = shade(Some(&occluder), &receivers, &lighting, &options, UNOBSERVED).unwrap();
        shades.iter().map(|s| s.light[0].mean).sum::<f32>()
    };
    assert!(lit(None) < 1e-5);
    // Too far away to hide anything.
    assert!(lit(Some(0.9)) > 1.0);
}

#[test]
fn a_constant_sky_is_darkened_by_occlusion() {
    let known = cube();
    let sky = [0.25, 1.0, 3.0];
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let environment = Environment::new([7, 5], vec![sky; 35], identity).unwrap();
    let lighting = Lighting {
        environment: Some(&environment),
        ambient: [0.5, 0.0, 0.0],
        ..Lighting::default()
    };
    let options = ReferenceOptions {
        samples: 200,
        ..ReferenceOptions::recommended()
    };
    let occluder = RayScene::new(&known.mesh);
    for occluder in [None, Some(&occluder)] {
        let shades = shade(occluder, &known.receivers, &lighting, &options, UNOBSERVED).unwrap();
        for s in shades {
            for (c, radiance) in [0.75, 1.0, 3.0].into_iter().enumerate() {
                let expected = (1.0 - s.occlusion.mean) * radiance;
                // The same rays: only rounding differs.
                assert!((s.light[c].mean - expected).abs() < 1e-5, "{s:?}");
            }
        }
    }
}

#[test]
fn an_area_light_lights_by_its_form_factor_and_casts_shadows() {
    let light =
        |v: [f64; 3]| AreaLight::new([0.0, 2.0, 0.0], [0.5, 0.0, 0.0], v, [3.0, 2.0, 1.0]).unwrap();
    // u × v points down, or up.
    let (down, up) = (light([0.0, 0.0, 0.8]), light([0.0, 0.0, -0.8]));
    let receivers = floor(|u, v| Some([2.0 * u - 1.0, 2.0 * v - 1.0]));
    let shades = |light: AreaLight, occluder: Option<&RayScene>| {
        let lighting = Lighting {
            area_light: Some(light),
            ..Lighting::default()
        };
        let options = ReferenceOptions::recommended();
        shade(occluder, &receivers, &lighting, &options, UNOBSERVED).unwrap()
    };
    let off = |shades: Vec<ShadingEstimate>| {
        rms(shades.iter().zip(&receivers).map(|(s, r)| {
            f64::from(s.light[0].mean) - 3.0 * form_factor(&down.corners(), r.position, UP)
        }))
    };
    assert!(off(shades(down, None)) < 1e-4);
    assert!(shades(up, None).iter().all(|s| s.light[0].mean == 0.0));
    // An occluder in the plane of the light blocks nothing, a lid in front of it does.
    let at = |y: f64| {
        RayScene::new(&quads(&[[
            [-1.0, y, -1.0],
            [1.0, y, -1.0],
            [1.0, y, 1.0],
            [-1.0, y, 1.0],
        ]]))
    };
    assert!(off(shades(down, Some(&at(2.0)))) < 1e-4);
    assert!(
        shades(down, Some(&at(1.9)))
            .iter()
            .all(|s| s.light[0].mean == 0.0)
    );
}
