//! A small GLB file, edited and read again.

use serde_json::Value;

use super::*;
use crate::glb::Container;
use crate::mesh::LoadedMesh;

/// Two nodes with one mesh of a primitive, the second one mirrored and stretched; unusual spaces, an
/// unknown extension, extras.
const JSON: &str = r#"{ "asset" : {"version":"2.0", "extras": {"by": "me"}},
  "scene":0,"scenes":[{"nodes":[0,1]}],
  "nodes":[{"mesh":0},{"mesh":0,"translation":[5,0,0],"scale":[-1,2,1]}],
  "meshes" : [ {"name":"t", "primitives":[{"attributes":{"POSITION":0, "COLOR_0":1}}]} ],
  "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",
    "min":[0,0,0],"max":[1,1,0]},
    {"bufferView":1,"componentType":5121,"normalized":true,"count":3,"type":"VEC3"}],
  "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":12,"byteStride":4}],
  "buffers":[{"byteLength":48}], "extensions":{"X_unknown":{"a":1.50}}, "extensionsUsed":["X_unknown"] }"#;

fn glb() -> Vec<u8> {
    let positions: [[f32; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut bin: Vec<u8> = positions
        .as_flattened()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    bin.extend([255, 51, 0, 0].repeat(3));
    let empty = Container {
        json: b"",
        bin: None,
        rest: b"",
    };
    empty.with(JSON.as_bytes().to_vec(), bin).unwrap()
}

fn load(bytes: &[u8]) -> (crate::mesh::MeshFile, LoadedMesh) {
    let nothing = &|_: &str| unreachable!("it names no files");
    let file = crate::mesh::MeshFile::from_bytes("a.glb", bytes.to_vec(), nothing).unwrap();
    let loaded = file.parse().unwrap();
    (file, loaded)
}

fn values(primitive: &PosedPrimitive, first: f32) -> GlbValues<'_> {
    GlbValues {
        primitive,
        accessibility: vec![first, 0.5, 0.25],
        bent_normals: vec![[0.0, 0.0, 1.0]; 3],
        colors: None,
    }
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(Container::new(bytes).unwrap().json).unwrap()
}

#[test]
fn each_node_gets_values_and_all_else_stays() {
    let bytes = glb();
    let (file, loaded) = load(&bytes);
    let [a, b] = &loaded.primitives[..] else {
        panic!("two nodes have a primitive");
    };
    assert_eq!((a.vertices.clone(), b.vertices.clone()), (0..3, 3..6));
    let colors = file.colors(a).unwrap().unwrap();
    assert_eq!(colors, [[1.0, 0.2, 0.0, 1.0]; 3]);
    let both = [values(a, 1.0), values(b, 0.75)];
    let out = add_to_glb(&bytes, &both, r#"{"rays":512}"#).unwrap();
    let new = json(&out);
    assert_eq!(new["nodes"][0]["mesh"], 0);
    assert_eq!(new["nodes"][1]["mesh"], 1);
    assert_eq!(new["asset"]["extras"]["aogrid"]["rays"], 512);
    assert_eq!(new["asset"]["extras"]["by"], "me");
    for (mesh, first) in [(0, 1.0_f32), (1, 0.75)] {
        let mesh = &new["meshes"][mesh];
        assert_eq!(mesh["name"], "t");
        let attributes = &mesh["primitives"][0]["attributes"];
        assert_eq!(attributes["POSITION"], 0);
        let accessor = attributes[ACCESSIBILITY].as_u64().unwrap() as usize;
        let view = new["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize;
        let offset = new["bufferViews"][view]["byteOffset"].as_u64().unwrap() as usize;
        let bin = Container::new(&out).unwrap().bin.unwrap();
        assert_eq!(bin[offset..offset + 4], first.to_le_bytes());
    }
    // The text up to the first edit, and the old part of the chunk, are the same bytes.
    let (old_text, old) = (Container::new(&bytes).unwrap(), json(&bytes));
    let new_text = Container::new(&out).unwrap();
    let same = old_text.json.iter().zip(new_text.json);
    let n_same = same.take_while(|(a, b)| a == b).count();
    assert!(JSON[..n_same].ends_with("\"me\""), "{}", &JSON[..n_same]);
    assert!(new_text.bin.unwrap().starts_with(old_text.bin.unwrap()));
    assert_eq!(new["extensions"], old["extensions"]);
    let (_, again) = load(&out);
    assert_eq!(again.mesh, loaded.mesh);
}

#[test]
fn a_second_bake_replaces_the_first() {
    let bytes = glb();
    let (_, loaded) = load(&bytes);
    let mut first = values(&loaded.primitives[0], 1.0);
    first.colors = Some(vec![[0.5; 4]; 3]);
    let once = add_to_glb(&bytes, &[first], "1").unwrap();
    let twice = add_to_glb(&once, &[values(&loaded.primitives[0], 0.0)], "2").unwrap();
    let text = Container::new(&twice).unwrap().json;
    let n = |name: &str| String::from_utf8_lossy(text).matches(name).count();
    assert_eq!([n(ACCESSIBILITY), n("COLOR_0"), n("aogrid")], [1, 1, 1]);
    assert_eq!(json(&twice)["asset"]["extras"]["aogrid"], 2);
    let (file, loaded) = load(&twice);
    let colors = file.colors(&loaded.primitives[0]).unwrap().unwrap();
    assert_eq!(colors, [[0.5; 4]; 3]);
}

#[test]
fn files_that_cannot_be_edited_are_refused() {
    let bytes = glb();
    let add = |bytes: &[u8]| add_to_glb(bytes, &[], "1").unwrap_err();
    assert_eq!(add(b"v 0 0 0\n"), GlbError::NotGlb);
    assert_eq!(add(&bytes[..40]), GlbError::Broken);
    let external = JSON.replace(r#"{"byteLength":48}"#, r#"{"byteLength":48,"uri":"a.bin"}"#);
    let container = Container::new(&bytes).unwrap();
    let file = container.with(external.into(), vec![0; 48]).unwrap();
    assert_eq!(add(&file), GlbError::NoBinary);
    // Other broken files must not panic; the command reads them as meshes first.
    for at in 0..bytes.len() {
        for byte in [0, b'"', b'{', b']', b'9', 0xFF] {
            let mut broken = bytes.clone();
            broken[at] = byte;
            let _ = add_to_glb(&broken, &[], "1");
        }
    }
}

#[test]
fn a_texture_goes_to_the_materials_of_what_is_baked() {
    let bytes = glb();
    let (_, loaded) = load(&bytes);
    let picture = GlbTexture {
        png: b"picture",
        set: 1,
    };
    let add = |bytes: &[u8]| add_texture_to_glb(bytes, &loaded.primitives, picture, "7").unwrap();
    let out = add(&bytes);
    let new = json(&out);
    let expected = serde_json::json!({"index": 0, "texCoord": 1});
    // Without a material it gets one, which both nodes share with the mesh.
    assert_eq!(new["meshes"][0]["primitives"][0]["material"], 0);
    assert_eq!(
        new["materials"],
        serde_json::json!([{"occlusionTexture": expected}])
    );
    assert_eq!(new["asset"]["extras"]["aogrid"], 7);
    let view = new["images"][0]["bufferView"].as_u64().unwrap() as usize;
    let offset = new["bufferViews"][view]["byteOffset"].as_u64().unwrap() as usize;
    let bin = Container::new(&out).unwrap().bin.unwrap();
    assert_eq!(&bin[offset..offset + 7], b"picture");
    assert_eq!(new["accessors"], json(&bytes)["accessors"]);
    // A second bake replaces the texture of the material.
    let again = json(&add(&out));
    let texture = &again["materials"][0]["occlusionTexture"];
    assert_eq!(
        (
            &texture["index"],
            again["materials"].as_array().unwrap().len()
        ),
        (&1.into(), 1)
    );
}

#[test]
fn a_material_of_others_is_copied() {
    let more = r#""materials":[{"name":"m","doubleSided":true},{}], "accessors""#;
    let meshes = r#"COLOR_0":1},"material":0}]}, {"primitives":[{"attributes":{"POSITION":0},"material":0}]} ]"#;
    let json_text = JSON
        .replace(r#""accessors""#, more)
        .replace(r#"COLOR_0":1}}]} ]"#, meshes);
    let bytes = glb();
    let container = Container::new(&bytes).unwrap();
    let bytes = container
        .with(json_text.into_bytes(), container.bin.unwrap().to_vec())
        .unwrap();
    let (_, loaded) = load(&bytes);
    let picture = GlbTexture { png: b"p", set: 0 };
    let out = add_texture_to_glb(&bytes, &loaded.primitives, picture, "7").unwrap();
    let new = json(&out);
    let texture = serde_json::json!({"index": 0, "texCoord": 0});
    let copy = serde_json::json!({"name": "m", "doubleSided": true, "occlusionTexture": texture});
    assert_eq!(new["materials"][2], copy);
    assert_eq!(new["materials"][0], json(&bytes)["materials"][0]);
    let material = |mesh: usize| &new["meshes"][mesh]["primitives"][0]["material"];
    assert_eq!((material(0), material(1)), (&2.into(), &0.into()));
}
