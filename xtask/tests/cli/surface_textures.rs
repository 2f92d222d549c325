//! Textures of surface bakes: in GLB files, of OBJ files, from finer models; shared meshes, GPUs.

use std::fs;
use std::path::Path;

use super::gpu::adapter;
use super::surface::{floor_and_wall, json, number};
use super::{fails, ok, run, with_sample};

/// The floor and the wall of [`floor_and_wall`], with a texture in which v is upward.
const OBJ: &str = "v 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
                   vt 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3 4/4\nf 1/1 4/1 5/1 6/1\n";

/// The same floor alone, as a coarse model of both.
const FLOOR: &str = "v 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\n\
                     vt 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 1 0\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";

fn bytes(path: &Path) -> Vec<u8> {
    image::open(path).unwrap().to_luma8().into_raw()
}

#[test]
fn a_glb_gets_the_texture_and_its_material() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("wall.glb"), floor_and_wall()).unwrap();
    let options = "--at texels --size 32 --samples 1 --rays 64 --force --bent-normals {}";
    let line = format!("bake-surface {{}} -o {{}} {options}");
    ok(&line, &[&at("wall.glb"), &at("out.glb"), &at("bent.png")]);
    ok(
        &line.replace(" --at texels", ""),
        &[&at("wall.glb"), &at("out.png"), &at("bent2.png")],
    );
    let (old, new) = (json(&at("wall.glb")), json(&at("out.glb")));
    let texture = &new["materials"][0]["occlusionTexture"];
    assert_eq!(
        (&texture["index"], &texture["texCoord"]),
        (&0.into(), &0.into())
    );
    assert_eq!(new["meshes"][0]["primitives"][0]["material"], 0);
    assert_eq!(new["asset"]["extras"]["aogrid"]["at"], "texels");
    for key in ["accessors", "nodes", "scenes"] {
        assert_eq!(new[key], old[key], "{key}");
    }
    // The picture in the file is the one that a PNG would be.
    let view = &new["bufferViews"][new["images"][0]["bufferView"].as_u64().unwrap() as usize];
    let [offset, length] =
        ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
    let file = fs::read(at("out.glb")).unwrap();
    let text = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    let picture = &file[28 + text + offset..][..length];
    assert_eq!(picture, fs::read(at("out.png")).unwrap());
    assert_eq!(
        fs::read(at("bent.png")).unwrap(),
        fs::read(at("bent2.png")).unwrap()
    );
    // The output is a model, whose texture a second bake replaces.
    ok(&line, &[&at("out.glb"), &at("again.glb"), &at("bent.png")]);
    assert_eq!(
        json(&at("again.glb"))["materials"].as_array().map(Vec::len),
        Some(1)
    );
}

#[test]
fn obj_files_have_texture_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("wall.glb"), floor_and_wall()).unwrap();
    fs::write(at("wall.obj"), OBJ).unwrap();
    let line = "bake-surface {} -o {} --size 16 --rays 64";
    ok(line, &[&at("wall.glb"), &at("glb.png")]);
    ok(line, &[&at("wall.obj"), &at("obj.png")]);
    assert_eq!(bytes(&at("obj.png")), bytes(&at("glb.png")));
    fs::write(
        at("none.obj"),
        "v 0 0 0\nv 0 0 1\nv 1 0 1\nvt 0 0\nf 1/1 2/1 3\n",
    )
    .unwrap();
    let error = fails(line, &[&at("none.obj"), &at("none.png")]);
    assert!(
        error.contains("line 5") && error.contains("bake vertices"),
        "{error}"
    );
    let set = fails(
        &format!("{line} --uv 1"),
        &[&at("wall.obj"), &at("set.png")],
    );
    assert!(set.contains("--uv"), "{set}");
}

/// The coarse floor lies a tenth below the fine one; the wall occludes in the fine model alone.
#[test]
fn points_of_a_coarse_model_are_traced_on_the_fine_one() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("fine.obj"), OBJ).unwrap();
    fs::write(
        at("coarse.obj"),
        FLOOR
            .replace("v 0 0 ", "v 0 -0.1 ")
            .replace("v 1 0 ", "v 1 -0.1 "),
    )
    .unwrap();
    let line = "bake-surface {} -o {} --size 16 --rays 64 --force --json";
    let direct = ok(line, &[&at("fine.obj"), &at("fine.png")]);
    let high = format!("{line} --cage 0.2 --high {{}}");
    let report = ok(
        &high,
        &[&at("coarse.obj"), &at("high.png"), &at("fine.obj")],
    );
    // The wall has no texel, so that both have the same points.
    assert_eq!(number(&report, "points"), number(&direct, "points"));
    assert_eq!(number(&report, "misses"), 0.0);
    let pairs = bytes(&at("high.png"))
        .into_iter()
        .zip(bytes(&at("fine.png")));
    let worst = pairs.map(|(a, b)| a.abs_diff(b)).max();
    assert!(worst <= Some(1), "{worst:?}");
    let alone = ok(line, &[&at("coarse.obj"), &at("alone.png")]);
    assert_eq!(number(&alone, "mean"), 1.0);
    // Vertices and bent normals take the same way.
    let vertices = "bake-surface {} -o {} --rays 64 --cage 0.2 --json --high {}";
    let report = ok(
        vertices,
        &[&at("coarse.obj"), &at("high.ply"), &at("fine.obj")],
    );
    assert!(number(&report, "mean") < 0.95);
    let near = high.replace("0.2", "0.01");
    let error = fails(&near, &[&at("coarse.obj"), &at("no.png"), &at("fine.obj")]);
    assert!(
        error.contains("fine.obj") && error.contains("--cage"),
        "{error}"
    );
    assert!(!at("no.png").exists());
}

/// Returns two of [`floor_and_wall`], one of a mesh's two nodes a little above the other.
fn two_nodes() -> Vec<u8> {
    let file = floor_and_wall();
    let json_length = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    let one = String::from_utf8_lossy(&file[20..20 + json_length]);
    let mut two = one.replace(r#""nodes":[0]"#, r#""nodes":[0,1]"#).replace(
        r#""nodes":[{"mesh":0}]"#,
        r#""nodes":[{"mesh":0},{"mesh":0,"translation":[0,0.1,0]}]"#,
    );
    while !two.len().is_multiple_of(4) {
        two.push(' ');
    }
    let bin = &file[20 + json_length..];
    let length = (20 + two.len() + bin.len()) as u32;
    let header = [
        &file[..8],
        &length.to_le_bytes(),
        &(two.len() as u32).to_le_bytes(),
        b"JSON",
    ];
    [&header.concat(), two.as_bytes(), bin].concat()
}

#[test]
fn meshes_of_several_nodes_are_split_or_shared() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("two.glb"), two_nodes()).unwrap();
    fs::write(at("one.glb"), floor_and_wall()).unwrap();
    for (options, meshes) in [("", 2), ("--instances split", 2), ("--instances share", 1)] {
        let line = format!("bake-surface {{}} -o {{}} --rays 64 --force {options}");
        ok(&line, &[&at("two.glb"), &at("out.glb")]);
        assert_eq!(
            json(&at("out.glb"))["meshes"].as_array().map(Vec::len),
            Some(meshes),
            "{options}"
        );
    }
    // Shared values are those of the mesh alone.
    ok(
        "bake-surface {} -o {} --rays 64",
        &[&at("one.glb"), &at("alone.glb")],
    );
    let values = |name: &str| {
        let new = json(&at(name));
        let idx = new["meshes"][0]["primitives"][0]["attributes"]["_ACCESSIBILITY"]
            .as_u64()
            .unwrap();
        let view = new["accessors"][idx as usize]["bufferView"]
            .as_u64()
            .unwrap();
        let offset = new["bufferViews"][view as usize]["byteOffset"]
            .as_u64()
            .unwrap() as usize;
        let file = fs::read(at(name)).unwrap();
        let text = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
        file[28 + text + offset..][..32].to_vec()
    };
    assert_eq!(values("out.glb"), values("alone.glb"));
    let error = fails(
        "bake-surface {} -o {} --instances share",
        &[&at("two.glb"), &at("a.ply")],
    );
    assert!(error.contains("--instances"), "{error}");
}

#[test]
fn surfaces_are_baked_on_a_gpu() {
    let Some(adapter) = adapter() else { return };
    let (folder, model) = with_sample("table");
    let [cpu, gpu] = ["cpu.ply", "gpu.ply"].map(|name| folder.path().join(name));
    ok("bake-surface {} -o {} --rays 64", &[&model, &cpu]);
    let line =
        format!("bake-surface {{}} -o {{}} --rays 64 --backend gpu --adapter {adapter} --json");
    let report: serde_json::Value = serde_json::from_str(&ok(&line, &[&model, &gpu])).unwrap();
    assert!(report["adapter"].as_str().unwrap().contains(&adapter));
    // The table's few edges are off all rays.
    assert_eq!(fs::read(cpu).unwrap(), fs::read(&gpu).unwrap());
    for options in [
        "--ignore-backfaces",
        "--kernel zbuffer",
        "--directions stratified",
    ] {
        let output = run(&format!("{line} --force {options}"), &[&model, &gpu]);
        assert!(!output.status.success(), "{options}");
    }
}
