//! Tests that Khronos' validator, three.js and glTF-Transform read GLB files with grids. They need Node.js,
//! as `interchange.rs` does.

use std::fs;
use std::path::Path;
use std::process::Command;

use aogrid_bake_core::glb::{EXTENSION, Nodes, Occluder, attach, attached};
use aogrid_bake_core::mesh::{LoadedMesh, Pose};
use aogrid_bake_core::models::Model;
use aogrid_bake_core::{BakeOptions, Placement};
use aogrid_grid_format::{Grid, Sampling};
use aogrid_tests::grid;
use serde_json::{Value, json};

use crate::node::node;

/// Returns a GLB with the box model as the mesh of two nodes, the second turned, and of a stretched one.
fn glb() -> Vec<u8> {
    let mesh = Model::Box.mesh(None).unwrap();
    let positions = mesh.positions().as_flattened();
    let indices: Vec<u32> = mesh.triangles().as_flattened().to_vec();
    let mut bin: Vec<u8> = positions.iter().flat_map(|v| v.to_le_bytes()).collect();
    let at = bin.len();
    bin.extend(indices.iter().flat_map(|v| v.to_le_bytes()));
    let bounds = mesh.bounds();
    let json = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 2]}],
        "nodes": [
            {"name": "Base", "mesh": 0, "children": [1]},
            {"name": "Arm", "mesh": 0, "translation": [0, 5, 0], "rotation": [0, 0, 0.6, 0.8]},
            {"name": "Wide", "mesh": 0, "scale": [2, 1, 1], "extras": {"by": "me"}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": mesh.positions().len(), "type": "VEC3",
             "min": bounds.min, "max": bounds.max},
            {"bufferView": 1, "componentType": 5125, "count": indices.len(), "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": at, "target": 34962},
            {"buffer": 0, "byteOffset": at, "byteLength": bin.len() - at, "target": 34963}],
        "buffers": [{"byteLength": bin.len()}]
    });
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((28 + json.len() as u32 + bin.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bin)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    file
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Returns grids of two parts, and the model with them.
fn attached_grids() -> ([Occluder; 2], Vec<u8>) {
    let bytes = glb();
    let nothing = &|_: &str| unreachable!("it names no files");
    let loaded = LoadedMesh::from_bytes("a.glb", bytes.clone(), nothing).unwrap();
    let nodes = Nodes::new(&bytes, &loaded).unwrap();
    let placement = Placement {
        resolution: [8, 9, 10],
        ..Placement::paper()
    };
    let options = BakeOptions {
        sampling: Sampling::CubeFaces { size: 8 },
        ..BakeOptions::paper()
    };
    let grid_of =
        |idx: usize| grid(&loaded.part(idx).unwrap().mesh, &placement, &options).to_bytes();
    let occluders = ["Base", "Wide"].map(|name| Occluder {
        uri: format!("{name}.ao.ktx2"),
        bytes: grid_of(if name == "Base" { 0 } else { 2 }),
        nodes: nodes.of_part(name).unwrap(),
    });
    let out = attach(&bytes, &nodes, &occluders).unwrap();
    (occluders, out)
}

/// Returns what other programs find in a GLB file.
fn found(node: &Path, glb: &[u8]) -> Value {
    let path = node.join("grids.glb");
    fs::write(&path, glb).unwrap();

    let read = Command::new("node")
        .arg("glb.mjs")
        .arg(&path)
        .current_dir(node)
        .output()
        .unwrap();
    assert!(
        read.status.success(),
        "{}",
        String::from_utf8_lossy(&read.stderr)
    );
    serde_json::from_slice(&read.stdout).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().unwrap().iter();
    numbers.map(|v| v.as_f64().unwrap()).collect()
}

#[test]
fn other_programs_read_models_with_grids() {
    let Some(node) = node() else { return };
    let (occluders, out) = attached_grids();
    let found = found(node, &out);
    // The messages of the validator about any extension that it does not know, and about what only that uses.
    assert_eq!(
        found["codes"],
        json!(["UNSUPPORTED_EXTENSION", "UNUSED_OBJECT"])
    );
    assert_eq!(
        (&found["numErrors"], &found["numWarnings"]),
        (&json!(0), &json!(0))
    );
    let [base, wide] = occluders.each_ref().map(|occluder| hex(&occluder.bytes));
    // The grid of the stretched node was baked from the stretched mesh.
    let half = json!([
        0.5, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0
    ]);
    assert_eq!(
        (&found["grids"]["0"]["hex"], &found["grids"]["1"]["hex"]),
        (&json!(base), &json!(base))
    );
    assert_eq!(found["grids"]["1"]["matrix"], Value::Null);
    assert_eq!(found["grids"]["2"]["hex"], json!(wide));
    assert_eq!(numbers(&found["grids"]["2"]["matrix"]), numbers(&half));
    let uris = json!({"Base": "Base.ao.ktx2", "Arm": "Base.ao.ktx2", "Wide": "Wide.ao.ktx2"});
    assert_eq!(found["userData"], uris);
    // glTF-Transform drops the extension and keeps the extras, by which grids find their nodes again.
    assert_eq!(found["dropped"], Value::Null);
    let hash = |occluder: &Occluder| blake3::hash(&occluder.bytes).to_hex().to_string();
    let [base, wide] = occluders.each_ref().map(hash);
    assert_eq!(found["kept"], json!([base, base, wide]));
    for (grid, node) in attached(&out).unwrap().iter().zip(0..) {
        let (_, bytes) = grid.file.as_ref().unwrap();
        assert_eq!(grid.node, node);
        assert!(Grid::from_bytes(bytes).is_ok());
        assert_eq!(grid.pose == Pose::IDENTITY, node != 2);
    }
    assert_eq!(EXTENSION, "AOGRID_occluder");
}
