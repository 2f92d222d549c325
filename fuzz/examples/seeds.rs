//! Writes seeds for all fuzz targets into `corpus`: small files of every kind, made by our own code.

use std::path::Path;
use std::{fs, io};

use aogrid_bake_core::models::{Model, to_obj};
use aogrid_bake_core::{BakeOptions, Placement, Preset, TriangleMesh, UNOBSERVED};
use aogrid_grid_format::{BoundaryMode, Encoding, Source, TexelFormat};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mesh = Model::Box.mesh(None)?;
    write("obj", "box", to_obj(&mesh).as_bytes())?;
    write("obj", "table", to_obj(&Model::Table.mesh(None)?).as_bytes())?;
    write("obj", "words", OBJ.as_bytes())?;
    write("ply", "ascii", ascii_ply(&mesh).as_bytes())?;
    write("ply", "binary", &binary_ply(&mesh))?;
    write("stl", "ascii", ascii_stl(&mesh).as_bytes())?;
    write("stl", "binary", &binary_stl(&mesh))?;
    write("gltf", "data", GLTF.as_bytes())?;
    write("gltf", "binary", &glb(GLTF.as_bytes()))?;
    for (name, grid) in grids(&mesh)? {
        write("ktx2", &name, &grid)?;
    }
    write("scene", "small", SCENE.as_bytes())?;
    for scene in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes"))? {
        let scene = scene?;
        if scene
            .path()
            .extension()
            .is_some_and(|ending| ending == "toml")
        {
            write(
                "scene",
                &scene.file_name().to_string_lossy(),
                &fs::read(scene.path())?,
            )?;
        }
    }
    for (name, header) in HDR {
        let texels: Vec<u8> = (0..32).flat_map(|n| [n, 200, 3 * n, 128]).collect();
        write("hdr", name, &[header.as_bytes(), &texels].concat())?;
    }
    for channels in [
        &["R", "G", "B"][..],
        &["Y"],
        &["view.R", "view.G", "view.B", "Z"],
    ] {
        let ramp = || (0..32).map(|n| n as f32 / 8.0);
        let list = channels
            .iter()
            .map(|name| aogrid_scene::channel(name, ramp()));
        write(
            "exr",
            &channels.concat(),
            &aogrid_scene::exr([8, 4], list.collect())?,
        )?;
    }
    Ok(())
}

fn write(target: &str, name: &str, bytes: &[u8]) -> io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("corpus")
        .join(target);
    fs::create_dir_all(&folder)?;
    fs::write(folder.join(name), bytes)
}

const OBJ: &str = "\u{FEFF}# a comment \\\nmtllib a.mtl\no Screw #6\nv 0 0 0 1\nv 1e0 0 -0\nv 0 1 .5\n\
    v 1 1 \\\n0\nvt 0 0\nvn 0 0 1\ng rim\ns 1\nusemtl oak\\\nf 1/1/1 2//1 4 3\ng hub rim\nf -1 -2 -3\nl 1 2\n";

const SCENE: &str = "up = 'z'\nambient = [0.1, 0.2, 0.3]\n[camera]\nposition = [2, 3, 4]\ntarget = [0, 0, 0]\n\
    resolution = [8, 6]\n[environment]\nroom = { right = [1, 1, 1], left = [1, 0, 0], ceiling = [1, 1, 1], \
    floor = [0, 0, 0], front = [0, 0, 1], back = [0, 1, 0] }\n[[material]]\nname = 'm'\nalbedo = [1, 0, 0]\n\
    [[mesh]]\nname = 'a'\nsample = 'box'\ngrid = { resolution = 8, preset = 'paper' }\n[[mesh]]\nname = 'f'\n\
    rectangle = [6, 6]\n[[instance]]\nmesh = 'a'\ntranslate = [0, 1, 0]\nrotate = { axis = [0, 1, 0], \
    degrees = 30 }\nscale = -2\nid = 7\nexcludes = [8]\n[[instance]]\nmesh = 'f'\nid = 8\ncasts = false\n";

/// A triangle in two nodes, one of them mirrored, as a strip with quantized positions.
const GLTF: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],
"extensionsUsed":["KHR_mesh_quantization"],"extensionsRequired":["KHR_mesh_quantization"],
"nodes":[{"mesh":0,"scale":[1,-1,2],"children":[2]},{"mesh":0,"rotation":[0,0.6,0,0.8]},
{"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,3,0,0,1],"mesh":0}],
"meshes":[{"name":"m","primitives":[{"attributes":{"POSITION":0},"indices":1,"mode":5}]}],
"buffers":[{"byteLength":28,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAKAAAAAAAAAAAKAAAAAAAAAAABAAIAAAA="}],
"bufferViews":[{"buffer":0,"byteLength":22,"byteStride":8},{"buffer":0,"byteOffset":20,"byteLength":8}],
"accessors":[{"bufferView":0,"componentType":5122,"count":3,"type":"VEC3","min":[0,0,0],"max":[10,10,10],
"sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0}}},
{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}]}"#;

const HDR: [(&str, &str); 3] = [
    ("plain", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n"),
    (
        "exposure",
        "#?x\nEXPOSURE=2\nCOLORCORR=1 2 3\nFORMAT=32-bit_rle_rgbe\n\n+X 8 -Y 4\n",
    ),
    ("xyze", "#?RGBE\nFORMAT=32-bit_rle_xyze\n\n-Y 4 +X 8\n"),
];

fn glb(json: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let words = |words: &[u32]| -> Vec<u8> { words.iter().flat_map(|w| w.to_le_bytes()).collect() };
    let length = json.len() as u32;
    let head = words(&[u32::from_le_bytes(*b"glTF"), 2, length + 28, length]);
    let chunk = words(&[8, u32::from_le_bytes(*b"BIN\0"), 0, 0]);
    [&head, &b"JSON"[..], &json, &chunk].concat()
}

fn ascii_ply(mesh: &TriangleMesh) -> String {
    let mut text = ply_header(mesh, "ascii");
    for [x, y, z] in mesh.positions() {
        text += &format!("{x} {y} {z}\n");
    }
    for [a, b, c] in mesh.triangles() {
        text += &format!("3 {a} {b} {c}\n");
    }
    text
}

fn binary_ply(mesh: &TriangleMesh) -> Vec<u8> {
    let mut bytes = ply_header(mesh, "binary_little_endian").into_bytes();
    bytes.extend(
        mesh.positions()
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes()),
    );
    for triangle in mesh.triangles() {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|idx| idx.to_le_bytes()));
    }
    bytes
}

fn ply_header(mesh: &TriangleMesh, format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment made by aogrid\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nelement face {}\n\
         property list uchar uint vertex_indices\nend_header\n",
        mesh.positions().len(),
        mesh.triangles().len()
    )
}

fn corners(mesh: &TriangleMesh) -> impl Iterator<Item = [[f32; 3]; 3]> {
    let at = |idx: u32| mesh.positions()[idx as usize];
    mesh.triangles()
        .iter()
        .map(move |triangle| triangle.map(at))
}

fn ascii_stl(mesh: &TriangleMesh) -> String {
    let facets = corners(mesh).map(|corners| {
        let corners = corners
            .map(|[x, y, z]| format!("vertex {x} {y} {z}\n"))
            .concat();
        format!("facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
    });
    format!("solid box\n{}endsolid box\n", facets.collect::<String>())
}

fn binary_stl(mesh: &TriangleMesh) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((mesh.triangles().len() as u32).to_le_bytes());
    for corners in corners(mesh) {
        bytes.extend([0; 12]);
        bytes.extend(corners.iter().flatten().flat_map(|v| v.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// Returns a small grid of each encoding and format.
fn grids(mesh: &TriangleMesh) -> Result<Vec<(String, Vec<u8>)>, Box<dyn std::error::Error>> {
    let mut grids = vec![];
    for encoding in Encoding::ALL {
        for format in TexelFormat::ALL {
            let placement = Placement {
                resolution: [8, 9, 10],
                ..Placement::paper()
            };
            let options = BakeOptions {
                encoding,
                format,
                boundary: BoundaryMode::None,
                ..Preset::Paper.options()
            };
            let source = Source {
                name: "box.obj".into(),
                part: Some("a part".into()),
                blake3: "0".repeat(64),
                triangles: mesh.triangles().len() as u64,
            };
            let grid = aogrid_baker_cpu::bake_grid(mesh, &placement, &options, source, UNOBSERVED)?;
            grids.push((
                format!("{}-{}", encoding.name(), format.name()),
                grid.to_bytes(),
            ));
        }
    }
    Ok(grids)
}
