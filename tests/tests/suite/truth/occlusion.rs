//! Scenes whose occlusion has a closed form.

use aogrid_bake_core::UNOBSERVED;
use aogrid_bake_core::models::Model;
use aogrid_baker_cpu::RayScene;
use aogrid_scene::reference::{Lighting, ReferenceOptions, ShadingEstimate, shade};
use aogrid_tests::form_factor;

use super::{KnownScene, UP, cube, floor, known, quads, rms};

/// The largest RMSE over the receivers of a scene, at the default number of samples.
const MAX_RMSE: f64 = 1e-3;

/// Returns a ball of radius ½ on the floor: wholly above it, so its form factor is h r²/d³.
fn ball() -> KnownScene {
    // Facets of level 6 lie within 5e-5 of the radius below the ball: 1e-4 of its form factor.
    let mesh = Model::Sphere.mesh(Some(20 << 12)).unwrap();
    let receivers = floor(|u, v| Some([2.0 * u - 0.5, 2.0 * v - 0.5]));
    known("ball", mesh, receivers, |[x, _, z]| {
        let squared = x * x + 0.25 + z * z;
        0.5 * 0.25 / squared.powf(1.5)
    })
}

/// Returns two walls that meet above the floor, ten times as wide and high as the distance of the
/// farthest receiver.
fn corner() -> KnownScene {
    let s = 10.0;
    let walls = [
        [[0.0, 0.0, 0.0], [s, 0.0, 0.0], [s, s, 0.0], [0.0, s, 0.0]],
        [[0.0, 0.0, 0.0], [0.0, 0.0, s], [0.0, s, s], [0.0, s, 0.0]],
    ];
    let receivers = floor(|u, v| Some([u, v]));
    known("corner", quads(&walls), receivers, move |at| {
        walls.iter().map(|wall| form_factor(wall, at, UP)).sum()
    })
}

/// Returns a wall so wide that AO depends on the distance d alone: (1 − d/√(d² + h²))/2.
fn wall() -> KnownScene {
    let (far, h) = (1e4, 2.0);
    let wall = [
        [0.0, 0.0, -far],
        [0.0, 0.0, far],
        [0.0, h, far],
        [0.0, h, -far],
    ];
    let receivers = floor(|u, v| Some([0.01 + 3.0 * u, v]));
    known("wall", quads(&[wall]), receivers, move |[d, ..]| {
        (1.0 - d / d.hypot(h)) / 2.0
    })
}

/// Returns a wall up to the sky, which hides half of it at any distance. The wall stands askew, so
/// that its edge does not run along strata.
fn endless_wall() -> KnownScene {
    let far = 1e7;
    let (sin, cos) = 0.5_f64.sin_cos();
    let [left, right] = [-far, far].map(|along| [-along * sin, along * cos]);
    let corner = |[x, z]: [f64; 2], y: f64| [x, y, z];
    let wall = [
        corner(left, 0.0),
        corner(right, 0.0),
        corner(right, far),
        corner(left, far),
    ];
    let receivers = floor(|u, v| Some([0.1 + 10.0 * u, v]));
    known("endless wall", quads(&[wall]), receivers, |_| 0.5)
}

fn all_known() -> [KnownScene; 5] {
    [ball(), cube(), corner(), wall(), endless_wall()]
}

fn occlusion(known: &KnownScene, samples: u32) -> Vec<ShadingEstimate> {
    let options = ReferenceOptions {
        samples,
        ..ReferenceOptions::recommended()
    };
    let occluder = RayScene::new(&known.mesh);
    let lighting = Lighting::default();
    shade(
        Some(&occluder),
        &known.receivers,
        &lighting,
        &options,
        UNOBSERVED,
    )
    .unwrap()
}

/// Returns the measured and the estimated RMS error.
fn errors(known: &KnownScene, shades: &[ShadingEstimate]) -> [f64; 2] {
    let pairs = shades.iter().zip(&known.expected);
    let measured = rms(pairs.map(|(s, e)| f64::from(s.occlusion.mean) - e));
    let estimated = rms(shades.iter().map(|s| f64::from(s.occlusion.standard_error)));
    [measured, estimated]
}

#[test]
fn the_reference_matches_closed_forms_and_estimates_its_error() {
    for known in all_known() {
        let shades = occlusion(&known, ReferenceOptions::recommended().samples);
        let [measured, estimated] = errors(&known, &shades);
        println!(
            "{}: RMSE {measured:.6}, estimated {estimated:.6}",
            known.name
        );
        assert!(measured <= MAX_RMSE, "{}: {measured}", known.name);
        // The RMS of n normal numbers has a relative error of 1/√(2n), for 485 and more receivers
        // 3.2 %; five times that.
        let ratio = measured / estimated;
        assert!(
            (0.84..1.16).contains(&ratio),
            "{}: {measured} {estimated}",
            known.name
        );
    }
}

#[test]
fn the_error_falls_with_the_samples_to_the_power_of_three_quarters() {
    for known in all_known() {
        let [few, _] = errors(&known, &occlusion(&known, 128));
        let [many, _] = errors(&known, &occlusion(&known, 8192));
        // 64^¾ = 22.6, 64^½ = 8. A silhouette crosses few strata if there are only 64.
        println!(
            "{}: {few:.5} to {many:.6}, {:.1} times",
            known.name,
            few / many
        );
        assert!((16.0..32.0).contains(&(few / many)), "{}", known.name);
    }
}

#[test]
fn a_ceiling_within_a_maximum_distance_occludes_a_cap() {
    let (h, far) = (0.7, 100.0);
    let ceiling = [
        [-far, h, -far],
        [far, h, -far],
        [far, h, far],
        [-far, h, far],
    ];
    let occluder = RayScene::new(&quads(&[ceiling]));
    let receivers = floor(|u, v| Some([u, v]));
    for max_distance in [0.69, 0.8, 1.0, 2.0] {
        let options = ReferenceOptions {
            max_distance: Some(max_distance),
            ..ReferenceOptions::recommended()
        };
        let lighting = Lighting::default();
        let shades = shade(Some(&occluder), &receivers, &lighting, &options, UNOBSERVED).unwrap();
        let expected = (1.0 - (h / max_distance).powi(2)).max(0.0);
        let measured = rms(shades
            .iter()
            .map(|s| f64::from(s.occlusion.mean) - expected));
        assert!(measured <= MAX_RMSE, "{max_distance}: {measured}");
    }
}
