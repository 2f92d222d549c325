//! Baking surfaces: outputs, options, errors.

use std::fs;
use std::path::Path;

use aogrid_tests::{files_with_ending, shared};
use serde_json::Value;

use super::odd_inputs::limited;
use super::{fails, ok, one_line_error, run, with_sample};

/// Returns the number after `key` in a JSON report.
pub(super) fn number(report: &str, key: &str) -> f64 {
    let report: Value = serde_json::from_str(report).unwrap();
    report[key].as_f64().unwrap_or_else(|| panic!("{key}"))
}

#[test]
fn a_ply_has_values_that_depend_on_neither_kernel_nor_threads() {
    let (folder, model) = with_sample("table");
    let at = |name: &str| folder.path().join(name);
    let bake = |options: &str, out: &str| {
        let line = format!("bake-surface {{}} -o {{}} --rays 64 --color --json --force {options}");
        let report = ok(&line, &[&model, &at(out)]);
        (report, fs::read(at(out)).unwrap())
    };
    let (report, expected) = bake("--threads 1", "a.ply");
    // The tops of four legs, two faces each, lie against the table's top.
    let buried = number(&report, "buried");
    assert!((buried - 8.0 / 60.0).abs() < 1e-12, "{buried}");
    let mean = number(&report, "mean");
    assert!((0.5..0.9).contains(&mean), "{mean}");
    for options in ["--threads 5", "--kernel rays", "--kernel zbuffer"] {
        assert_eq!(bake(options, "b.ply").1, expected, "{options}");
    }
    let (report, on_ground) = bake("--ground", "b.ply");
    assert_ne!(on_ground, expected);
    // The feet stand on the ground; everything sees less.
    assert!(number(&report, "buried") > buried && number(&report, "mean") < mean);
    let (report, shaded) = bake("--at faces --directions stratified --seed 3", "c.ply");
    assert!((number(&report, "mean") - mean).abs() < 0.01);
    assert_ne!(shaded.len(), expected.len());
    // A PLY that was written is a model, too.
    ok("info {}", &[&at("c.ply")]);
}

#[test]
fn other_models_occlude() {
    let (folder, model) = with_sample("box");
    let at = |name: &str| folder.path().join(name);
    let alone = ok("bake-surface {} -o {} --json", &[&model, &at("a.ply")]);
    assert_eq!(number(&alone, "mean"), 1.0);
    // The same box around itself hides half of the sky or all of it: its faces coincide.
    let line = "bake-surface {} -o {} --json --force --offset 0.01 --occluders {}";
    fs::write(
        at("room.obj"),
        "v -9 2 -9\nv 9 2 -9\nv 9 2 9\nv -9 2 9\nf 1 2 3 4\n",
    )
    .unwrap();
    let below = ok(line, &[&model, &at("a.ply"), &at("room.obj")]);
    let mean = number(&below, "mean");
    assert!((0.4..0.8).contains(&mean), "{mean}");
}

#[test]
fn a_glb_keeps_all_that_it_had() {
    let Some(models) = shared("data/meshes") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.glb");
    // Two nodes of the truck share a mesh; the fox is skinned.
    for (name, nodes) in [("CesiumMilkTruck.glb", 1), ("Fox_skinned.glb", 0)] {
        let model = models.join(name);
        ok("bake-surface {} -o {} --rays 16 --force", &[&model, &out]);
        let [old, new] = [&model, &out].map(|path| json(path));
        let count = |file: &Value, key: &str| file[key].as_array().map_or(0, Vec::len);
        assert_eq!(count(&new, "meshes"), count(&old, "meshes") + nodes);
        for key in [
            "materials",
            "textures",
            "images",
            "animations",
            "skins",
            "scenes",
        ] {
            assert_eq!(new[key], old[key], "{name}: {key}");
        }
        let attributes = &new["meshes"][0]["primitives"][0]["attributes"];
        assert!(attributes["_ACCESSIBILITY"].is_u64() && attributes["_BENT_NORMAL"].is_u64());
        assert!(attributes["COLOR_0"].is_null());
        assert_eq!(new["asset"]["extras"]["aogrid"]["weights"], "cosine");
        // The output is a model that can be baked, too.
        let again = folder.path().join("again.glb");
        ok(
            "bake-surface {} -o {} --rays 16 --color --force",
            &[&out, &again],
        );
        let colored = json(&again);
        assert!(colored["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"].is_u64());
    }
}

#[test]
fn textures_have_values_and_bent_normals() {
    let Some(model) = shared("data/meshes/Duck_4212.glb") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let line = "bake-surface {} -o {} --size 64 --samples 1 --rays 32 --json --force";
    let report = ok(line, &[&model, &at("a.exr")]);
    assert!((0.5..0.95).contains(&number(&report, "mean")));
    for (options, name) in [
        ("", "gl"),
        ("--convention dx", "dx"),
        ("--space object", "object"),
    ] {
        let line = format!("{line} {options} --bent-normals {{}}");
        let bent = at(&format!("{name}.png"));
        ok(&line, &[&model, &at("a.png"), &bent]);
    }
    let read = |name: &str| image::open(at(name)).unwrap().to_rgb8();
    let [gl, dx, object] = ["gl.png", "dx.png", "object.png"].map(read);
    assert_eq!(gl.dimensions(), (64, 64));
    let mut sums = [0.0; 3];
    for ((gl, dx), object) in gl.pixels().zip(dx.pixels()).zip(object.pixels()) {
        // Halves round up, so that opposite bytes add up to 255 or 256.
        let green = u16::from(gl[1]) + u16::from(dx[1]);
        assert!((255..=256).contains(&green), "{gl:?} {dx:?}");
        assert_eq!((gl[0], gl[2]), (dx[0], dx[2]));
        for (sum, v) in sums.iter_mut().zip(object.0) {
            *sum += (f64::from(v) - 127.5) / 127.5 / 4096.0;
        }
        // Bent normals are in the hemisphere of the normal.
        assert!(gl[2] > 120, "{gl:?}");
    }
    // A closed body's normals point everywhere.
    assert!(sums.iter().all(|sum| sum.abs() < 0.6), "{sums:?}");
    let light = read("a.png");
    let dark = light.pixels().filter(|p| p[0] < 128).count();
    assert!((10..2000).contains(&dark), "{dark}");
}

/// A floor whose texture shows it from above, with a wall along the picture's upper edge.
pub(super) fn floor_and_wall() -> Vec<u8> {
    let positions: [[f32; 3]; 8] = [
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let mut bin: Vec<u8> = positions
        .as_flattened()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    for [x, _, z] in &positions[..4] {
        bin.extend([*x, *z].iter().flat_map(|v| v.to_le_bytes()));
    }
    // The wall has no area in the texture.
    bin.extend([0; 32]);
    bin.extend([0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7]);
    let mut json = String::from(
        r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":2}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
        {"bufferView":1,"componentType":5126,"count":8,"type":"VEC2"},
        {"bufferView":2,"componentType":5121,"count":12,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":64},
        {"buffer":0,"byteOffset":160,"byteLength":12}],"buffers":[{"byteLength":172}]}"#,
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let word = |n: usize| (n as u32).to_le_bytes();
    let header = [*b"glTF", word(2), word(28 + json.len() + bin.len())];
    let [json_header, bin_header] = [(json.len(), *b"JSON"), (bin.len(), *b"BIN\0")]
        .map(|(length, kind)| [word(length), kind].concat());
    [
        &header.concat()[..],
        &json_header,
        json.as_bytes(),
        &bin_header,
        &bin,
    ]
    .concat()
}

#[test]
fn bent_normals_lean_away_from_a_wall() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("wall.glb"), floor_and_wall()).unwrap();
    for (options, is_green_below) in [("", true), ("--convention dx", false)] {
        let line = format!(
            "bake-surface {{}} -o {{}} --size 16 --dilate 0 --force --bent-normals {{}} {options}"
        );
        ok(&line, &[&at("wall.glb"), &at("ao.png"), &at("bent.png")]);
        let open = image::open(at("ao.png")).unwrap().to_luma8();
        let bent = image::open(at("bent.png")).unwrap().to_rgb8();
        // Darker and more bent towards the wall, which is above in the picture.
        assert!(open.get_pixel(8, 0)[0] + 40 < open.get_pixel(8, 15)[0]);
        let green = bent.get_pixel(8, 1)[1];
        assert_eq!(green < 115, is_green_below, "{green} {options}");
        assert!((115..140).contains(&bent.get_pixel(8, 1)[0]));
        // A square of 16 texels that fills the texture needs no more; the wall has no texel.
        assert!(open.pixels().all(|p| p[0] > 100));
    }
}

/// Returns the JSON of a GLB file.
pub(super) fn json(path: &Path) -> Value {
    let bytes = fs::read(path).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

#[test]
fn errors_are_one_line_that_says_what_to_do() {
    let (folder, model) = with_sample("box");
    let at = |name: &str| folder.path().join(name);
    let glb = fails("bake-surface {} -o {}", &[&model, &at("a.glb")]);
    assert!(glb.contains("box.obj") && glb.contains("PLY"), "{glb}");
    for (options, out, expected) in [
        ("", "a.obj", ".png or .exr"),
        ("--at faces", "a.glb", "--at faces"),
        ("--at faces --vertices own", "a.ply", "--vertices"),
        ("", "a.png", "texture coordinates"),
        ("--at texels", "a.ply", "--at"),
        ("--size 64", "a.ply", "--size"),
        ("--size 8192 --samples 16", "a.exr", "--size"),
        ("--bent-normals b.png", "a.exr", "--bent-normals"),
        ("--space object --convention dx", "a.png", "--convention"),
        ("--seed 1", "a.ply", "--seed"),
        (
            "--kernel zbuffer --directions rejection",
            "a.ply",
            "--kernel",
        ),
        ("", "box.obj", ".png or .exr"),
    ] {
        let line = format!("bake-surface {{}} -o {{}} {options}");
        let error = fails(&line, &[&model, &at(out)]);
        assert!(error.contains(expected), "{error}");
        assert!(!at("a.ply").exists());
    }
    ok("bake-surface {} -o {} --rays 1", &[&model, &at("a.ply")]);
    let exists = fails("bake-surface {} -o {}", &[&model, &at("a.ply")]);
    assert!(exists.contains("--force"), "{exists}");
    let same = fails("bake-surface {} -o {}", &[&at("a.ply"), &at("a.ply")]);
    assert!(same.contains("it is the input"), "{same}");
    let usage = run("bake-surface {} -o {} --rays 0", &[&model, &at("b.ply")]);
    assert_eq!(usage.status.code(), Some(2));
}

#[test]
fn odd_files_give_a_result_or_one_line() {
    let Some(folder) = shared("data/odd") else {
        return;
    };
    let out = tempfile::tempdir().unwrap();
    let (mut read, mut refused) = (0, 0);
    for (files, ending, out) in [
        ("obj", ".obj", out.path().join("odd.ply")),
        ("gltf", ".glb", out.path().join("odd.glb")),
    ] {
        for path in files_with_ending(&folder.join(files), ending) {
            let args = ["bake-surface", "-o", "--rays", "8", "--quiet", "--force"].map(Path::new);
            let [command, o, rays, eight, quiet, force] = args;
            let output = limited(&[command, &path, o, &out, rays, eight, quiet, force]);
            match output.status.success() {
                true => read += 1,
                false => {
                    one_line_error(&output, &path.display().to_string());
                    refused += 1;
                }
            }
        }
    }
    assert!(read > 40 && refused > 20, "{read} read, {refused} refused");
}
