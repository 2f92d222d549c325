//! Tests of the path-traced reference against closed forms, its own error estimate, and itself.

use std::ops::ControlFlow;

use aogrid_bake_core::models::Model;
use aogrid_bake_core::{TriangleMesh, UNOBSERVED};
use aogrid_baker_cpu::RayScene;
use aogrid_scene::reference::{
    AreaLight, Environment, Lighting, Receiver, ReferenceError, ReferenceOptions, ShadingEstimate,
    shade,
};
use aogrid_tests::{form_factor, mesh_of};

/// The largest RMSE over the receivers of a scene, at the default number of samples.
const MAX_RMSE: f64 = 1e-3;

const UP: [f64; 3] = [0.0, 1.0, 0.0];

/// A scene whose occlusion is known.
struct KnownScene {
    name: &'static str,
    mesh: TriangleMesh,
    receivers: Vec<Receiver>,
    expected: Vec<f64>,
}

/// Returns receivers on the floor, facing up, each at another position.
fn floor(position_at: impl Fn(f64, f64) -> Option<[f64; 2]>) -> Vec<Receiver> {
    let n = 16;
    let step = |i: i32| (f64::from(i) + 0.37) / f64::from(n);
    let squares = (0..n * n).map(|idx| [step(idx % n), step(idx / n)]);
    let placed = squares.filter_map(|[u, v]| position_at(u, v));
    placed
        .map(|[x, z]| Receiver {
            position: [x, 0.0, z],
            normal: UP,
        })
        .collect()
}

/// Returns two triangles for each quad.
fn quads(quads: &[[[f64; 3]; 4]]) -> TriangleMesh {
    let triangles = quads.iter().flat_map(|q| {
        let [a, b, c, d] = q.map(|p| p.map(|v| v as f32));
        [[a, b, c], [a, c, d]]
    });
    mesh_of(&triangles.collect::<Vec<_>>())
}

fn known(
    name: &'static str,
    mesh: TriangleMesh,
    receivers: Vec<Receiver>,
    ao: impl Fn([f64; 3]) -> f64,
) -> KnownScene {
    let expected = receivers.iter().map(|r| ao(r.position)).collect();
    KnownScene {
        name,
        mesh,
        receivers,
        expected,
    }
}

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

/// Returns a cube on the floor: convex, so the form factors of the sides that face the receiver add
/// up.
fn cube() -> KnownScene {
    let mesh = Model::Box.mesh(None).unwrap();
    let outside = |u: f64, v: f64| {
        let at = [3.0 * u - 1.5, 3.0 * v - 1.5];
        at.iter().any(|x| x.abs() > 0.501).then_some(at)
    };
    known("cube", mesh, floor(outside), |[x, _, z]| {
        let side = |at: f64, swap: bool| {
            let corner = |along: f64, y: f64| match swap {
                false => [at, y, along],
                true => [along, y, at],
            };
            [
                corner(-0.5, 0.0),
                corner(0.5, 0.0),
                corner(0.5, 1.0),
                corner(-0.5, 1.0),
            ]
        };
        let mut sum = 0.0;
        for (v, swap) in [(x, false), (z, true)] {
            if v.abs() > 0.5 {
                sum += form_factor(&side(0.5 * v.signum(), swap), [x, 0.0, z], UP);
            }
        }
        sum
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

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len() as f64;
    (values.map(|v| v * v).sum::<f64>() / n).sqrt()
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

/// Returns a sky of few texels, one of them a sun, rotated about the world's x axis, and its
/// irradiance over π on the floor.
fn sunny() -> (Environment, [f64; 3]) {
    let size = [16, 8];
    let mut texels: Vec<_> = (0..128)
        .map(|i| [0.1 + 0.01 * i as f32, 0.3, 0.2])
        .collect();
    texels[2 * 16 + 5] = [4000.0, 3000.0, 2000.0];
    let (sin, cos) = 0.4_f64.sin_cos();
    let rows = [[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]];
    let environment = Environment::new(size, texels, rows).unwrap();
    // The mean over the cosine-weighted hemisphere, at 1024 × 512 points of the sphere.
    let (mut sum, n) = ([0.0; 3], 512);
    for row in 0..n {
        let (up, sin_colatitude) =
            (std::f64::consts::PI * (0.5 - (f64::from(row) + 0.5) / f64::from(n))).sin_cos();
        for column in 0..2 * n {
            let (x, z) =
                (std::f64::consts::PI * (f64::from(column) + 0.5) / f64::from(n)).sin_cos();
            let direction = [sin_colatitude * x, up, sin_colatitude * z];
            let radiance = environment.radiance(direction);
            let weight =
                up.max(0.0) * sin_colatitude * (std::f64::consts::PI / f64::from(n)).powi(2);
            for c in 0..3 {
                sum[c] += f64::from(radiance[c]) * weight / std::f64::consts::PI;
            }
        }
    }
    (environment, sum)
}

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

#[test]
fn results_depend_on_the_seed_and_not_on_the_number_of_threads() {
    let known = cube();
    let with = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let options = ReferenceOptions {
            samples: 100,
            seed,
            max_distance: None,
        };
        let occluder = RayScene::new(&known.mesh);
        let (environment, _) = sunny();
        let lighting = Lighting {
            environment: Some(&environment),
            ..Lighting::default()
        };
        let run = || {
            shade(
                Some(&occluder),
                &known.receivers,
                &lighting,
                &options,
                UNOBSERVED,
            )
        };
        pool.unwrap().install(run).unwrap()
    };
    assert_eq!(with(1, 0), with(3, 0));
    assert_ne!(with(1, 0), with(1, 1));
}

#[test]
fn an_observer_sees_every_receiver_and_can_cancel() {
    let known = cube();
    let occluder = RayScene::new(&known.mesh);
    let run = |observer: aogrid_bake_core::Observer<'_>| {
        let options = ReferenceOptions {
            samples: 2,
            ..ReferenceOptions::recommended()
        };
        let lighting = Lighting::default();
        shade(
            Some(&occluder),
            &known.receivers,
            &lighting,
            &options,
            observer,
        )
    };
    let last = std::sync::atomic::AtomicUsize::new(0);
    run(&|progress| {
        assert_eq!(progress.total, known.receivers.len());
        last.fetch_max(progress.done, std::sync::atomic::Ordering::Relaxed);
        ControlFlow::Continue(())
    })
    .unwrap();
    assert_eq!(last.into_inner(), known.receivers.len());
    assert_eq!(
        run(&|_| ControlFlow::Break(())),
        Err(ReferenceError::Cancelled)
    );
}
