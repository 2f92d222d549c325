use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;

use super::{fails, misused, ok, run, with_sample};

/// A glTF file with one triangle, which is masked and thus warned of, and whose buffer is a file beside it with a space in its name.
fn with_buffer() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let corners = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = corners.iter().flat_map(|v| v.to_le_bytes()).collect();
    fs::write(folder.path().join("the buffer.bin"), bytes).unwrap();
    let model = folder.path().join("m.gltf");
    let gltf = serde_json::json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "leaf"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{"alphaMode": "MASK"}],
        "buffers": [{"uri": "the%20buffer.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0, 0, 0], "max": [1, 1, 0]}],
    });
    fs::write(&model, gltf.to_string()).unwrap();
    (folder, model)
}

/// Returns the states of all outputs of a bake that reports as JSON.
fn states(line: &str, paths: &[&Path]) -> Vec<String> {
    let report: Value = serde_json::from_str(&ok(line, paths)).unwrap();
    let outputs = report["outputs"].as_array().unwrap().iter();
    outputs
        .map(|output| output["state"].as_str().unwrap().to_owned())
        .collect()
}

/// A rule names the model and the buffer, whether the output is written or up to date.
#[test]
fn a_depfile_names_every_file_that_was_read() {
    let (folder, model) = with_buffer();
    let at = |name: &str| folder.path().join(name);
    let line = "bake {} -o {} --resolution 8 --depfile {} --json";
    for state in ["baked", "up-to-date"] {
        let paths = [&*model, &at("m.ao.ktx2"), &at("m.d")];
        assert_eq!(states(line, &paths), [state]);
        let root = folder.path().display();
        assert_eq!(
            fs::read_to_string(at("m.d")).unwrap(),
            format!("{root}/m.ao.ktx2: {root}/m.gltf \\\n {root}/the\\ buffer.bin\n")
        );
    }
    ok(
        "bake {} -o {} --resolution 8 --parts --depfile {}",
        &[&model, &at("parts"), &at("parts.d")],
    );
    let rules = fs::read_to_string(at("parts.d")).unwrap();
    let (targets, _) = rules.split_once(": ").unwrap();
    let targets: Vec<_> = targets
        .split(' ')
        .map(|path| path.rsplit('/').next().unwrap())
        .collect();
    assert_eq!(targets, ["m.leaf.ao.ktx2", "m.toml"]);
    fs::write(at("Makefile"), "all: main.c\n").unwrap();
    let paths = [&*model, &at("m.ao.ktx2"), &at("Makefile")];
    let error = fails("bake {} -o {} --depfile {}", &paths);
    assert!(
        error.contains("Makefile") && error.contains("--force"),
        "{error}"
    );
}

/// The same model with the same options comes from the cache, with its warnings and byte for byte;
/// anything else is baked, and a broken entry is baked anew and replaced.
#[test]
fn a_cache_gives_the_grids_that_a_bake_gives() {
    let (folder, model) = with_buffer();
    let at = |name: &str| folder.path().join(name);
    let cache = at("cache");
    let line = "bake {} -o {} --resolution 8 --cache {} --json";
    let state = |out: &str, more: &str| {
        let line = format!("{line} {more}");
        states(&line, &[&model, &at(out), &cache]).remove(0)
    };
    assert_eq!(state("a.ao.ktx2", ""), "baked");
    let output = run(line, &[&model, &at("b.ao.ktx2"), &cache]);
    let (stdout, stderr) = (output.stdout, String::from_utf8(output.stderr).unwrap());
    assert!(String::from_utf8(stdout).unwrap().contains("\"cached\""));
    assert!(stderr.contains("warning: "), "{stderr}");
    let read = |name: &str| fs::read(at(name)).unwrap();
    assert!(read("a.ao.ktx2") == read("b.ao.ktx2"));
    assert_eq!(state("b.ao.ktx2", ""), "up-to-date");
    for (idx, option) in ["--epsilon 0.5", "--check", "--algorithm rays", "--force"]
        .into_iter()
        .enumerate()
    {
        let out = format!("c{idx}.ao.ktx2");
        assert_eq!(state(&out, option), "baked", "{option}");
    }
    let mut paths = vec![cache.clone()];
    let mut entries = 0;
    while let Some(path) = paths.pop() {
        if path.is_dir() {
            paths.extend(
                fs::read_dir(path)
                    .unwrap()
                    .map(|entry| entry.unwrap().path()),
            );
        } else {
            entries += 1;
            fs::write(path, "broken").unwrap();
        }
    }
    assert_eq!(entries, 4);
    assert_eq!(state("d.ao.ktx2", ""), "baked");
    assert_eq!(state("e.ao.ktx2", ""), "cached");
    assert!(read("e.ao.ktx2") == read("a.ao.ktx2"));
    fs::write(at("the buffer.bin"), [1; 36]).unwrap();
    let other = run(line, &[&model, &at("f.ao.ktx2"), &cache]);
    assert!(!String::from_utf8(other.stdout).unwrap().contains("cached"));
}

/// Grids are replaced, which `bake` makes; all else needs `--force`.
#[test]
fn files_that_exist_need_force() {
    let (folder, model) = with_sample("box");
    let at = |name: &str| folder.path().join(name);
    fs::write(at("mine.ktx2"), "precious").unwrap();
    let bake = "bake {} -o {} --resolution 8";
    let error = fails(bake, &[&model, &at("mine.ktx2")]);
    assert!(
        error.contains("mine.ktx2") && error.contains("--force"),
        "{error}"
    );
    assert_eq!(fs::read(at("mine.ktx2")).unwrap(), b"precious");
    ok(&format!("{bake} --force"), &[&model, &at("mine.ktx2")]);
    ok("bake {} -o {} --resolution 9", &[&model, &at("mine.ktx2")]);
    let grid = at("mine.ktx2");
    for (line, input, out) in [
        ("slices {} -o {}", &grid, "a.png"),
        ("export {} --to npy -o {}", &grid, "a.npy"),
    ] {
        ok(line, &[input, &at(out)]);
        let error = fails(line, &[input, &at(out)]);
        assert!(error.contains(out) && error.contains("--force"), "{error}");
        ok(&format!("{line} --force"), &[input, &at(out)]);
    }
    let error = fails("model box -o {}", &[&model]);
    assert!(
        error.contains("box.obj") && error.contains("--force"),
        "{error}"
    );
    for wrong in [
        "bake {} -o {} --dry-run --cache x",
        "bake {} -o {} --list --json",
        "bake {} -o {} --max-bytes 1",
        "bake {} -o {} --fit on --encoding cone",
    ] {
        misused(wrong, &[&model, &at("mine.ktx2")]);
    }
}

/// The scene of parts is written anew, unless it was edited.
#[test]
fn an_edited_scene_is_kept() {
    let (folder, model) = with_sample("table");
    let out = folder.path().join("parts");
    let line = "bake {} -o {} --resolution 8 --parts";
    ok(line, &[&model, &out]);
    let scene = out.join("table.toml");
    let written = fs::read_to_string(&scene).unwrap();
    ok(line, &[&model, &out]);
    fs::write(&scene, format!("{written}# posed\n")).unwrap();
    let output = run(line, &[&model, &out]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    assert!(
        stderr.contains("table.toml") && stderr.contains("--force"),
        "{stderr}"
    );
    assert!(fs::read_to_string(&scene).unwrap().ends_with("# posed\n"));
    ok(&format!("{line} --force"), &[&model, &out]);
    assert_eq!(fs::read_to_string(&scene).unwrap(), written);
}

/// Report 29, with an area: without the speck the grid is that of the rest, and the file says so.
#[test]
fn an_outlying_part_can_be_left_out() {
    let (folder, model) = with_sample("box");
    let at = |name: &str| folder.path().join(name);
    let sound = fs::read_to_string(&model).unwrap();
    let speck = "o speck\nv 900 0 0\nv 901 0 0\nv 900 1 0\nf -3 -2 -1\n";
    fs::write(at("stray.obj"), format!("{sound}{speck}")).unwrap();
    let stray = at("stray.obj");
    let line = "bake {} -o {} --resolution 8";
    let warned = run(line, &[&stray, &at("a.ao.ktx2")]);
    let warned = String::from_utf8(warned.stderr).unwrap();
    assert!(
        warned.contains("`speck`") && warned.contains("--without"),
        "{warned}"
    );
    let without = format!("{line} --without speck --json");
    for state in ["baked", "up-to-date"] {
        assert_eq!(states(&without, &[&stray, &at("b.ao.ktx2")]), [state]);
    }
    ok(line, &[&model, &at("c.ao.ktx2")]);
    let same = ok("diff {} {}", &[&at("b.ao.ktx2"), &at("c.ao.ktx2")]);
    assert!(same.contains("0 of 512 differ"), "{same}");
    let info = ok("info {}", &[&at("b.ao.ktx2")]);
    assert!(info.contains("without `speck`"), "{info}");
    let with = format!("{line} --json");
    assert_eq!(states(&with, &[&stray, &at("b.ao.ktx2")]), ["baked"]);
    let error = fails(
        &format!("{line} --without spec"),
        &[&stray, &at("d.ao.ktx2")],
    );
    assert!(
        error.contains("`spec`") && error.contains("`speck`"),
        "{error}"
    );
    misused("bake {} -o x --parts --without speck", &[&stray]);
}

/// Report 32: on voxel stairs whose faces go through cells' centers, sweep and rays agree to the byte by
/// the default sample offset, and help says that they need not at the centers.
#[test]
fn the_default_offset_keeps_samples_off_the_faces_of_voxels() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // A step of two voxels and one of one, as boxes that share a face's plane.
    let mut obj = String::new();
    for [x, y, w, h] in [[0, 0, 2, 1], [0, 1, 1, 1]] {
        for z in [0, 1] {
            for [a, b] in [[x, y], [x + w, y], [x + w, y + h], [x, y + h]] {
                obj += &format!("v {a} {b} {z}\n");
            }
        }
        obj += "f -5 -6 -7 -8\nf -4 -3 -2 -1\nf -8 -7 -3 -4\nf -7 -6 -2 -3\nf -6 -5 -1 -2\nf -5 -8 -4 -1\n";
    }
    fs::write(at("stairs.obj"), obj).unwrap();
    let line = "bake {} -o {} --half-extents 4,4,4 --resolution 16 --fit off --algorithm";
    for algorithm in ["sweep", "rays"] {
        let out = at(algorithm).with_extension("ktx2");
        ok(&format!("{line} {algorithm}"), &[&at("stairs.obj"), &out]);
    }
    let read = |name: &str| fs::read(at(name)).unwrap();
    assert!(read("sweep.ktx2") == read("rays.ktx2"));
    let help: String = ok("bake --help", &[])
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ");
    assert!(
        help.contains("except where samples lie exactly on faces"),
        "{help}"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn a_name_that_a_scene_cannot_hold_is_one_line() {
    use std::os::unix::ffi::OsStrExt;
    let (folder, sample) = with_sample("table");
    let model = folder
        .path()
        .join(std::ffi::OsStr::from_bytes(b"t\xFFble.obj"));
    fs::rename(sample, &model).unwrap();
    ok(
        "bake {} -o {} --resolution 8",
        &[&model, &folder.path().join("a.ao.ktx2")],
    );
    let out = folder.path().join("parts");
    let output = run("bake {} -o {} --resolution 8 --parts", &[&model, &out]);
    let error = String::from_utf8_lossy(&output.stderr);
    let error = error.lines().next().unwrap();
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(
        error.contains("t\u{FFFD}ble.obj") && error.contains("UTF-8"),
        "{error}"
    );
    assert_eq!(fs::read_dir(out).unwrap().count(), 0);
}
