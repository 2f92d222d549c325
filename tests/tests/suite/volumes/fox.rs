//! A skinned model: exact against rays that count as volumes do, and how far from ray tracing.

use aogrid_runtime::VolumeWeight;
use aogrid_scene::reference::Receiver;
use aogrid_scene::shade::Target;
use aogrid_scene::{Scene, VolumeSettings};
use aogrid_tests::shared;
use glam::DVec3;
use rayon::prelude::*;

use super::rays::{Counted, Weighted};
use super::{rmse, scene_with, shaded_at};

/// The fox's height in the pose of its nodes.
const HEIGHT: f32 = 79.0;

/// The noise of 6,400 stratified rays a receiver, which an exact sum leaves.
const RAYS: f64 = 1e-3;

/// Returns the fox in a pose, and points on the floor around it; `None` without the data.
fn fox(pose: &str) -> Option<Scene> {
    let file = shared("data/meshes/Fox_skinned.glb")?;
    let text = format!(
        "[[mesh]]\nname = 'fox'\nfile = '{}'\npose = {pose}\n[[instance]]\nmesh = 'fox'\n\
         [receivers]\ncorner = [-40, -0.2, 90]\nu = [80, 0, 0]\nv = [0, 0, -200]\ncount = [12, 24]\n",
        file.display()
    );
    Some(scene_with(1024, &text))
}

fn on_floor(scene: &Scene) -> Target {
    Target::of_list(scene.receivers.as_ref().unwrap())
}

fn triangles(scene: &Scene) -> Vec<[DVec3; 3]> {
    let corners = scene.meshes[0].mesh.corners();
    let corners = corners.map(|corners| corners.map(|p| DVec3::from(p.map(f64::from))));
    corners.collect()
}

/// Returns the centers of every third triangle, lifted off it by a millionth of the height.
fn on_itself(scene: &Scene) -> Target {
    let of = |[a, b, c]: [DVec3; 3]| {
        let normal = (b - a).cross(c - a).normalize();
        let position = (a + b + c) / 3.0 + 1e-6 * f64::from(HEIGHT) * normal;
        Receiver {
            position: position.to_array(),
            normal: normal.to_array(),
        }
    };
    let points: Vec<_> = triangles(scene).into_iter().step_by(3).map(of).collect();
    let ids = vec![1; points.len()];
    Target::of_points(points, ids)
}

fn settings(extent: f32, weight: VolumeWeight) -> VolumeSettings {
    VolumeSettings {
        extent: Some(extent * HEIGHT),
        weight,
        two_sided: false,
    }
}

/// Returns AO by rays that count every triangle that they meet, and the heaviest alone.
fn by_rays(scene: &Scene, target: &Target) -> [Vec<f32>; 2] {
    let weighted = Weighted {
        triangles: triangles(scene),
        extent: f64::from(scene.volumes.extent.unwrap()),
        weight: scene.volumes.weight,
    };
    let count = |receiver: &Receiver| weighted.count(receiver);
    let counted: Vec<Counted> = target.receivers.par_iter().map(count).collect();
    [
        counted.iter().map(|c| c.every as f32).collect(),
        counted.iter().map(|c| c.heaviest as f32).collect(),
    ]
}

#[test]
fn the_fox_is_shaded_as_by_rays_that_count_every_triangle() {
    let Some(mut scene) = fox("{ animation = 'Walk', time = 0.3 }") else {
        return;
    };
    let linear = VolumeWeight::Linear { exponent: 1.0 };
    for extent in [0.25, 0.5] {
        for (name, target) in [("floor", on_floor(&scene)), ("itself", on_itself(&scene))] {
            scene.volumes = settings(extent, linear);
            let [volumes] = shaded_at(&scene, &target, ["volumes"]);
            let [every, heaviest] = by_rays(&scene, &target);
            let error = rmse(&[volumes.clone(), every]);
            let darker = volumes.iter().zip(&heaviest).map(|(a, b)| f64::from(a - b));
            let darker = darker.sum::<f64>() / volumes.len() as f64;
            println!(
                "{name}, extent {extent}: {error:.1e}, darker than the heaviest by {darker:.4}"
            );
            assert!(error <= RAYS, "{name}, {extent}: {error}");
            assert!(darker > 0.0, "{name}, {extent}: {darker}");
        }
    }
}

/// Returns the values of receivers outside the model: joints push some triangles into it.
fn outside([volumes, truth]: &[Vec<f32>; 2]) -> [Vec<f32>; 2] {
    let pairs = volumes.iter().zip(truth);
    pairs.filter(|(_, truth)| **truth < 0.99).unzip().into()
}

/// The walk, without a bake: near ray tracing on the floor, where few surfaces are behind one another.
#[test]
fn the_walking_fox_is_near_ray_tracing_on_the_floor() {
    /// The errors that surfaces behind one another leave on the floor and on the fox.
    const MAX_ERROR: [f64; 2] = [0.04, 0.02];
    for pose in [
        "{}",
        "{ animation = 'Walk', time = 0 }",
        "{ animation = 'Walk', time = 0.3 }",
    ] {
        let Some(mut scene) = fox(pose) else {
            return;
        };
        scene.volumes = settings(100.0, VolumeWeight::None);
        let targets = [("floor", on_floor(&scene)), ("itself", on_itself(&scene))];
        for ((name, target), max) in targets.into_iter().zip(MAX_ERROR) {
            let shaded = shaded_at(&scene, &target, ["volumes", "truth"]);
            let shaded = outside(&shaded);
            let error = rmse(&shaded);
            let most = shaded[0].iter().zip(&shaded[1]).map(|(a, b)| a - b);
            let most = most.fold(f32::NEG_INFINITY, f32::max);
            println!("{pose} {name}: rmse {error:.4}, too dark by at most {most:.3}");
            assert!(error <= max, "{pose} {name}: {error}");
        }
    }
}
