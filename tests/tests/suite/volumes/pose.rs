//! Animations of scene files: a plate that its joint lifts, whose occlusion has a closed form.

use std::fs;
use std::path::Path;

use aogrid_bake_core::UNOBSERVED;
use aogrid_scene::shade::Target;
use aogrid_scene::{Grids, LoadOptions, Scene, parse};
use tempfile::TempDir;

use super::shaded_at;

/// AO under the middle of a 2 × 2 square at height 1.
const UNDER_PLATE: f32 = 0.554_126_4;

/// The noise of 65,536 stratified rays, and the rounding of single floats.
const TOLERANCES: [f32; 3] = [1e-6, 1e-6, 1e-3];

/// Writes a glTF file of a plate that faces down: in bind pose at height 0, and lifted by its joint at a
/// unit of height a second; and of a copy of it without a skin on an animated node.
fn write_plate(folder: &Path) {
    let [a, b, c, d] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let positions = [a, b, c, a, c, d].map(|[x, z]: [f32; 2]| [x, 0.0, z]);
    let weights = [[1.0_f32, 0.0, 0.0, 0.0]; 6];
    let lift = [[0.0_f32, 0.0, 0.0], [0.0, 2.0, 0.0]];
    let floats = [
        positions.as_flattened(),
        weights.as_flattened(),
        &[0.0, 2.0],
        lift.as_flattened(),
    ];
    let mut bytes: Vec<u8> = floats
        .concat()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    bytes.extend([0; 24]);
    fs::write(folder.join("plate.bin"), bytes).unwrap();
    let json = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [{"name": "plate", "mesh": 0, "skin": 0}, {"name": "joint"},
            {"name": "rigid", "mesh": 1}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "WEIGHTS_0": 1, "JOINTS_0": 4}}]},
            {"primitives": [{"attributes": {"POSITION": 0}}]}],
        "skins": [{"joints": [1]}],
        "animations": [{"name": "lift", "samplers": [{"input": 2, "output": 3}], "channels": [
            {"sampler": 0, "target": {"node": 1, "path": "translation"}},
            {"sampler": 0, "target": {"node": 2, "path": "translation"}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3",
             "min": [-1, 0, -1], "max": [1, 0, 1]},
            {"bufferView": 1, "componentType": 5126, "count": 6, "type": "VEC4"},
            {"bufferView": 2, "componentType": 5126, "count": 2, "type": "SCALAR"},
            {"bufferView": 3, "componentType": 5126, "count": 2, "type": "VEC3"},
            {"bufferView": 4, "componentType": 5121, "count": 6, "type": "VEC4"}],
        "bufferViews": [{"buffer": 0, "byteLength": 72},
            {"buffer": 0, "byteOffset": 72, "byteLength": 96},
            {"buffer": 0, "byteOffset": 168, "byteLength": 8},
            {"buffer": 0, "byteOffset": 176, "byteLength": 24},
            {"buffer": 0, "byteOffset": 200, "byteLength": 24}],
        "buffers": [{"uri": "plate.bin", "byteLength": 224}]}"#;
    fs::write(folder.join("plate.gltf"), json).unwrap();
}

/// Returns a scene in a folder with the plate, whose meshes have these keys.
fn loaded(keys: &str) -> (TempDir, aogrid_scene::Result<Scene>) {
    let folder = tempfile::tempdir().unwrap();
    write_plate(folder.path());
    fs::write(
        folder.path().join("a.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    )
    .unwrap();
    let text = format!(
        "truth = {{ samples = 65536 }}\nvolumes = {{ extent = 100, weight = 'none' }}\n\
         [receivers]\ncorner = [-1e-4, 0, 1e-4]\nu = [2e-4, 0, 0]\nv = [0, 0, -2e-4]\ncount = [1, 1]\n\
         lift = 0\n[[mesh]]\nname = 'plate'\n{keys}\n[[instance]]\nmesh = 'plate'\n"
    );
    let path = folder.path().join("scene.toml");
    let scene = parse(&path, &text, LoadOptions::default());
    (folder, scene)
}

#[test]
fn volumes_and_rays_meet_the_plate_where_its_joint_has_lifted_it() {
    let (_folder, scene) = loaded(
        "file = 'plate.gltf'\npart = 'plate'\npose = { animation = 'lift', time = 1 }\n\
         grid = { resolution = 8 }",
    );
    let scene = scene.unwrap();
    assert_eq!(scene.warnings, Vec::<String>::new());
    let target = Target::of_list(scene.receivers.as_ref().unwrap());
    let modes = ["volumes", "volumes+cone", "truth"];
    let shaded = shaded_at(&scene, &target, modes);
    for ((shaded, mode), tolerance) in shaded.iter().zip(modes).zip(TOLERANCES) {
        println!("{mode}: {}", shaded[0]);
        assert!(
            (shaded[0] - UNDER_PLATE).abs() <= tolerance,
            "{mode}: {}",
            shaded[0]
        );
    }
    // The grid is around the plate in bind pose, and says so.
    let mut grids = Grids::new();
    let grid = grids.resolve(&scene, UNOBSERVED).unwrap()[0]
        .clone()
        .unwrap();
    assert_eq!(grid.spec().center()[1], 0.0);
    let warnings = grids.take_warnings();
    assert!(
        warnings.iter().any(|w| w.contains("bind pose")),
        "{warnings:?}"
    );
}

#[test]
fn rigid_parts_move_with_their_grids() {
    let pose = "file = 'plate.gltf'\nparts = true\npose = { animation = 'lift', time = 1.5 }";
    let (_folder, scene) = loaded(pose);
    let scene = scene.unwrap();
    let [skinned, rigid] = [0, 1].map(|idx| &scene.meshes[idx]);
    assert!(skinned.bind.is_some() && rigid.bind.is_none());
    assert_eq!(rigid.mesh.positions()[0][1], 0.0);
    let heights = scene
        .instances
        .iter()
        .map(|i| i.world_from_object.translation.y);
    assert_eq!(heights.collect::<Vec<_>>(), [0.0, 1.5]);
}

#[test]
fn poses_that_cannot_be_are_named_with_their_line() {
    let cases = [
        (
            "file = 'plate.gltf'\npose = { animation = 'run' }",
            "it has no animation `run`; there are: lift",
        ),
        (
            "file = 'plate.gltf'\npose = { time = 2 }",
            "a `time` needs an `animation`",
        ),
        ("file = 'a.obj'\npose = {}", "only glTF files have skins"),
        ("sample = 'box'\npose = {}", "only a `file` has animations"),
        (
            "file = 'plate.gltf'\npose = { animation = 'lift', time = nan }",
            "scene.toml:12",
        ),
        (
            "file = 'plate.gltf'\npose = { frame = 2 }",
            "unknown field `frame`",
        ),
    ];
    for (keys, message) in cases {
        let (_folder, refused) = loaded(keys);
        let refused = refused.err().unwrap().to_string();
        println!("{refused}");
        assert!(refused.contains(message), "{refused}");
        assert!(
            refused.contains("scene.toml:") && !refused.contains("\n\n"),
            "{refused}"
        );
    }
}
