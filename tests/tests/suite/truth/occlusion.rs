//! Scenes whose occlusion has a closed form.

use aogrid_bake_core::UNOBSERVED;
use aogrid_bake_core::models::Model;
use aogrid_baker_cpu::RayScene;
use aogrid_scene::reference::{Lighting, ReferenceOptions, ShadingEstimate, shade};
use aogrid_tests::{form_factor, mesh_of};

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

/// Returns a ceiling like a disc, of 64 corners, above the floor.
fn disc() -> KnownScene {
    let corner = |idx: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(idx) / 64.0).sin_cos();
        [0.5 + 0.8 * cos, 0.4, 0.5 + 0.8 * sin].map(|v| v as f32)
    };
    let triangles: Vec<_> = (1..63).map(|i| [0, i, i + 1].map(corner)).collect();
    let polygon: Vec<_> = (0..64).map(|i| corner(i).map(f64::from)).collect();
    let receivers = floor(|u, v| Some([3.0 * u - 1.0, 3.0 * v - 1.0]));
    known("disc", mesh_of(&triangles), receivers, move |at| {
        form_factor(&polygon, at, UP)
    })
}

fn all_known() -> [KnownScene; 6] {
    [ball(), cube(), corner(), wall(), endless_wall(), disc()]
}

fn occlusion(known: &KnownScene, samples: u32) -> Vec<ShadingEstimate> {
    let options = ReferenceOptions {
        samples,
        ..ReferenceOptions::recommended()
    };
    occlusion_with(known, &options)
}

fn occlusion_with(known: &KnownScene, options: &ReferenceOptions) -> Vec<ShadingEstimate> {
    let occluder = RayScene::new(&known.mesh);
    let lighting = Lighting::default();
    shade(
        Some(&occluder),
        &known.receivers,
        &lighting,
        options,
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

/// The share of normal numbers within twice their standard deviation is 0.954.
const MIN_WITHIN_TWICE: f64 = 0.95;

/// With some 300 rays about ten pairs differ, and the standard error is uncertain itself: of
/// Student's t with nine degrees of freedom, 0.923 are within 2.
const MIN_WITHIN_TWICE_OF_FEW: f64 = 0.92;

/// The largest bias of the reference.
const MAX_BIAS: f64 = 2e-4;

/// Returns all errors over the known scenes with some options, and the standard errors.
fn all_errors(options: &ReferenceOptions, seeds: u64) -> Vec<[f64; 2]> {
    let mut errors = vec![];
    for (known, seed) in all_known()
        .iter()
        .flat_map(|k| (0..seeds).map(move |s| (k, s)))
    {
        let shades = occlusion_with(known, &ReferenceOptions { seed, ..*options });
        errors.extend(shades.iter().zip(&known.expected).map(|(shade, expected)| {
            let found = shade.occlusion;
            [
                f64::from(found.mean) - expected,
                f64::from(found.standard_error),
            ]
        }));
    }
    errors
}

/// Checks the bias and how often an error is at most twice the standard error.
fn check_errors(name: &str, errors: &[[f64; 2]], min_within: f64) {
    let n = errors.len() as f64;
    let bias = errors.iter().map(|[error, _]| error).sum::<f64>() / n;
    // If every ray or none hits, the standard error is 0, and the error that of single floats.
    let is_within = |[error, standard]: &&[f64; 2]| error.abs() <= 2.0 * standard + 1e-6;
    let within = errors.iter().filter(is_within).count() as f64 / n;
    println!("{name}: bias {bias:.1e}, {within:.4} of {n} within twice the standard error");
    assert!(bias.abs() <= MAX_BIAS, "{name}: bias {bias}");
    // Three standard deviations of a share of n.
    let spread = 3.0 * (min_within * (1.0 - min_within) / n).sqrt();
    assert!(within >= min_within - spread, "{name}: {within}");
}

#[test]
fn the_suites_truth_has_no_bias_and_knows_its_error() {
    let options = ReferenceOptions {
        samples: 4096,
        ..ReferenceOptions::recommended()
    };
    check_errors("4096 rays", &all_errors(&options, 1), MIN_WITHIN_TWICE);
}

#[test]
fn rays_until_a_standard_error_reach_it_without_bias() {
    for error in [0.002, 0.004] {
        let options = ReferenceOptions {
            error: Some(error),
            ..ReferenceOptions::recommended()
        };
        let errors = all_errors(&options, 4);
        let measured = rms(errors.iter().map(|[error, _]| *error));
        println!("{error}: RMSE {measured:.5}");
        assert!(measured <= error, "{measured} for {error}");
        check_errors(&format!("error {error}"), &errors, MIN_WITHIN_TWICE_OF_FEW);
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
