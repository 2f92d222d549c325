//! Small files written anew, one for each trap.

mod file;
mod skin;

use std::collections::HashMap;
use std::io;

use super::GltfError;
use crate::mesh::{LoadError, LoadedMesh, Pose};
use file::{File, TRIANGLE};

fn plain() -> File {
    File::new(r#"[{"mesh": 0}]"#)
}

/// Returns the corners of the only triangle, sorted.
fn corners(loaded: &LoadedMesh) -> [[f32; 3]; 3] {
    let mut corners = loaded.mesh.corners().next().unwrap();
    corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
    corners
}

fn names(loaded: &LoadedMesh) -> Vec<&str> {
    loaded
        .mesh
        .parts()
        .iter()
        .map(|part| part.name.as_str())
        .collect()
}

#[test]
fn buffers_may_be_in_the_file_beside_it_or_in_a_uri() {
    let within = plain().mesh();
    assert_eq!(within.mesh.triangles(), [[0, 1, 2]]);
    assert_eq!(within.warnings, Vec::<String>::new());

    let beside = plain().set("/buffers/0/uri", r#""my%20data.bin""#);
    let buffer = beside.buffer.clone();
    let resolver = |path: &str| match path {
        "my data.bin" => Ok(buffer.clone()),
        _ => Err(io::Error::from(io::ErrorKind::NotFound)),
    };
    let text = beside.json.to_string().into_bytes();
    let loaded = LoadedMesh::from_bytes("a.gltf", text.clone(), &resolver).unwrap();
    assert_eq!(loaded.mesh, within.mesh);
    // The hash covers the buffer.
    let mut other = buffer.clone();
    other[47] += 1;
    let moved = LoadedMesh::from_bytes("a.gltf", text, &|_| Ok(other.clone())).unwrap();
    assert_ne!(moved.blake3, loaded.blake3);

    use base64::Engine;
    let data = base64::engine::general_purpose::STANDARD.encode(&buffer);
    let uri = format!(r#""data:application/octet-stream;base64,{data}""#);
    let text = plain().set("/buffers/0/uri", &uri).json.to_string();
    let inline = LoadedMesh::from_bytes("a.gltf", text.into(), &|_| unreachable!()).unwrap();
    assert_eq!(inline.mesh, within.mesh);
}

#[test]
fn nodes_pose_their_meshes() {
    // Scale by 2 about the origin, a quarter turn about z, then a shift; below a shifted parent.
    let s = std::f64::consts::FRAC_1_SQRT_2;
    let nodes = format!(
        r#"[{{"children": [1], "translation": [0, 0, 7]}},
        {{"mesh": 0, "scale": [2, 2, 2], "rotation": [0, 0, {s}, {s}], "translation": [5, 0, 0]}}]"#
    );
    let loaded = File::new(&nodes).mesh();
    let expected = [[3.0, 0.0, 7.0], [5.0, 0.0, 7.0], [5.0, 2.0, 7.0]];
    for (found, expected) in corners(&loaded)
        .iter()
        .flatten()
        .zip(expected.iter().flatten())
    {
        assert!((found - expected).abs() < 1e-6, "{:?}", corners(&loaded));
    }
    let by_matrix = r#"[{"mesh": 0, "matrix": [0,2,0,0, -2,0,0,0, 0,0,2,0, 5,0,7,1]}]"#;
    assert_eq!(corners(&File::new(by_matrix).mesh()), expected);
}

#[test]
fn a_mirrored_node_keeps_its_faces_outward() {
    let normal = |loaded: &LoadedMesh| {
        let [a, b, c] = loaded.mesh.corners().next().unwrap();
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    assert!(normal(&plain().mesh()) > 0.0);
    let mirrored = File::new(r#"[{"mesh": 0, "scale": [-1, 1, 1]}]"#).mesh();
    assert!(normal(&mirrored) > 0.0);
}

#[test]
fn nodes_that_share_a_mesh_are_parts_that_share_it() {
    let nodes = r#"[{"children": [1, 2, 3]}, {"name": "wheel #1", "mesh": 0},
        {"name": "wheel #1", "mesh": 0, "translation": [9, 0, 0], "scale": [-2, 2, 2]},
        {"mesh": 0, "scale": [1, 3, 1], "translation": [0, 0, 4]}]"#;
    let loaded = File::new(nodes).mesh();
    assert_eq!(names(&loaded), ["wheel #1", "wheel #1~2", "m"]);
    let parts: Vec<_> = (0..3).map(|idx| loaded.part(idx).unwrap()).collect();
    assert_eq!(
        parts.iter().map(|p| p.same_as).collect::<Vec<_>>(),
        [0, 0, 2]
    );
    assert_eq!(parts[0].pose, Pose::IDENTITY);
    assert_eq!(parts[0].mesh, parts[1].mesh);
    assert_eq!(parts[1].pose.translation, [9.0, 0.0, 0.0]);
    // A stretched part is stretched in its own frame: a grid cannot be.
    assert_eq!(parts[2].pose.linear, Pose::IDENTITY.linear);
    assert_eq!(parts[2].mesh.bounds().max, [1.0, 3.0, 0.0]);
    for (idx, part) in parts.iter().enumerate() {
        let whole = loaded.mesh.part(idx).unwrap();
        let mut posed: Vec<_> = part.mesh.corners().flatten().collect();
        posed
            .iter_mut()
            .for_each(|p| *p = part.pose.point(p.map(f64::from)).map(|v| v as f32));
        let mut expected: Vec<_> = whole.corners().flatten().collect();
        posed.sort_by(|a, b| a.partial_cmp(b).unwrap());
        expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert_eq!(posed, expected, "{idx}");
    }
}

#[test]
fn strips_and_fans_are_triangles_and_points_are_not() {
    let mode = |mode: u32| {
        let file = plain().replace("/accessors/1/count", "4");
        file.set("/meshes/0/primitives/0/mode", &mode.to_string())
    };
    assert_eq!(mode(5).mesh().mesh.triangles(), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(mode(6).mesh().mesh.triangles(), [[0, 1, 2], [0, 2, 3]]);
    for lines in 0..4 {
        assert!(mode(lines).error().contains("no triangles"), "{lines}");
    }
    assert!(mode(7).error().contains("unknown mode"));
    let mut unindexed = plain();
    let primitive = unindexed
        .json
        .pointer_mut("/meshes/0/primitives/0")
        .unwrap();
    primitive.as_object_mut().unwrap().remove("indices");
    assert_eq!(unindexed.mesh().mesh.triangles(), [[0, 1, 2]]);
}

#[test]
fn sparse_values_replace_those_of_the_accessor() {
    // Element 1 becomes the fourth vertex; its index is byte 49.
    let sparse = r#"{"count": 1, "indices": {"bufferView": 1, "byteOffset": 1,
        "componentType": 5121}, "values": {"bufferView": 0, "byteOffset": 36}}"#;
    let loaded = plain().set("/accessors/0/sparse", sparse).mesh();
    assert_eq!(loaded.mesh.corners().next().unwrap()[1], TRIANGLE[3]);
    let outside = sparse.replace(r#""byteOffset": 1,"#, r#""byteOffset": 3,"#);
    let outside = plain()
        .replace("/accessors/0/count", "3")
        .set("/accessors/0/sparse", &outside);
    assert!(outside.error().contains("sparse index"));
    // Without a buffer view all others are zero.
    let mut alone = plain().set("/accessors/0/sparse", sparse);
    let accessor = alone.json.pointer_mut("/accessors/0").unwrap();
    accessor.as_object_mut().unwrap().remove("bufferView");
    assert!(alone.error().contains("no area"));
    let endless = alone.replace("/accessors/0/count", "99999999999999");
    assert!(endless.error().contains("no data"));
}

#[test]
fn quantized_positions_are_read() {
    let mut file = plain()
        .replace("/accessors/0/componentType", "5122")
        .set("/bufferViews/0/byteStride", "8")
        .set("/accessors/0/normalized", "true")
        .set("/extensionsRequired", r#"["KHR_mesh_quantization"]"#);
    let shorts = [
        [0, 0, 0, 9],
        [i16::MAX, 0, 0, 9],
        [0, i16::MIN, 0, 9],
        [0, 0, 0, 9],
    ];
    let bytes = shorts.iter().flatten().flat_map(|v| v.to_le_bytes());
    file.buffer.splice(..32, bytes);
    let bounds = file.mesh().mesh.bounds();
    // The smallest integer stands for −1, as the largest one's opposite does.
    assert_eq!(
        (bounds.min, bounds.max),
        ([0.0, -1.0, 0.0], [1.0, 0.0, 0.0])
    );
    let whole = file.set("/accessors/0/normalized", "false").mesh();
    assert_eq!(whole.mesh.bounds().max[0], 32767.0);
}

#[test]
fn what_cannot_be_read_is_refused_by_name() {
    for name in [
        "KHR_draco_mesh_compression",
        "EXT_meshopt_compression",
        "VENDOR_new",
    ] {
        let required = plain().set("/extensionsRequired", &format!("[{name:?}]"));
        assert!(required.error().contains(name), "{name}");
    }
    let harmless = r#"["KHR_materials_unlit", "KHR_texture_transform"]"#;
    assert!(plain().set("/extensionsRequired", harmless).load().is_ok());
    assert!(
        plain()
            .replace("/asset/version", r#""1.0""#)
            .error()
            .contains("glTF 1.0")
    );
    for (pointer, wrong, word) in [
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            "9",
            "accessor 9",
        ),
        ("/meshes/0/primitives/0/indices", "9", "accessor 9"),
        ("/meshes/0/primitives/0/indices", "0", "not vertex indices"),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            "1",
            "not positions",
        ),
        ("/accessors/0/count", "5", "beyond its buffer view"),
        (
            "/accessors/0/count",
            "18446744073709551615",
            "beyond its buffer view",
        ),
        ("/accessors/0/count", "2", "vertex 2"),
        ("/accessors/0/bufferView", "9", "buffer view 9"),
        ("/accessors/0/componentType", "1", "unknown type"),
        ("/bufferViews/0/byteLength", "99", "reaches beyond"),
        ("/bufferViews/0/buffer", "9", "buffer 9"),
        ("/buffers/0/byteLength", "99", "52 bytes, not 99"),
        ("/nodes/0/mesh", "9", "mesh 9"),
        ("/scenes/0/nodes/0", "9", "node 9"),
        ("/scene", "9", "scene 9"),
    ] {
        let error = plain().replace(pointer, wrong).error();
        assert!(error.contains(word), "{pointer}: {error}");
    }
    let stride = plain().set("/bufferViews/0/byteStride", "4");
    assert!(stride.error().contains("stride"));
}

#[test]
fn cycles_end() {
    let own = File::new(r#"[{"mesh": 0, "children": [0]}]"#).error();
    assert!(own.contains("node 0"), "{own}");
    let two = File::new(r#"[{"children": [1, 1]}, {"mesh": 0}]"#).error();
    assert!(two.contains("node 1"), "{two}");
    // A scene that lists a node and its child, as some exporters write, shows both once.
    let listed =
        File::new(r#"[{"children": [1]}, {"mesh": 0}]"#).replace("/scenes/0/nodes", "[1, 0]");
    assert_eq!(listed.mesh().mesh.triangles().len(), 1);
    // Deeper than a thread's stack is high.
    let deep: Vec<_> = (1..100_000)
        .map(|child| format!(r#"{{"children": [{child}]}}"#))
        .collect();
    let deep = format!(r#"[{}, {{"mesh": 0}}]"#, deep.join(","));
    assert_eq!(File::new(&deep).mesh().mesh.triangles().len(), 1);
}

#[test]
fn what_is_read_otherwise_is_said() {
    let warning = |file: File, word: &str| {
        let loaded = file.mesh();
        let found = loaded.warnings.iter().any(|warning| warning.contains(word));
        assert!(found, "{word}: {:?}", loaded.warnings);
        loaded
    };
    let skinned = r#"[{"mesh": 0, "skin": 0, "translation": [9, 9, 9]}]"#;
    let skinned = File::new(skinned).set("/skins", r#"[{"joints": [0]}]"#);
    assert_eq!(
        warning(skinned, "bind pose").mesh.bounds().max,
        [1.0, 1.0, 0.0]
    );
    let masked = plain()
        .set("/materials", r#"[{"alphaMode": "MASK"}]"#)
        .set("/meshes/0/primitives/0/material", "0");
    warning(masked, "holes");
    let morphed = plain().set("/meshes/0/primitives/0/targets", r#"[{"POSITION": 0}]"#);
    warning(morphed, "morph");
    let scenes = plain().replace("/scenes", r#"[{"nodes": [0]}, {"nodes": []}]"#);
    warning(scenes, "2 scenes");
    let unbounded = plain().replace("/accessors/0/min", "null");
    warning(unbounded, "not valid glTF (meshes[0].primitives[0]");
    let outside = plain().replace("/accessors/0/max", "[0.5, 1, 0.5]");
    warning(outside, "own bounds");
    let listed = File::new(r#"[{"children": [1]}, {"mesh": 0}]"#);
    warning(listed.replace("/scenes/0/nodes", "[1, 0]"), "read once");
    let mut odd = plain();
    odd.buffer.push(0);
    warning(odd, "multiple of four");
    let hidden = r#"[{"children": [1, 2]}, {"mesh": 0},
        {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": false}}}]"#;
    assert_eq!(warning(File::new(hidden), "hidden").mesh.parts().len(), 1);
    let instanced = r#"[{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {}}}]"#;
    warning(File::new(instanced), "EXT_mesh_gpu_instancing");
}

#[test]
fn broken_containers_are_refused() {
    let whole = plain().glb();
    // Cut anywhere it is an error, not a panic.
    for length in 4..whole.len() {
        let cut = whole[..length].to_vec();
        let result = LoadedMesh::from_bytes("a.glb", cut, &|_| unreachable!());
        assert!(matches!(result, Err(LoadError::Gltf(_))), "{length}");
    }
    let mut texts = HashMap::new();
    for (at, byte) in [(4, 1), (8, 255), (16, 0)] {
        let mut broken = whole.clone();
        broken[at] = byte;
        let error = LoadedMesh::from_bytes("a.glb", broken, &|_| unreachable!()).unwrap_err();
        texts.insert(at, error.to_string());
    }
    assert!(texts[&4].contains("glTF 1"));
    assert!(texts[&8].contains("shorter"));
    assert!(texts[&16].contains("not JSON"));
    let missing = plain()
        .set("/buffers/0/uri", r#""gone.bin""#)
        .json
        .to_string();
    let error = LoadedMesh::from_bytes("a.gltf", missing.into(), &|_| {
        Err(io::Error::from(io::ErrorKind::NotFound))
    });
    let error = error.unwrap_err();
    assert!(matches!(
        &error,
        LoadError::Gltf(GltfError::External { path, .. }) if path == "gone.bin"
    ));
}

#[test]
fn broken_files_give_a_mesh_or_an_error() {
    let sparse = r#"{"count": 1, "indices": {"bufferView": 1, "byteOffset": 1,
        "componentType": 5121}, "values": {"bufferView": 0, "byteOffset": 36}}"#;
    let nodes = r#"[{"mesh": 0, "scale": [-1, 1, 2], "children": [1]}, {"mesh": 0}]"#;
    let file = File::new(nodes).set("/accessors/0/sparse", sparse);
    super::super::load_all_broken("a.glb", &file.glb());
}
