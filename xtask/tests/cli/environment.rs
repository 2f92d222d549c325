use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::{fails, ok};

/// Writes a scene with a box on a floor of a material and receivers on the floor in front of the
/// box; with a camera if one is given.
fn with_scene(floor: &str, camera: &str, light: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let text = format!(
        "{light}
{camera}
[receivers]
corner = [-1.0, 0.0001, 1.6]
u = [2, 0, 0]
v = [0, 0, -1]
count = [9, 9]
object = 'floor'
[[material]]
name = 'ground'
albedo = [1, 1, 1]
{floor}
[[mesh]]
name = 'floor'
rectangle = [5, 5]
[[mesh]]
name = 'box'
sample = 'box'
grid = {{ boundary = 'none', resolution = 16 }}
[[instance]]
mesh = 'floor'
material = 'ground'
[[instance]]
mesh = 'box'
"
    );
    fs::write(&path, text).unwrap();
    (folder, path)
}

const CAMERA: &str = "[camera]\nposition = [2, 2, 3]\ntarget = [0, 0.3, 0]\nresolution = [24, 16]";

const SKY: &str = "[environment]\ncolor = [0.5, 1, 2]";

/// Returns a column of the table that a command wrote.
fn column(csv: &Path, name: &str) -> Vec<f32> {
    let text = fs::read_to_string(csv).unwrap();
    let mut lines = text.lines();
    let index = lines.next().unwrap().split(',').position(|n| n == name);
    let index = index.unwrap_or_else(|| panic!("no column {name}"));
    let value = |line: &str| line.split(',').nth(index).unwrap().parse().unwrap();
    lines.map(value).collect()
}

#[test]
fn under_a_constant_sky_light_is_one_minus_occlusion() {
    let (folder, scene) = with_scene("", "", SKY);
    let csv = folder.path().join("out.csv");
    ok("render {} --mode environment,cone -o {}", &[&scene, &csv]);
    let [ao, green, cone, darkened] =
        ["environment", "environment.G", "cone", "cone.G"].map(|name| column(&csv, name));
    assert!(ao.iter().any(|&v| v > 0.2) && ao.len() == 81);
    for idx in 0..ao.len() {
        // Half floats and T_clip as two textures.
        assert!((ao[idx] - cone[idx]).abs() < 1e-3);
        assert!((green[idx] - (1.0 - ao[idx])).abs() < 2e-3);
        assert!((darkened[idx] - (1.0 - cone[idx])).abs() < 2e-3);
    }
}

#[test]
fn merged_and_multiplied_cones_darken_a_constant_sky_by_their_occlusion() {
    let modes = ["environment", "environment-merge"];
    let shade = |second_box: &str| {
        let (folder, scene) = with_scene("", "", SKY);
        fs::write(&scene, fs::read_to_string(&scene).unwrap() + second_box).unwrap();
        let csv = folder.path().join("out.csv");
        let line = "render {} --mode environment,environment-merge,merge -o {}";
        ok(line, &[&scene, &csv]);
        let merged = column(&csv, "environment-merge");
        assert_eq!(merged, column(&csv, "merge"));
        // A constant sky is darkened by exactly the occlusion, whatever the mode.
        for mode in modes {
            let ao = column(&csv, mode);
            let green = column(&csv, &format!("{mode}.G"));
            let pairs = ao.iter().zip(&green);
            assert!(pairs.clone().all(|(ao, g)| (g - (1.0 - ao)).abs() < 2e-3));
        }
        modes.map(|mode| column(&csv, mode))
    };
    let [multiplied, merged] = shade("");
    assert_eq!(multiplied, merged, "a single occluder needs no merging");
    let [multiplied, merged] = shade("[[instance]]\nmesh = 'box'\ntranslate = [0.3, 0, 0]");
    let mut pairs = multiplied.iter().zip(&merged);
    assert!(pairs.clone().all(|(m, u)| *u <= m + 1e-5));
    assert!(pairs.any(|(m, u)| *u < m - 0.05));
}

#[test]
fn a_glossy_floor_mirrors_the_box_as_a_dark_area() {
    let (folder, scene) = with_scene("gloss = 15", CAMERA, SKY);
    let csv = folder.path().join("out.csv");
    let line = "render {} --mode truth,environment --samples 512 -o {}";
    ok(line, &[&scene, &csv]);
    let [truth, ours] = ["truth.G", "environment.G"].map(|name| column(&csv, name));
    let squares = truth.iter().zip(&ours).map(|(a, b)| (a - b).powi(2));
    let rmse = (squares.sum::<f32>() / truth.len() as f32).sqrt();
    println!("RMSE {rmse}");
    // A box is not a cone, but in both modes the floor is dark in front of it and bright beside it.
    assert!(rmse < 0.2, "{rmse}");
    let both = |found: fn(f32) -> bool| {
        let pairs = truth.iter().zip(&ours);
        pairs.filter(|(a, b)| found(**a) && found(**b)).count()
    };
    assert!(both(|v| v < 0.1) > 5 && both(|v| v > 0.99) > 5);
}

#[test]
fn scenes_that_environment_modes_cannot_light_are_errors() {
    let lamp = "[area_light]\ncenter = [0, 3, 0]\nhalf_u = [1, 0, 0]\nhalf_v = [0, 0, 1]\n\
                radiance = [1, 1, 1]\n[environment]\ncolor = [1, 1, 1]";
    for (floor, camera, light, expected) in [
        ("", "", "", "add [environment]"),
        ("", "", lamp, "[area_light]: leave that out"),
        ("gloss = 20", "", SKY, "add a [camera]"),
        (
            "gloss = 91",
            CAMERA,
            SKY,
            "material.gloss: 91 degrees are more than 90",
        ),
        ("gloss = 0", CAMERA, SKY, "gloss: 0 is not above zero"),
    ] {
        let (folder, scene) = with_scene(floor, camera, light);
        let csv = folder.path().join("out.csv");
        let error = fails("render {} --mode environment -o {}", &[&scene, &csv]);
        assert!(error.contains(expected), "{error}");
        assert!(error.contains("scene.toml"), "{error}");
        assert!(!csv.exists());
    }
}
