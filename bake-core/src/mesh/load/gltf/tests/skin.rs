//! Skins and animations against closed forms: a triangle on two joints.

use gltf_json::Value;

use super::super::super::{AnimationTime, MeshFile};
use super::file::File;
use crate::mesh::{LoadError, LoadedMesh};

const FLOAT: u32 = 5126;
const BYTE: u32 = 5121;
const SHORT: u32 = 5123;

/// The rounding of single floats over a few operations with numbers up to 10.
const TOLERANCE: f64 = 2e-6;

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

impl File {
    /// Adds an accessor of its own bytes.
    fn with(mut self, bytes: &[u8], count: usize, component: u32, type_: &str) -> Self {
        let normalized = component != FLOAT && type_ == "VEC4 normalized";
        let type_ = type_.trim_end_matches(" normalized");
        let view = format!(
            r#"{{"buffer": 0, "byteOffset": {}, "byteLength": {}}}"#,
            self.buffer.len(),
            bytes.len()
        );
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(gltf_json::deserialize::from_str(&view).unwrap());
        let accessor = format!(
            r#"{{"bufferView": {}, "componentType": {component}, "normalized": {normalized},
            "count": {count}, "type": "{type_}"}}"#,
            views.len() - 1
        );
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(gltf_json::deserialize::from_str(&accessor).unwrap());
        self.buffer.extend(bytes);
        self.json["buffers"][0]["byteLength"] = Value::from(self.buffer.len());
        self
    }

    fn posed(&self, animation: Option<&str>, time: f64) -> Result<LoadedMesh, LoadError> {
        let missing = |_: &str| unreachable!("all is in the file");
        let file = MeshFile::from_bytes("a.glb", self.glb(), &missing)?;
        file.parse_posed(&AnimationTime { animation, time })
    }

    fn positions(&self, animation: &str, time: f64) -> Vec<[f64; 3]> {
        let loaded = self.posed(Some(animation), time).unwrap();
        let positions = loaded.mesh.positions().iter();
        positions.map(|p| p.map(f64::from)).collect()
    }

    fn refusal(&self, animation: &str) -> String {
        self.posed(Some(animation), 0.5).unwrap_err().to_string()
    }
}

/// Returns a triangle (0,0,0), (1,0,0), (0,1,0) of which the first corner is bound to joint 0, the
/// second to joint 1 at (1,0,0), and the third by a fifth to joint 0 and by four fifths to joint 1.
fn skinned() -> File {
    let nodes = r#"[{"children": [1, 2]}, {"mesh": 0, "skin": 0, "translation": [100, 0, 0]},
        {"children": [3]}, {"translation": [1, 0, 0]}]"#;
    let joints = [[0, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0]].concat();
    let weights = [
        [255, 0, 0, 0],
        [255, 0, 0, 0],
        [51, 204, 0, 0],
        [255, 0, 0, 0],
    ]
    .concat();
    let mut inverse = [[0.0_f32; 16]; 2];
    for matrix in &mut inverse {
        (0..4).for_each(|x| matrix[5 * x] = 1.0);
    }
    inverse[1][12] = -1.0;
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turn = [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, half, half]].concat();
    let slide = [[1.0, 0.0, 0.0], [1.0, 0.0, 4.0], [1.0, 0.0, 9.0]].concat();
    // In-tangent, value and out-tangent of each key.
    let spline = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 6.0],
        [0.0, 0.0, 2.0],
        [1.0, 0.0, 8.0],
        [0.0, 0.0, 0.0],
    ];
    File::new(nodes)
        .with(&joints, 4, BYTE, "VEC4")
        .with(&weights, 4, BYTE, "VEC4 normalized")
        .with(&floats(inverse.as_flattened()), 2, FLOAT, "MAT4")
        .with(&floats(&[0.0, 2.0]), 2, FLOAT, "SCALAR")
        .with(&floats(&turn), 2, FLOAT, "VEC4")
        .with(&floats(&[0.0, 1.0, 2.0]), 3, FLOAT, "SCALAR")
        .with(&floats(&slide), 3, FLOAT, "VEC3")
        .with(&floats(spline.as_flattened()), 6, FLOAT, "VEC3")
        .set("/meshes/0/primitives/0/attributes/JOINTS_0", "2")
        .set("/meshes/0/primitives/0/attributes/WEIGHTS_0", "3")
        .set(
            "/skins",
            r#"[{"joints": [2, 3], "inverseBindMatrices": 4}]"#,
        )
        .set(
            "/animations",
            r#"[{"name": "turn", "samplers": [{"input": 5, "output": 6}],
                "channels": [{"sampler": 0, "target": {"node": 3, "path": "rotation"}}]},
            {"name": "slide", "samplers": [{"input": 7, "output": 8}],
                "channels": [{"sampler": 0, "target": {"node": 3, "path": "translation"}}]},
            {"name": "jump", "samplers": [{"input": 7, "output": 8, "interpolation": "STEP"}],
                "channels": [{"sampler": 0, "target": {"node": 3, "path": "translation"}}]},
            {"samplers": [{"input": 5, "output": 9, "interpolation": "CUBICSPLINE"}],
                "channels": [{"sampler": 0, "target": {"node": 3, "path": "translation"}}]}]"#,
        )
}

fn assert_close(found: &[[f64; 3]], expected: &[[f64; 3]]) {
    for (found, expected) in found.iter().zip(expected) {
        let off = (0..3).map(|x| (found[x] - expected[x]).abs());
        assert!(
            off.fold(0.0, f64::max) <= TOLERANCE,
            "{found:?} {expected:?}"
        );
    }
}

#[test]
fn joints_turn_their_vertices_by_their_weights() {
    let file = skinned();
    let bind = file.mesh();
    assert_eq!(
        bind.warnings,
        ["1 parts are skinned: they are read in bind pose"]
    );
    // Eighths of a turn about (1,0,0).
    for (time, degrees) in [
        (-1.0, 0.0),
        (0.0, 0.0),
        (0.5, 22.5),
        (1.0, 45.0),
        (7.0, 90.0),
    ] {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let turned = [1.0 - cos - sin, cos - sin, 0.0];
        let third = [0.8 * turned[0], 0.2 + 0.8 * turned[1], 0.0];
        let expected = [[0.0; 3], [1.0, 0.0, 0.0], third];
        assert_close(&file.positions("turn", time), &expected);
    }
    let posed = file.posed(Some("turn"), 1.0).unwrap();
    assert_eq!(posed.warnings, Vec::<String>::new());
    assert_eq!(posed.mesh.triangles(), bind.mesh.triangles());
    assert_eq!(
        *posed.part(0).unwrap().mesh.positions(),
        *posed.mesh.positions()
    );
    // The pose of the nodes as the file has them is the bind pose here.
    let rest = file.posed(None, 0.0).unwrap();
    assert_eq!(rest.mesh.positions(), bind.mesh.positions());
}

#[test]
fn keys_are_interpolated_as_the_file_says() {
    let file = skinned();
    // The Hermite spline from 0 to 8 with slopes 6 and 2 over 2 seconds.
    let spline = |t: f64| {
        let (t2, t3) = (t * t, t * t * t);
        12.0 * (t3 - 2.0 * t2 + t) + 8.0 * (3.0 * t2 - 2.0 * t3) + 4.0 * (t3 - t2)
    };
    let cases = [
        ("slide", 0.25, 1.0),
        ("slide", 1.0, 4.0),
        ("slide", 1.5, 6.5),
        ("slide", 5.0, 9.0),
        ("jump", 0.99, 0.0),
        ("jump", 1.0, 4.0),
        ("jump", 2.0, 9.0),
        ("animation 3", 0.5, spline(0.25)),
        ("animation 3", 1.0, spline(0.5)),
        ("animation 3", 3.0, 8.0),
    ];
    for (animation, time, z) in cases {
        let expected = [[0.0; 3], [1.0, 0.0, z], [0.0, 1.0, 0.8 * z]];
        assert_close(&file.positions(animation, time), &expected);
    }
}

#[test]
fn weights_may_be_floats_shorts_and_of_two_sets() {
    let expected = skinned().positions("turn", 1.0);
    let of_three = |third: [f32; 4]| {
        let one = [1.0, 0.0, 0.0, 0.0];
        floats(&[one, one, third, one].concat())
    };
    let float = skinned().with(&of_three([0.2, 0.8, 0.0, 0.0]), 4, FLOAT, "VEC4");
    let float = float.set("/meshes/0/primitives/0/attributes/WEIGHTS_0", "10");
    assert_close(&float.positions("turn", 1.0), &expected);

    let short = [
        [65535, 0, 0, 0],
        [65535, 0, 0, 0],
        [13107, 52428, 0, 0],
        [65535, 0, 0, 0],
    ];
    let short: Vec<u8> = short
        .concat()
        .iter()
        .flat_map(|v: &u16| v.to_le_bytes())
        .collect();
    let short = skinned().with(&short, 4, SHORT, "VEC4 normalized");
    let short = short.set("/meshes/0/primitives/0/attributes/WEIGHTS_0", "10");
    assert_close(&short.positions("turn", 1.0), &expected);

    // The weight of joint 1 in a second set.
    let none = [[0.0_f32; 4], [0.0; 4], [0.8, 0.0, 0.0, 0.0], [0.0; 4]].concat();
    let two = skinned()
        .with(&of_three([0.2, 0.0, 0.0, 0.0]), 4, FLOAT, "VEC4")
        .with(
            &[[0; 4], [0; 4], [1, 0, 0, 0], [0; 4]].concat(),
            4,
            BYTE,
            "VEC4",
        )
        .with(&floats(&none), 4, FLOAT, "VEC4")
        .set("/meshes/0/primitives/0/attributes/WEIGHTS_0", "10")
        .set("/meshes/0/primitives/0/attributes/JOINTS_1", "11")
        .set("/meshes/0/primitives/0/attributes/WEIGHTS_1", "12");
    assert_close(&two.positions("turn", 1.0), &expected);
}

#[test]
fn mirrored_joints_keep_faces_outward() {
    let mirrored = skinned().set("/nodes/2/scale", "[1, 1, -1]");
    let posed = mirrored.posed(None, 0.0).unwrap();
    assert_eq!(posed.mesh.triangles(), [[1, 0, 2]]);
}

#[test]
fn animations_move_nodes_without_skins() {
    let file = skinned()
        .replace(
            "/nodes",
            r#"[{"children": [3]}, {}, {}, {"mesh": 0, "rotation": [0, 0, 0, 1]}]"#,
        )
        .set("/animations/0/samplers/0/interpolation", r#""LINEAR""#);
    assert_close(
        &file.positions("turn", 9.0),
        &[[0.0; 3], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]],
    );
    let part = file.posed(Some("slide"), 1.0).unwrap().part(0).unwrap();
    assert_eq!(part.pose.translation, [1.0, 0.0, 4.0]);
    assert_eq!(part.mesh.positions()[1], [1.0, 0.0, 0.0]);
}

/// Faults of a file: the changed value, its new one, and the error.
const BROKEN: &[(&str, &str, &str)] = &[
    (
        "/nodes/1/skin",
        "7",
        "it refers to skin 7, which does not exist",
    ),
    (
        "/skins/0/joints",
        "[2, 9]",
        "it refers to node 9, which does not exist",
    ),
    (
        "/skins/0/joints",
        "[2]",
        "accessor 2: the skin has no such joint",
    ),
    (
        "/skins/0/joints",
        "[2, 3, 3]",
        "accessor 4: it has not a matrix for each joint",
    ),
    (
        "/accessors/4/type",
        r#""VEC4""#,
        "accessor 4: its elements are not matrices",
    ),
    (
        "/accessors/5/count",
        "1",
        "accessor 6: it has not a value for each time",
    ),
    (
        "/animations/0/samplers/0/input",
        "8",
        "accessor 8: its elements are not times",
    ),
    (
        "/animations/0/samplers/0/output",
        "8",
        "accessor 8: its elements are not rotations",
    ),
    (
        "/animations/0/samplers/0/interpolation",
        r#""CUBICSPLINE""#,
        "accessor 6: it has not a value for each time",
    ),
    (
        "/nodes/3/matrix",
        "[1,0,0,0, 0,1,0,0, 0,0,1,0, 1,0,0,1]",
        "node 3 is animated and has a matrix: save it with translation, rotation and scale",
    ),
    (
        "/meshes/0/primitives/0/attributes",
        r#"{"POSITION": 0}"#,
        "mesh 0: a primitive of a skinned node has no joints and weights",
    ),
];

#[test]
fn skins_that_cannot_be_posed_are_refused() {
    let unknown = skinned().refusal("run");
    let known = "there are: turn, slide, jump, animation 3";
    assert_eq!(unknown, format!("it has no animation `run`; {known}"));
    let none = File::new(r#"[{"mesh": 0}]"#).refusal("run");
    assert_eq!(none, "it has no animation `run`; there are none");
    for (pointer, new, message) in BROKEN {
        let refused = skinned().set(pointer, new).refusal("turn");
        assert_eq!(refused, *message, "{pointer}");
    }
}

#[test]
fn keys_weights_and_formats_that_cannot_be_are_refused() {
    let decreasing = skinned().with(&floats(&[2.0, 0.0]), 2, FLOAT, "SCALAR");
    let decreasing = decreasing.set("/animations/0/samplers/0/input", "10");
    assert_eq!(
        decreasing.refusal("turn"),
        "accessor 10: its times do not increase"
    );
    let negative = skinned().with(&floats(&[-1.0; 16]), 4, FLOAT, "VEC4");
    let negative = negative.set("/meshes/0/primitives/0/attributes/WEIGHTS_0", "10");
    assert_eq!(
        negative.refusal("turn"),
        "accessor 10: a weight is negative or not finite"
    );
    let obj = MeshFile::from_bytes("a.obj", b"v 0 0 0\nf 1 1 1\n".into(), &|_| unreachable!());
    let pose = AnimationTime {
        animation: None,
        time: 0.0,
    };
    let refused = obj.unwrap().parse_posed(&pose).unwrap_err();
    assert!(matches!(refused, LoadError::NoPoses));
}

/// Changed bytes give meshes or errors, never a panic.
#[test]
fn broken_skins_do_not_panic() {
    let file = skinned();
    let bytes = file.glb();
    let missing = |_: &str| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
    for at in 0..bytes.len() {
        for byte in [0, 0x7F, 0xFF, b'9', b'"'] {
            let mut broken = bytes.clone();
            broken[at] = byte;
            let Ok(file) = MeshFile::from_bytes("a.glb", broken, &missing) else {
                continue;
            };
            // Most are errors; those that are not are meshes, which are valid.
            let _ = file.parse_posed(&AnimationTime {
                animation: Some("turn"),
                time: 0.7,
            });
        }
    }
}
