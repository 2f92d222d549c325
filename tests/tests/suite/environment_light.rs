//! Environment light occluded by exact cones, against ray tracing, and prefiltered maps against
//! integrals over real ones.

use std::path::Path;

use aogrid_bake_core::UNOBSERVED;
use aogrid_bake_core::models::Model;
use aogrid_baker_cpu::RayScene;
use aogrid_runtime::environment::*;
use aogrid_runtime::shading::*;
use aogrid_runtime::{AogridCone, AogridEnvironment, CpuTexture, EnvironmentMap};
use aogrid_scene::reference::{self, Environment, Lighting, Lobe, Receiver, ReferenceOptions};
use aogrid_scene::{LoadOptions, parse};
use aogrid_tests::{shared, sphere_fraction};
use glam::DVec3;
use rayon::prelude::*;

/// Receivers with their combined occlusion, however it was found, and the geometry that occludes
/// them.
pub struct OccludedReceivers {
    pub receivers: Vec<Receiver>,
    /// The sum of all (AO/2) d′ and the product of all 1 − AO.
    pub combined: Vec<[f32; 4]>,
    pub occluder: RayScene,
}

/// An environment, and the prefiltered map and uniform that a renderer has of it.
pub struct Light {
    pub name: &'static str,
    environment: Environment,
    map: EnvironmentMap,
    uniform: AogridEnvironment,
}

/// Samples per receiver. The noise is a few thousandths of AO, and most of it is known and
/// subtracted.
const SAMPLES: u32 = 1024;

pub fn options(samples: u32) -> ReferenceOptions {
    ReferenceOptions {
        samples,
        ..ReferenceOptions::recommended()
    }
}

/// Returns a ball with its exact cones, over a floor that it nearly touches and beside a wall.
fn ball() -> OccludedReceivers {
    let mesh = Model::Sphere.mesh(Some(20_000)).unwrap();
    let bounds = mesh.bounds();
    let center = DVec3::from(bounds.center().map(f64::from));
    let radius = bounds.half_extents()[1];
    let plane = |origin: DVec3, [u, v]: [DVec3; 2]| {
        (0..20 * 20).map(move |idx| {
            let [s, t] = [idx % 20, idx / 20].map(|k| f64::from(k) / 9.5 - 1.0);
            Receiver {
                position: (center + radius * (origin + 3.0 * s * u + 3.0 * t * v)).to_array(),
                normal: u.cross(v).to_array(),
            }
        })
    };
    let floor = plane(-1.1 * DVec3::Y, [DVec3::Z, DVec3::X]);
    let wall = plane(-1.5 * DVec3::Z + DVec3::Y, [DVec3::X, DVec3::Y]);
    let receivers: Vec<_> = floor.chain(wall).collect();
    let table = CpuTexture::clip_table();
    let combined = receivers.iter().map(|receiver| {
        let towards = center - DVec3::from(receiver.position);
        let a = sphere_fraction(radius, towards.length()) as f32;
        let axis = towards.normalize().as_vec3().to_array();
        let n = receiver.normal.map(|x| x as f32);
        let [occlusion, _, weight] = aogrid_clip(&table, a, aogrid_cos_beta(axis, n));
        let [x, y, z] = aogrid_clipped_axis(axis, n, weight).map(|d| 0.5 * occlusion * d);
        [x, y, z, 1.0 - occlusion]
    });
    OccludedReceivers {
        combined: combined.collect(),
        receivers,
        occluder: RayScene::new(&mesh),
    }
}

/// Returns a map whose radiance is a function of height.
fn map_by_height(radiance: impl Fn(f64) -> [f32; 3]) -> Environment {
    const HEIGHT: usize = 64;
    let row = |row: usize| {
        let height = (std::f64::consts::PI * (0.5 - (row as f64 + 0.5) / HEIGHT as f64)).sin();
        [radiance(height); 2 * HEIGHT]
    };
    let texels = (0..HEIGHT).flat_map(row).collect();
    Environment::new([2 * HEIGHT, HEIGHT], texels, UPRIGHT).unwrap()
}

const UPRIGHT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Returns a map from a dark ground to a sky that is brightest and bluest overhead.
fn gradient() -> Environment {
    map_by_height(|height| {
        let up = (0.5 * (height + 1.0)) as f32;
        [0.05 + 0.5 * up * up, 0.05 + 0.7 * up * up, 0.05 + up * up]
    })
}

fn parse_environment(lines: &str) -> Environment {
    let text = format!("[environment]\n{lines}\n");
    let scene = parse(Path::new("test.toml"), &text, LoadOptions::default()).unwrap();
    scene.environment.unwrap().load().unwrap().0
}

/// Returns the walls of `scenes/room.toml`.
fn room() -> Environment {
    parse_environment(
        "room.right = [0.1, 0.15, 0.9]\nroom.left = [0.9, 0.1, 0.08]\nroom.ceiling = [1.6, 1.6, 1.6]\n\
         room.floor = [0.5, 0.5, 0.5]\nroom.front = [0.7, 0.7, 0.7]\nroom.back = [0.7, 0.7, 0.7]",
    )
}

/// Returns a map of the data folder, if it is there.
fn real_map(name: &str) -> Option<Environment> {
    let path = shared(&format!("data/env/{name}"))?;
    Some(parse_environment(&format!("file = '{}'", path.display())))
}

const REAL_MAPS: [&str; 4] = [
    "forest_dwab.exr",
    "spiaggia_di_mondello_1k.hdr",
    "venice_dwab.exr",
    "night_dwab.exr",
];

/// Returns the environments of this test, and those of the data folder that are there.
pub fn lights() -> Vec<Light> {
    let ours = [("gradient", gradient()), ("room", room())];
    let real_maps = REAL_MAPS
        .into_iter()
        .filter_map(|name| Some((name, real_map(name)?)));
    let all = ours.into_iter().chain(real_maps);
    all.map(|(name, environment)| Light::new(name, environment))
        .collect()
}

impl Light {
    fn new(name: &'static str, environment: Environment) -> Self {
        let map = EnvironmentMap::new(environment.size(), environment.texels()).unwrap();
        let rows = environment.map_from_world();
        let uniform = AogridEnvironment::from_rotation(rows.map(|row| row.map(|x| x as f32)));
        Self {
            name,
            environment,
            map,
            uniform,
        }
    }
}

/// The RMS errors over receivers and color channels, over the mean of the reference: of our model,
/// of (1 − AO) times the unoccluded light, and of the printed formula. The reference's own
/// variance, which it estimates without bias, is subtracted.
pub type Errors = [f64; 3];

/// A function from a receiver's index to the light that it reflects.
type Estimator<'a> = &'a (dyn Fn(usize) -> [f32; 3] + Sync);

fn errors(truth: &[reference::ShadingEstimate], estimators: [Estimator<'_>; 3]) -> Errors {
    let square = |found: [f32; 3], truth: &reference::ShadingEstimate| -> f64 {
        let off = (0..3).map(|c| f64::from(found[c] - truth.light[c].mean).powi(2));
        off.sum()
    };
    let light = truth
        .iter()
        .flat_map(|s| s.light)
        .map(|c| f64::from(c.mean));
    let n = 3.0 * truth.len() as f64;
    let mean = light.sum::<f64>() / n;
    let light = truth.iter().flat_map(|s| s.light);
    let noise: f64 = light.map(|c| f64::from(c.standard_error).powi(2)).sum();
    estimators.map(|estimator| {
        let squares = (0..truth.len()).into_par_iter();
        let squares: Vec<_> = squares
            .map(|idx| square(estimator(idx), &truth[idx]))
            .collect();
        ((squares.iter().sum::<f64>() - noise).max(0.0) / n).sqrt() / mean
    })
}

/// Returns the cone of RR-5779, 5.3: around d, of the fraction AO/2.
fn printed_cone(combined: [f32; 4], normal: [f32; 3]) -> AogridCone {
    let axis = aogrid_occluded_cone(combined, normal).axis;
    AogridCone::new(axis, 0.5 * (1.0 - combined[3]))
}

/// Returns all of the light less a share of the occluded light.
fn subtract(all: [f32; 3], share: f32, lost: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|c| (all[c] - share * lost[c]).max(0.0))
}

/// Returns the errors of diffuse receivers.
pub fn diffuse(found: &OccludedReceivers, light: &Light, samples: u32) -> Errors {
    let lighting = Lighting {
        environment: Some(&light.environment),
        ..Default::default()
    };
    let (occluder, options) = (Some(&found.occluder), options(samples));
    let truth = reference::shade(occluder, &found.receivers, &lighting, &options, UNOBSERVED);
    let Light { map, uniform, .. } = light;
    let normal = |idx: usize| found.receivers[idx].normal.map(|x| x as f32);
    let ours = |idx: usize| aogrid_lambertian(uniform, map, found.combined[idx], normal(idx));
    let all = |idx: usize| aogrid_irradiance(uniform, map, normal(idx));
    let darkened = |idx: usize| all(idx).map(|v| v * found.combined[idx][3]);
    let printed = |idx: usize| {
        let combined = found.combined[idx];
        let lost = aogrid_cone_radiance(uniform, map, &printed_cone(combined, normal(idx)));
        subtract(all(idx), 1.0 - combined[3], lost)
    };
    errors(&truth.unwrap(), [&ours, &darkened, &printed])
}

/// Returns the errors of glossy receivers, as seen from above and in front.
fn glossy(found: &OccludedReceivers, light: &Light, half_angle: f64) -> Errors {
    let eye = DVec3::new(2.0, 2.5, 4.0);
    let lobe = |receiver: &Receiver| {
        let towards = (eye - DVec3::from(receiver.position)).normalize();
        Lobe::seen_from(towards.to_array(), *receiver, half_angle.to_radians())
    };
    let lobes: Vec<_> = found.receivers.iter().map(lobe).collect();
    let lighting = Lighting {
        environment: Some(&light.environment),
        ..Default::default()
    };
    let (occluder, options) = (Some(&found.occluder), options(SAMPLES));
    let truth = reference::reflect(occluder, &lobes, &lighting, &options, UNOBSERVED);
    let fraction = (0.5 * (1.0 - half_angle.to_radians().cos())) as f32;
    let Light { map, uniform, .. } = light;
    let normal = |idx: usize| found.receivers[idx].normal.map(|x| x as f32);
    let axis = |idx: usize| lobes[idx].axis.map(|x| x as f32);
    let reflected = |idx: usize, combined| {
        aogrid_glossy(uniform, map, combined, normal(idx), axis(idx), fraction)
    };
    let ours = |idx: usize| reflected(idx, found.combined[idx]);
    let all = |idx: usize| reflected(idx, [0.0, 0.0, 0.0, 1.0]);
    let darkened = |idx: usize| all(idx).map(|v| v * found.combined[idx][3]);
    let printed = |idx: usize| {
        let cone = printed_cone(found.combined[idx], normal(idx));
        let shared = aogrid_shared_cone(&AogridCone::new(axis(idx), fraction), &cone);
        let lost = aogrid_cone_radiance(uniform, map, &cone);
        subtract(all(idx), shared.fraction / fraction, lost)
    };
    errors(&truth.unwrap(), [&ours, &darkened, &printed])
}

pub fn report(what: &str, name: &str, [ours, darkened, printed]: Errors) {
    let [left, left_as_printed] = [ours, printed].map(|error| error / darkened);
    println!(
        "{what:24} {name:28} {ours:.4}, (1 - AO) B {darkened:.4}: {left:.2} of it, \
         {left_as_printed:.2} around d with AO/2"
    );
}

/// The printed formula B − A would be zero under a constant sky.
#[test]
fn a_constant_sky_is_darkened_by_ao_and_a_lobe_by_its_occluded_share() {
    let sky = Light::new("constant", map_by_height(|_| [0.5, 1.0, 2.0]));
    let ball = ball();
    for (receiver, &combined) in ball.receivers.iter().zip(&ball.combined) {
        let n = receiver.normal.map(|x| x as f32);
        let light = aogrid_lambertian(&sky.uniform, &sky.map, combined, n);
        for (light, sky) in light.into_iter().zip([0.5, 1.0, 2.0]) {
            assert!(
                (light / sky - combined[3]).abs() < 0.005,
                "{light} {combined:?}"
            );
        }
    }
    // AO is exact except for a table's 0.001 and the ball's 20,000 triangles, and so is the light.
    let errors = diffuse(&ball, &sky, 4 * SAMPLES);
    println!("ball, {}: {:.4}", sky.name, errors[0]);
    assert!(errors[0] < 0.005, "{errors:?}");
    for half_angle in LOBES {
        let errors = glossy(&ball, &sky, half_angle);
        report(&format!("ball, lobe of {half_angle}°"), sky.name, errors);
        assert!(errors[0] < 0.5 * errors[1], "{half_angle}: {errors:?}");
    }
}

/// Half-angles of glossy lobes, in degrees.
const LOBES: [f64; 3] = [10.0, 25.0, 50.0];

/// The cones are exact, so that only the light's model is judged.
#[test]
fn a_ball_s_shadow_has_at_most_half_the_error_of_darkening() {
    let ball = ball();
    for light in lights() {
        let errors = diffuse(&ball, &light, SAMPLES);
        report("ball", light.name, errors);
        assert!(errors[0] < 0.5 * errors[1], "{}: {errors:?}", light.name);
        assert!(errors[0] < errors[2], "{}: {errors:?}", light.name);
    }
}

#[test]
fn a_ball_is_mirrored_in_glossy_surfaces() {
    let ball = ball();
    for light in lights() {
        // A sun of one texel is either in a lobe or not: the reference itself is noise there.
        if light.name == SUN {
            continue;
        }
        for half_angle in LOBES {
            let errors = glossy(&ball, &light, half_angle);
            report(&format!("ball, lobe of {half_angle}°"), light.name, errors);
            let limit = if light.name == "forest_dwab.exr" {
                1.0
            } else {
                MAX_LOBE_ERROR
            };
            assert!(errors[0] < limit * errors[1], "{half_angle}: {errors:?}");
            assert!(errors[0] < errors[2], "{half_angle}: {errors:?}");
        }
    }
}

/// The largest error, relative to that of 1 − AO times the whole lobe. The forest has a higher
/// limit, as gaps between its leaves are small suns.
const MAX_LOBE_ERROR: f64 = 0.75;

const SUN: &str = "spiaggia_di_mondello_1k.hdr";

/// Returns the radiance over a cone by points of its own, weighted by the cosine to its axis.
fn integral(environment: &Environment, axis: DVec3, fraction: f64) -> DVec3 {
    const POINTS: u32 = 20_000;
    let sin_alpha = 2.0 * (fraction * (1.0 - fraction)).sqrt();
    let (u, v) = axis.any_orthonormal_pair();
    let radiance = |idx: u32| {
        let square = sin_alpha * sin_alpha * (f64::from(idx) + 0.5) / f64::from(POINTS);
        let (sin, cos) = (2.399_963_229_728_653 * f64::from(idx)).sin_cos();
        let d = square.sqrt() * (cos * u + sin * v) + (1.0 - square).sqrt() * axis;
        DVec3::from(environment.radiance(d.to_array()).map(f64::from))
    };
    (0..POINTS).map(radiance).sum::<DVec3>() / f64::from(POINTS)
}

/// Texels are filtered linearly and levels mixed by the logarithm of a fraction. This measures the
/// error of both, in maps without a sun, which points would miss.
#[test]
fn look_ups_are_close_to_integrals_over_real_maps() {
    for name in REAL_MAPS.into_iter().filter(|name| *name != SUN) {
        let Some(environment) = real_map(name) else {
            return;
        };
        let light = Light::new(name, environment);
        let off = |idx: u32, steps: f64| {
            let height = 1.0 - 2.0 * (f64::from(idx) * 0.754_877_666).fract();
            let (sin, cos) = (2.399_963_23 * f64::from(idx)).sin_cos();
            let level = 1.0 - height * height;
            let axis = DVec3::new(level.sqrt() * cos, height, level.sqrt() * sin);
            let fraction = 0.5 * 4.0_f64.powf(-steps);
            let cone = AogridCone::new(axis.as_vec3().to_array(), fraction as f32);
            let found = aogrid_cone_radiance(&light.uniform, &light.map, &cone).map(f64::from);
            let exact = integral(&light.environment, axis, fraction);
            let off = DVec3::from(found) - exact;
            [off.length_squared(), exact.length_squared()]
        };
        for steps in [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0] {
            let squares = (0..40).into_par_iter().map(|idx| off(idx, steps));
            let sum = squares.reduce(|| [0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
            let relative = (sum[0] / sum[1]).sqrt();
            println!("{name:28} level {:.1}: {relative:.4}", 4.0 - steps);
            let limit = if steps.fract() == 0.0 {
                MAX_ERROR_AT_LEVELS
            } else {
                MAX_ERROR_BETWEEN_LEVELS
            };
            assert!(relative < limit, "{name} {steps}: {relative}");
        }
    }
}

/// The largest error at whole levels, relative to the RMS radiance: linear filtering between texels
/// an eighth of a cone's half-angle apart, and an integral by 20,000 points.
const MAX_ERROR_AT_LEVELS: f64 = 0.03;

/// The largest error between levels, whose cones differ fourfold in solid angle. A bright gap in
/// the middle of two such cones has the mean radiances 1 and ¼. Halfway between it has ½, and the
/// mean of 1 and ¼ is 25 % more.
const MAX_ERROR_BETWEEN_LEVELS: f64 = 0.25;
