use std::fs;
use std::path::Path;

use serde_json::Value;

use super::{fails, misused, ok, run};

/// Writes a box on a floor that a camera sees.
fn scene(folder: &Path) -> std::path::PathBuf {
    let path = folder.join("scene.toml");
    let text = "[camera]\nposition = [2, 2, 3]\ntarget = [0, 0.3, 0]\nresolution = [48, 32]\n\
                [[mesh]]\nname = 'floor'\nrectangle = [9, 9]\n\
                [[mesh]]\nname = 'box'\nsample = 'box'\ngrid = { boundary = 'none' }\n\
                [[instance]]\nmesh = 'floor'\n[[instance]]\nmesh = 'box'\n";
    fs::write(&path, text).unwrap();
    path
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn a_scene_is_compared_by_mode_and_area() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path());
    let [png, csv] = ["a.png", "a.csv"].map(|name| folder.path().join(name));
    let line = "compare {} --mode cone,occlusion --error 0.01 -o {} -o {} --json";
    let report = json(&ok(line, &[&scene, &png, &csv]));
    let modes = report["modes"].as_array().unwrap();
    assert_eq!(modes.len(), 2);
    let areas: Vec<_> = report["areas"].as_array().unwrap().iter().collect();
    let cone = |area: &str, number: &str| {
        let idx = areas.iter().position(|name| **name == area).unwrap();
        modes[0]["areas"][idx][number].as_f64()
    };
    // A convex box does not occlude itself; the floor touches it, and ends beyond its grid.
    assert!(cone("itself", "truth").unwrap() < 1e-3);
    assert!(cone("near", "truth").unwrap() > 0.2);
    assert!(cone("rest", "rmse").unwrap() < 0.03);
    assert!(cone("beyond", "bias").unwrap() < 0.0);
    assert_eq!(cone("tilted", "truth"), None);
    assert_eq!(cone("any way", "truth"), None);
    // Three panels side by side, gaps of 8; two rows of them with lines of text and a scale.
    let size = image::open(&png).unwrap().to_rgb8().dimensions();
    assert_eq!(size.0, 3 * 48 + 2 * 8);
    assert!(size.1 > 2 * 32);
    let table = fs::read_to_string(&csv).unwrap();
    let header = "px,py,pz,nx,ny,nz,area,truth,truth.stderr,cone,occlusion";
    assert_eq!(table.lines().next(), Some(header));
    assert_eq!(report["receivers"], table.lines().count() - 1);
}

#[test]
fn the_suite_is_judged_and_its_truth_taken_up_again() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("accuracy");
    let line = "compare --suite --only box --rows paper --receivers 10 --samples 32 --json -o {}";
    let first = ok(line, &[&out]);
    let report = json(&first);
    assert_eq!(report["subjects"][0]["name"], "box");
    assert!(report["summary"].as_array().unwrap().len() > 5);
    // The truth in the folder is used, even if it is wrong.
    let file = out.join("box.csv");
    let kept = fs::read_to_string(&file).unwrap();
    let mut lines: Vec<_> = kept.lines().map(str::to_owned).collect();
    let last = lines.last_mut().unwrap();
    let cut = last.rmatch_indices(',').nth(1).unwrap().0;
    last.replace_range(cut.., ",0.9,0");
    fs::write(&file, lines.join("\n")).unwrap();
    let line = format!("{line} --resume");
    assert_ne!(ok(&line, &[&out]), first);
    // Other options need other truth.
    let other = line.replace("--samples 32", "--samples 50");
    ok(&other, &[&out]);
    assert!(!fs::read_to_string(&file).unwrap().contains(",0.9,0\n"));
}

#[test]
fn wrong_comparisons_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene(folder.path());
    let row = misused("compare --suite --rows nothing", &[]);
    assert!(row.contains("`paper`"), "{row}");
    let subject = fails("compare --suite --only nothing.obj", &[]);
    assert!(subject.contains("nothing.obj"), "{subject}");
    let ending = misused("compare {} -o a.exr", &[&scene]);
    assert!(ending.contains("a.exr"), "{ending}");
    for usage in ["compare", "compare --resume", "compare --suite a.toml"] {
        assert_eq!(run(usage, &[]).status.code(), Some(2), "{usage}");
    }
}
