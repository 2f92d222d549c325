//! Grids attached to the nodes of a small GLB file, and read back.

use serde_json::Value;

use super::*;
use crate::mesh::{LoadedMesh, Pose};

/// A base with two children: an arm, a quarter turn about z and doubled, that shares its mesh; and a sheet,
/// which is stretched.
const JSON: &str = r#"{"asset":{"version":"2.0"}, "scenes":[{"nodes":[ 0 ]}],
  "nodes":[{"name":"Base","mesh":0,"translation":[1,2,3],"children":[1,2]},
    {"name":"Arm","mesh":0,"rotation":[0,0,0.7071068,0.7071068],"scale":[2,2,2],"extras":{"by":"me"}},
    {"name":"Sheet","mesh":0,"scale":[1,3,1],"extensions":{"X_unknown":{"a":1.50}}}],
  "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
  "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",
    "min":[0,0,0],"max":[1,1,0]}],
  "bufferViews":[{"buffer":0,"byteLength":36}],
  "buffers":[{"byteLength":36}], "extensionsUsed":["X_unknown"] }"#;

fn glb(json: &str) -> Vec<u8> {
    let positions: [[f32; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let numbers = positions.as_flattened().iter();
    let bin = numbers.flat_map(|v| v.to_le_bytes()).collect();
    let empty = Container {
        json: b"",
        bin: None,
        rest: b"",
    };
    empty.with(json.as_bytes().to_vec(), bin).unwrap()
}

fn nodes(bytes: &[u8]) -> Nodes {
    let nothing = &|_: &str| unreachable!("it names no files");
    let loaded = LoadedMesh::from_bytes("a.glb", bytes.to_vec(), nothing).unwrap();
    Nodes::new(bytes, &loaded).unwrap()
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(Container::new(bytes).unwrap().json).unwrap()
}

fn occluder(uri: &str, nodes: Vec<PosedNode>) -> Occluder {
    Occluder {
        uri: uri.into(),
        bytes: b"a grid file".to_vec(),
        nodes,
    }
}

/// Largest deviation of what a pose and its matrix do to a point, both in double precision: the
/// rotation in the file has seven digits, which an inverse does not undo exactly.
const ROUNDING: f64 = 1e-14;

fn assert_close(a: [f64; 3], b: [f64; 3]) {
    assert!(
        (0..3).all(|x| (a[x] - b[x]).abs() < ROUNDING),
        "{a:?} {b:?}"
    );
}

#[test]
fn one_grid_serves_all_nodes_of_its_mesh_and_all_else_stays() {
    let bytes = glb(JSON);
    let nodes = nodes(&bytes);
    let names: Vec<_> = nodes.parts().collect();
    assert_eq!(names, ["Base", "Arm", "Sheet"]);
    let of_base = nodes.of_part("Base").unwrap();
    assert_eq!(of_base, [(0, Pose::IDENTITY), (1, Pose::IDENTITY)]);
    assert_eq!(nodes.of_part("Arm").unwrap(), of_base);
    assert_eq!(nodes.of_part("Leg").unwrap(), []);
    let out = attach(&bytes, &nodes, &[occluder("b.ao.ktx2", of_base)]).unwrap();
    let found = attached(&out).unwrap();
    let hash = blake3::hash(b"a grid file").to_hex().to_string();
    for (grid, (node, name)) in found.iter().zip([(0, "Base"), (1, "Arm")]) {
        assert_eq!((grid.node, grid.name.as_deref()), (node, Some(name)));
        assert_eq!(grid.uri.as_deref(), Some("b.ao.ktx2"));
        assert_eq!(grid.blake3.as_ref(), Some(&hash));
        assert_eq!(grid.file, Some((1, b"a grid file".to_vec())));
        assert_eq!(grid.pose, Pose::IDENTITY);
    }
    assert_eq!(found.len(), 2);
    let (old, new) = (json(&bytes), json(&out));
    assert_eq!(
        new["extensionsUsed"],
        serde_json::json!(["X_unknown", EXTENSION])
    );
    assert_eq!(new["nodes"][1]["extras"]["by"], "me");
    assert_eq!(new["nodes"][2], old["nodes"][2]);
    assert_eq!(new["meshes"], old["meshes"]);
    assert_eq!(new["bufferViews"][1]["byteOffset"], 48);
    assert_eq!(new["buffers"][0]["byteLength"], 59);
}

#[test]
fn a_grid_of_a_stretched_node_is_posed_in_it() {
    let bytes = glb(JSON);
    let nodes = nodes(&bytes);
    let of_sheet = nodes.of_part("Sheet").unwrap();
    let out = attach(&bytes, &nodes, &[occluder("s", of_sheet)]).unwrap();
    let pose = attached(&out).unwrap()[0].pose;
    // The part's mesh is stretched already: the node's own stretch is undone, and its parent's
    // translation remains.
    assert_close(pose.point([1.0, 3.0, 2.0]), [1.0, 1.0, 2.0]);
    let new = json(&out);
    assert_eq!(new["nodes"][2]["extensions"]["X_unknown"]["a"], 1.5);
    let matrix = &new["nodes"][2]["extensions"][EXTENSION]["matrix"];
    assert_eq!(*matrix, new["nodes"][2]["extras"]["aogrid"]["matrix"]);
    let stretched = [
        1.0,
        0.0,
        0.0,
        0.0,
        0.0,
        1.0 / 3.0,
        0.0,
        0.0,
        0.0,
        0.0,
        1.0,
        0.0,
        0.0,
        0.0,
        0.0,
        1.0,
    ];
    assert_eq!(*matrix, serde_json::json!(stretched));
}

#[test]
fn a_grid_of_the_whole_goes_to_the_only_root_or_to_a_node_of_its_own() {
    let bytes = glb(JSON);
    let (node, pose) = nodes(&bytes).only_root().unwrap().unwrap();
    assert_eq!(node, 0);
    assert_close(pose.point([1.0, 2.0, 3.0]), [0.0; 3]);
    let bytes = glb(&JSON.replace("[ 0 ]", "[0,1]").replace("[1,2]}", "[2]}"));
    let nodes = nodes(&bytes);
    assert_eq!(nodes.only_root().unwrap(), None);
    let out = attach(&bytes, &nodes, &[occluder("w", vec![])]).unwrap();
    let new = json(&out);
    assert_eq!(new["scenes"][0]["nodes"], serde_json::json!([0, 1, 3]));
    let found = attached(&out).unwrap();
    assert_eq!(
        (found[0].node, found[0].name.as_deref()),
        (3, Some("aogrid"))
    );
    assert_eq!(found[0].uri.as_deref(), Some("w"));
}

#[test]
fn a_grid_finds_its_node_again_when_a_program_has_dropped_the_extension() {
    let bytes = glb(JSON);
    let file = occluder("s", nodes(&bytes).of_part("Sheet").unwrap());
    let out = attach(&bytes, &nodes(&bytes), &[file]).unwrap();
    let text = String::from_utf8(Container::new(&out).unwrap().json.to_vec()).unwrap();
    let container = Container::new(&out).unwrap();
    let text = text.replace(EXTENSION, "X_other").into_bytes();
    let dropped = container.with(text, container.bin.unwrap().to_vec());
    let dropped = dropped.unwrap();
    let found = attached(&dropped).unwrap();
    assert_eq!((found[0].node, &found[0].file), (2, &None));
    let hash = blake3::hash(b"a grid file").to_hex();
    assert_eq!(nodes(&dropped).with_hash(&hash), [(2, found[0].pose)]);
    assert_ne!(found[0].pose, Pose::IDENTITY);
    assert_eq!(nodes(&dropped).with_hash("0"), []);
}

#[test]
fn what_cannot_be_attached_is_refused() {
    let bytes = glb(JSON);
    let nodes = nodes(&bytes);
    assert_eq!(nodes.named("Arm"), [1]);
    let one = || occluder("a", vec![(0, Pose::IDENTITY)]);
    let error = |bytes: &[u8], grids: &[Occluder]| attach(bytes, &nodes, grids).unwrap_err();
    assert_eq!(error(b"v 0 0 0\n", &[one()]), GlbError::NotGlb);
    assert_eq!(error(&bytes, &[one(), one()]), GlbError::TwoGrids(0));
    let none = occluder("a", vec![(9, Pose::IDENTITY)]);
    assert_eq!(error(&bytes, &[none]), GlbError::Missing("such node"));
    let once = attach(&bytes, &nodes, &[one()]).unwrap();
    assert_eq!(error(&once, &[one()]), GlbError::Attached(0));
    // A view beyond the chunk, and other broken files, are errors or harmless.
    let text = String::from_utf8(Container::new(&once).unwrap().json.to_vec()).unwrap();
    let beyond = text.replace(r#""byteOffset":48"#, r#""byteOffset":99"#);
    assert_eq!(attached(&glb(&beyond)).unwrap_err(), GlbError::NoGrid(0));
    for at in 0..once.len() {
        for byte in [0, b'"', b'{', b']', b'9', 0xFF] {
            let mut broken = once.clone();
            broken[at] = byte;
            let _ = attached(&broken);
            let _ = attach(&broken, &nodes, &[one()]);
        }
    }
}

#[test]
fn flat_nodes_pose_nothing() {
    let flat = JSON.replace("\"translation\":[1,2,3]", "\"scale\":[1,1,0]");
    let nodes = nodes(&glb(&flat));
    assert_eq!(nodes.only_root().unwrap_err(), GlbError::Flat(0));
}
