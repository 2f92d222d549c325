//! Tests of the committed scenes, cameras and G-buffers, and of the reference against an
//! independent program's truth.

use std::path::{Path, PathBuf};

use aogrid_bake_core::UNOBSERVED;
use aogrid_baker_cpu::RayScene;
use aogrid_grid_format::BoundaryMode;
use aogrid_scene::reference::{Lighting, ReferenceOptions, shade};
use aogrid_scene::{GBuffer, Grids, LoadOptions, Scene, load, parse};
use aogrid_tests::{files_with_ending, shared};
use glam::DVec3;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes")
}

fn scene(text: &str) -> Scene {
    parse(Path::new("test.toml"), text, LoadOptions::default()).unwrap()
}

#[test]
fn every_committed_scene_loads_and_shows_its_casters() {
    for path in files_with_ending(&folder(), ".toml") {
        let mut scene = load(&path, LoadOptions::default()).unwrap();
        // A few pixels are enough to see that the camera looks at something.
        scene.camera.as_mut().unwrap().resolution = [40, 30];
        let gbuffer = GBuffer::trace(&scene, UNOBSERVED).unwrap();
        let casters: Vec<u32> = scene.casters().map(|i| i.id).collect();
        let seen = gbuffer.ids.iter().filter(|id| casters.contains(id)).count();
        assert!(seen > 20, "{}: {seen} pixels", path.display());
        let beside = gbuffer.ids.iter().filter(|&&id| id == 1).count();
        assert!(beside > 100, "{}: {beside} pixels of floor", path.display());
    }
}

#[test]
fn the_robot_has_eleven_parts_and_the_crowd_as_many_as_asked_for() {
    let robot = load(&folder().join("robot.toml"), LoadOptions::default()).unwrap();
    assert_eq!(robot.casters().count(), 11);
    for n in [1, 17, 40] {
        let options = LoadOptions { occluders: Some(n) };
        let crowd = load(&folder().join("occluders.toml"), options).unwrap();
        assert_eq!(crowd.casters().count(), n);
        assert_eq!(crowd.instances.len(), n + 1, "the floor stays");
    }
}

#[test]
fn grids_are_baked_once_each_with_the_options_of_the_scene() {
    let scene = scene(
        "[[mesh]]\nname = 'a'\nsample = 'box'\ngrid = {resolution = [8, 9, 10], boundary = 'rr'}\n\
         [[mesh]]\nname = 'b'\nsample = 'box'\ngrid = {resolution = [8, 9, 10], boundary = 'rr'}\n\
         [[mesh]]\nname = 'c'\nrectangle = [1, 2]\n\
         [[instance]]\nmesh = 'a'\n[[instance]]\nmesh = 'b'\n[[instance]]\nmesh = 'c'\n",
    );
    let mut grids = Grids::new();
    let resolved = grids.resolve(&scene, UNOBSERVED).unwrap();
    let [Some(a), Some(b), None] = &resolved[..] else {
        panic!("a sheet does not cast");
    };
    assert!(std::sync::Arc::ptr_eq(a, b), "baked twice");
    assert_eq!(a.spec().resolution(), [8, 9, 10]);
    assert_eq!(a.record().boundary.requested, BoundaryMode::Rr);
    assert_eq!(a.record().source.triangles, 12);
    let again = grids.resolve(&scene, UNOBSERVED).unwrap();
    assert!(std::sync::Arc::ptr_eq(again[0].as_ref().unwrap(), a));
}

/// Returns a unit cube over a floor, rotated, lifted and mirrored, so that its triangles wind
/// inside out.
fn camera_scene(camera: &str) -> Scene {
    scene(&format!(
        "[camera]\nresolution = [64, 48]\n{camera}\n\
         [[mesh]]\nname = 'box'\nsample = 'box'\n[[mesh]]\nname = 'floor'\nrectangle = [9, 9]\n\
         [[instance]]\nmesh = 'floor'\nid = 7\n\
         [[instance]]\nmesh = 'box'\nid = 300\nscale = [-1, 1, 1]\ntranslate = [0.2, 0.25, 0]\n\
         rotate = {{axis = [0, 1, 0], degrees = 40}}\n"
    ))
}

#[test]
fn pixels_see_the_points_that_project_onto_them() {
    for camera in [
        "position = [2, 1.5, 3]\ntarget = [0, 0.5, 0]\nvertical_fov = 50",
        "position = [2, 1.5, 3]\ntarget = [0, 0.5, 0]\nheight = 3",
        "position = [0, 5, 0]\ntarget = [0, 0, 0]",
    ] {
        let scene = camera_scene(camera);
        let camera = scene.camera.as_ref().unwrap();
        let gbuffer = GBuffer::trace(&scene, UNOBSERVED).unwrap();
        let clip_from_world = camera.clip_from_world(0.1, 100.0);
        let mut seen = [0, 0];
        for (idx, &id) in gbuffer.ids.iter().enumerate() {
            if id == 0 {
                continue;
            }
            let position = DVec3::from(gbuffer.positions[idx].map(f64::from));
            let clip = clip_from_world * position.extend(1.0);
            let x = (clip.x / clip.w + 1.0) * 32.0;
            let y = (1.0 - clip.y / clip.w) * 24.0;
            let pixel = [(idx % 64) as f64 + 0.5, (idx / 64) as f64 + 0.5];
            // Positions are single floats: 2⁻²⁴ of 10 units, over a pixel of 1/20 unit or more.
            let off = (x - pixel[0]).abs().max((y - pixel[1]).abs());
            assert!(off < 1e-4, "{off}");
            assert!((0.0..1.0).contains(&(clip.z / clip.w)));
            let normal = DVec3::from(gbuffer.normals[idx].map(f64::from));
            assert!((normal.length() - 1.0).abs() < 1e-6);
            let [_, direction] = camera.ray([(idx % 64) as u32, (idx / 64) as u32]);
            assert!(normal.dot(direction) < 0.0, "the normal faces away");
            match id {
                7 => assert!(position.y.abs() < 1e-6 && normal.y == 1.0),
                300 => assert!((0.25..1.2501).contains(&position.y)),
                _ => panic!("no instance has id {id}"),
            }
            seen[usize::from(id == 300)] += 1;
        }
        assert!(seen.iter().all(|&n| n > 100), "{seen:?}");
    }
}

#[test]
fn a_world_with_z_up_is_the_same_world_turned() {
    let text = |up: &str, axes: [&str; 2]| {
        let [camera, floor] = axes;
        scene(&format!(
            "up = '{up}'\n[camera]\nresolution = [20, 15]\ntarget = [0, 0, 0]\n{camera}\n\
             [[mesh]]\nname = 'box'\nsample = 'sphere'\n[[mesh]]\nname = 'floor'\nrectangle = [4, 4]\n\
             [[instance]]\nmesh = 'box'\n{floor}[[instance]]\nmesh = 'floor'\n{floor}"
        ))
    };
    let turn = "rotate = {axis = [1, 0, 0], degrees = 90}\n";
    let y = text("y", ["position = [2, 1.5, 3]", ""]);
    let z = text("z", ["position = [2, -3, 1.5]", turn]);
    let [y, z] = [y, z].map(|scene| GBuffer::trace(&scene, UNOBSERVED).unwrap());
    assert_eq!(y.ids, z.ids);
    for (a, b) in y.positions.iter().zip(&z.positions) {
        let turned = [b[0], b[2], -b[1]];
        // Vertices round differently: 2⁻²⁴ of 2 units, over a grazing angle of a tenth.
        assert!(
            a.iter().zip(turned).all(|(a, b)| (a - b).abs() < 1e-5),
            "{a:?} {b:?}"
        );
    }
}

/// The largest RMSE: the noise of both programs, 4,096 rays each.
const MAX_RMSE: f64 = 2e-3;

#[test]
fn the_reference_matches_the_independent_program() {
    if shared("reference").is_none() {
        return;
    }
    let (mut worst, mut scenes) = (0.0_f64, 0);
    for path in files_with_ending(&folder().join("reference"), ".toml") {
        let scene = load(&path, LoadOptions::default()).unwrap();
        let list = scene.receivers.as_ref().unwrap();
        let column = list.columns.iter().position(|c| c == "truth").unwrap();
        let casters = scene.flattened(|i| i.casts).unwrap().unwrap();
        let occluder = RayScene::new(&casters);
        let lighting = Lighting::default();
        let options = ReferenceOptions {
            error: None,
            ..scene.truth
        };
        // Every third receiver; `render --mode truth` shades all of them.
        let chosen: Vec<usize> = (0..list.points.len()).step_by(3).collect();
        let receivers: Vec<_> = list.lifted().into_iter().step_by(3).collect();
        let shades = shade(Some(&occluder), &receivers, &lighting, &options, UNOBSERVED).unwrap();
        let squares = chosen.iter().zip(&shades).map(|(&i, shade)| {
            let theirs: f64 = list.rows[i][column].parse().unwrap();
            (f64::from(shade.occlusion.mean) - theirs).powi(2)
        });
        let rmse = (squares.sum::<f64>() / chosen.len() as f64).sqrt();
        println!("{}: RMSE {rmse:.5}", path.display());
        assert!(rmse <= MAX_RMSE, "{}: {rmse}", path.display());
        worst = worst.max(rmse);
        scenes += 1;
    }
    println!("worst: {worst:.5}");
    assert_eq!(scenes, 14);
}
