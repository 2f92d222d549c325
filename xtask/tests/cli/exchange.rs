use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use tempfile::TempDir;

use super::parts::{gltf, with_file};
use super::{fails, ok, run, with_sample};

fn sorted(folder: &Path) -> Vec<std::ffi::OsString> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    names
}

/// Bakes the parts of a model of three nodes, two of which share a mesh; returns its folder, its path and
/// the grids.
fn robot() -> (TempDir, PathBuf, [PathBuf; 2]) {
    let nodes = json!([
        {"name": "Base", "mesh": 0}, {"name": "Arm", "mesh": 0, "translation": [3, 0, 0]},
        {"name": "Wide", "mesh": 0, "scale": [2, 1, 1]}
    ]);
    let (folder, model) = with_file("robot.glb", &gltf(&nodes));
    let parts = folder.path().join("parts");
    let line = "bake {} -o {} --parts --resolution 8 --face-size 8";
    ok(line, &[&model, &parts]);
    let grids = ["Base", "Wide"].map(|name| parts.join(format!("robot.{name}.ao.ktx2")));
    (folder, model, grids)
}

#[test]
fn grids_that_are_attached_are_detached_as_they_were() {
    let (folder, model, grids) = robot();
    let at = |name: &str| folder.path().join(name);
    let out = at("robot-ao.glb");
    let line = "attach {} {} {} -o {}";
    ok(line, &[&model, &grids[0], &grids[1], &out]);
    let again = at("again");
    let lines = ok("detach {} -o {}", &[&out, &again]);
    assert_eq!(lines.lines().count(), 3, "{lines}");
    assert!(
        lines.contains("Arm: ") && lines.contains("Wide.ao.ktx2"),
        "{lines}"
    );
    assert_eq!(sorted(&again), ["robot.Base.ao.ktx2", "robot.Wide.ao.ktx2"]);
    for grid in &grids {
        let same = again.join(grid.file_name().unwrap());
        assert_eq!(fs::read(grid).unwrap(), fs::read(same).unwrap());
    }
    // The model is as it was.
    assert_eq!(
        ok("info {} --json", &[&out]),
        ok("info {} --json", &[&model])
    );
    assert!(fails("detach {} -o {}", &[&out, &again]).contains("--force"));
    ok("detach {} -o {} --force", &[&out, &again]);
}

/// A name that the user gives; a grid of the whole; a model that has changed.
#[test]
fn grids_find_their_nodes() {
    let (folder, model, grids) = robot();
    let at = |name: &str| folder.path().join(name);
    let (out, again) = (at("robot-ao.glb"), at("again"));
    let arm = format!("Arm={}", grids[1].display());
    ok(
        "attach {} {} -o {} --force",
        &[&model, Path::new(&arm), &out],
    );
    assert!(ok("detach {} -o {} --force", &[&out, &again]).starts_with("Arm: "));
    let whole = at("whole.ao.ktx2");
    ok(
        "bake {} -o {} --resolution 8 --face-size 8",
        &[&model, &whole],
    );
    ok("attach {} {} -o {} --force", &[&model, &whole, &out]);
    assert!(ok("detach {} -o {} --force", &[&out, &again]).starts_with("aogrid: "));
    fs::write(
        &model,
        gltf(&json!([{"name": "Base", "mesh": 0, "translation": [1, 0, 0]}])),
    )
    .unwrap();
    let output = run("attach {} {} -o {} --force", &[&model, &grids[0], &out]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && stderr.contains("warning: "),
        "{stderr}"
    );
    assert!(stderr.contains("robot.glb"), "{stderr}");
    let error = fails("attach {} {} -o {} --force", &[&model, &grids[1], &out]);
    assert!(
        error.contains("`Wide`") && error.contains("`Base`"),
        "{error}"
    );
}

#[test]
fn what_cannot_be_attached_is_named() {
    let (folder, model) = with_sample("box");
    let at = |name: &str| folder.path().join(name);
    let grid = at("box.ao.ktx2");
    ok(
        "bake {} -o {} --resolution 8 --face-size 8",
        &[&model, &grid],
    );
    let error = fails("attach {} {} -o {}", &[&model, &grid, &at("a.glb")]);
    assert!(
        error.contains("box.obj") && error.contains("not a GLB"),
        "{error}"
    );
    let glb = at("b.glb");
    fs::write(&glb, gltf(&json!([{"name": "B", "mesh": 0}]))).unwrap();
    let named = format!("C={}", grid.display());
    let cases = [
        (&glb, grid.as_path(), at("a.ktx2"), ".glb"),
        (&glb, &grid, glb.clone(), "it is the input"),
        (&glb, &glb, at("a.glb"), "b.glb"),
        (&glb, Path::new(&named), at("a.glb"), "`C`"),
    ];
    for (model, grid, out, said) in cases {
        let error = fails("attach {} {} -o {}", &[model, grid, &out]);
        assert!(error.contains(said), "{error}");
    }
    let error = fails("attach {} {} {} -o {}", &[&glb, &grid, &grid, &at("a.glb")]);
    assert!(error.contains("two grids"), "{error}");
    let error = fails("detach {} -o {}", &[&glb, &at("grids")]);
    assert!(
        error.contains("no grids") && !at("grids").exists(),
        "{error}"
    );
}

#[test]
fn exports_come_with_what_a_reader_needs() {
    let (folder, model) = with_sample("box");
    let at = |name: &str| folder.path().join(name);
    let grid = at("box.ao.ktx2");
    ok(
        "bake {} -o {} --resolution 8x9x10 --face-size 8",
        &[&model, &grid],
    );
    for (to, ending) in [("dds", "dds"), ("exr", "exr"), ("flipbook", "png")] {
        let line = format!("export {{}} --to {to} -o {{}}");
        let (out, beside) = (at(&format!("{to}.{ending}")), at(&format!("{to}.json")));
        ok(&line, &[&grid, &out]);
        let json: Value = serde_json::from_slice(&fs::read(&beside).unwrap()).unwrap();
        assert_eq!(json["grid"]["resolution"], json!([8, 9, 10]));
        assert_eq!(json["channels"][3]["name"], "sqrt_a");
        assert_eq!(json["flipbook"].is_null(), to == "dds");
        // Neither file is replaced without leave.
        fs::remove_file(&out).unwrap();
        assert!(fails(&line, &[&grid, &out]).contains(&format!("{to}.json")));
        assert!(!out.exists());
        ok(&(line.clone() + " --force"), &[&grid, &out]);
        let error = fails(&line, &[&grid, &at("a.ktx2")]);
        assert!(error.contains(&format!(".{ending}")), "{error}");
    }
}
