//! Surface bakes in scenes, against ray tracing.

use std::path::Path;

use aogrid_bake_core::surface::Weights;
use aogrid_scene::shade::{Mode, ShadeInput, Shaded, Target};
use aogrid_scene::{GBuffer, LoadOptions, Scene, SurfaceSource, parse};

/// A view from above.
const CAMERA: &str =
    "[camera]\nposition = [1.2, 2.5, 2]\ntarget = [0, 0.2, 0]\nresolution = [32, 24]\n";

/// The error of 512 shared directions against a closed form, root mean square, with that of 2,048 rays.
const NOISE: f64 = 0.009;

fn scene(text: &str) -> Scene {
    let text = format!("truth = {{ samples = 2048 }}\n{CAMERA}{text}");
    parse(Path::new("surface.toml"), &text, LoadOptions::default()).unwrap()
}

fn shaded<const N: usize>(scene: &Scene, modes: [&str; N]) -> ([Shaded; N], Vec<u32>) {
    let gbuffer = GBuffer::trace(scene, aogrid_bake_core::UNOBSERVED).unwrap();
    let target = Target::of_picture(gbuffer);
    let environment = scene.environment.as_ref().map(|e| e.load().unwrap().0);
    let mut input = ShadeInput::new(scene, &target);
    input.environment = environment.as_ref();
    let shade = |name| Mode::named(name).unwrap().shade(&input).unwrap();
    (modes.map(shade), target.ids.clone())
}

/// Returns the root mean square of differences where `chosen` receivers lie.
fn rmse(a: &[f32], b: &[f32], chosen: impl Fn(usize) -> bool) -> f64 {
    let all = (0..a.len()).filter(|&idx| chosen(idx));
    let squares: Vec<_> = all.map(|idx| f64::from(a[idx] - b[idx]).powi(2)).collect();
    assert!(squares.len() > 50, "{} receivers", squares.len());
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

const ALONE: &str = "[[mesh]]\nname = 'm'\nsample = 'comb'\n[[instance]]\nmesh = 'm'\n\
                     rotate = { axis = [1, 2, 3], degrees = 20 }\nscale = [-1, 1, 1]\n";

#[test]
fn accessibility_is_the_truth_of_an_object_alone() {
    let scene = scene(ALONE);
    let ([truth, own], _) = shaded(&scene, ["truth", "accessibility"]);
    let error = rmse(&truth.occlusion, &own.occlusion, |_| true);
    let mean = truth.occlusion.iter().sum::<f32>() / truth.occlusion.len() as f32;
    println!("a comb, turned and mirrored: {error:.4} of {mean:.3}");
    assert!(mean > 0.05, "{mean}");
    assert!(error < NOISE, "{error}");
}

/// An object's own grid is too coarse for its teeth.
#[test]
fn surfaces_with_neighbors_are_better_than_grids_alone() {
    let text = format!(
        "{ALONE}[[mesh]]\nname = 'ball'\nsample = 'sphere'\n[[instance]]\nmesh = 'ball'\n\
         translate = [0, 1.2, 0]\nscale = 0.4\n[environment]\n{ROOM}"
    );
    let scene = scene(&text);
    let modes = [
        "truth",
        "cone",
        "surface-cone",
        "environment",
        "surface-environment",
    ];
    let ([truth, cone, surface, environment, surface_environment], ids) = shaded(&scene, modes);
    let on_comb = |idx: usize| ids[idx] == 1;
    let occlusion = |found: &Shaded| rmse(&truth.occlusion, &found.occlusion, on_comb);
    let (grids, own) = (occlusion(&cone), occlusion(&surface));
    println!("AO on the comb: cone {grids:.4}, surface-cone {own:.4}");
    assert!(own < 0.03 && own < 0.5 * grids, "{own} {grids}");
    let light = |found: &Shaded| {
        let of = |shaded: &Shaded| {
            shaded
                .light
                .as_ref()
                .unwrap()
                .iter()
                .map(|c| c[0])
                .collect()
        };
        let [a, b]: [Vec<f32>; 2] = [of(&truth), of(found)];
        rmse(&a, &b, on_comb)
    };
    let (grids, own, flat) = (
        light(&environment),
        light(&surface_environment),
        light(&surface),
    );
    println!(
        "red light: environment {grids:.4}, surface-environment {own:.4}, surface-cone {flat:.4}"
    );
    assert!(own < 0.7 * grids, "{own} {grids} {flat}");
}

/// A room that is red on one side alone.
const ROOM: &str = "room = { right = [1, 0.2, 0.2], left = [0.1, 0.2, 0.2], ceiling = [0.5, 0.5, 0.5], \
                    floor = [0.2, 0.2, 0.2], front = [0.3, 0.5, 0.5], back = [0.3, 0.5, 0.5] }\n";

#[test]
fn an_instance_that_does_not_cast_on_itself_is_open() {
    for key in [
        "casts = false",
        "excludes = [1]",
        "casts_on = [3]",
        "strength = 0",
    ] {
        let scene = scene(&format!("{ALONE}{key}\n"));
        let ([own], _) = shaded(&scene, ["accessibility"]);
        assert!(own.occlusion.iter().all(|ao| *ao == 0.0), "{key}");
    }
}

#[test]
fn a_mesh_names_the_options_of_its_bake() {
    let uniform = ALONE.replace(
        "'comb'",
        "'comb'\nsurface = { weights = 'uniform', rays = 64 }",
    );
    let scene = scene(&uniform);
    let SurfaceSource::Bake(options) = &scene.meshes[0].surface else {
        panic!("it is baked");
    };
    assert_eq!((options.weights, options.rays), (Weights::Uniform, 64));
}
