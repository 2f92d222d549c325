//! Ambient occlusion volumes against ray tracing: exact where no occluder hides another, and how far
//! they are off where one does.

mod fox;
mod gpu;
mod inexact;
mod pose;
mod rays;
mod weights;

use std::path::Path;

use aogrid_scene::shade::{Mode, ShadeInput, Target};
use aogrid_scene::{LoadOptions, Scene, parse};

/// The noise of 4,096 stratified rays a receiver, which an exact sum leaves.
const NOISE: f64 = 2e-3;

/// Receivers on the floor under and around the occluders.
const FLOOR: &str =
    "[receivers]\ncorner = [-1.5, 0.0001, 1.5]\nu = [3, 0, 0]\nv = [0, 0, -3]\ncount = [24, 24]\n";

fn scene(text: &str) -> Scene {
    scene_with(4096, text)
}

/// Returns a scene with this many rays a receiver for truth.
fn scene_with(samples: u32, text: &str) -> Scene {
    let text = format!("truth = {{ samples = {samples} }}\n{text}");
    parse(Path::new("volumes.toml"), &text, LoadOptions::default()).unwrap()
}

/// Returns AO of two modes at the scene's receivers.
fn shaded(scene: &Scene) -> [Vec<f32>; 2] {
    let target = Target::of_list(scene.receivers.as_ref().unwrap());
    shaded_at(scene, &target, ["volumes", "truth"])
}

/// Returns AO of modes at a target.
fn shaded_at<const N: usize>(scene: &Scene, target: &Target, modes: [&str; N]) -> [Vec<f32>; N] {
    let input = ShadeInput::new(scene, target);
    modes.map(|name| Mode::named(name).unwrap().shade(&input).unwrap().occlusion)
}

fn rmse([a, b]: &[Vec<f32>; 2]) -> f64 {
    assert!(a.len() > 100, "{}", a.len());
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64
}

#[test]
fn one_convex_object_is_exact_on_the_floor() {
    for model in ["box", "sphere", "rod"] {
        let scene = scene(&format!(
            "[volumes]\nextent = 100\nweight = 'none'\n[[mesh]]\nname = 'a'\nsample = '{model}'\n\
             [[instance]]\nmesh = 'a'\ntranslate = [0, 0.7, 0]\nrotate = {{ axis = [1, 2, 3], degrees = 40 }}\n{FLOOR}"
        ));
        let shaded = shaded(&scene);
        let error = rmse(&shaded);
        println!("{model}: mean {:.3}, off by {error:.1e}", mean(&shaded[1]));
        assert!(
            mean(&shaded[1]) > 0.01 && error <= NOISE,
            "{model}: {error}"
        );
    }
}

#[test]
fn a_convex_object_does_not_hide_itself() {
    let text = "[volumes]\nextent = 100\nweight = 'none'\n[camera]\nposition = [2, 2, 3]\n\
                target = [0, 0.5, 0]\nresolution = [48, 36]\n[[mesh]]\nname = 'a'\nsample = 'sphere'\n\
                [[instance]]\nmesh = 'a'\n";
    let scene = scene(text);
    let gbuffer = aogrid_scene::GBuffer::trace(&scene, aogrid_bake_core::UNOBSERVED).unwrap();
    let target = Target::of_picture(gbuffer);
    assert!(target.receivers.len() > 100);
    let input = ShadeInput::new(&scene, &target);
    let occlusion = Mode::named("volumes")
        .unwrap()
        .shade(&input)
        .unwrap()
        .occlusion;
    assert!(occlusion.iter().all(|ao| *ao == 0.0));
}
