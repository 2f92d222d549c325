use std::fs;
use std::path::{Path, PathBuf};

use aogrid_grid_format::Grid;
use serde_json::Value;
use tempfile::TempDir;

use super::{ok, run};

/// The corners of a box of half-extents 0.5 × 0.125 × 0.25, and its faces.
const BOX: &str = "v -0.5 -0.125 -0.25\nv 0.5 -0.125 -0.25\nv 0.5 0.125 -0.25\n\
    v -0.5 0.125 -0.25\nv -0.5 -0.125 0.25\nv 0.5 -0.125 0.25\nv 0.5 0.125 0.25\n\
    v -0.5 0.125 0.25\n";
const FACES: &str =
    "f -8 -5 -6 -7\nf -4 -3 -2 -1\nf -8 -7 -3 -4\nf -5 -1 -2 -6\nf -8 -4 -1 -5\nf -7 -6 -2 -3\n";

/// Writes a file into a temporary folder.
pub(super) fn with_file(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    (folder, path)
}

/// Returns a glTF file with the box once as mesh and as these nodes, all in the scene.
pub(super) fn gltf(nodes: &Value) -> Vec<u8> {
    let numbers = |line: &str| -> Vec<f32> {
        let words = line.split_whitespace().skip(1);
        words.map(|word| word.parse().unwrap()).collect()
    };
    let positions: Vec<f32> = BOX.lines().flat_map(numbers).collect();
    let corner = |v: f32| (v as i32 + 8) as u8;
    let triangles = FACES.lines().flat_map(|line| {
        let f = numbers(line);
        [f[0], f[1], f[2], f[0], f[2], f[3]].map(corner)
    });
    let mut buffer: Vec<u8> = positions.iter().flat_map(|v| v.to_le_bytes()).collect();
    buffer.extend(triangles);
    let roots: Vec<usize> = (0..nodes.as_array().unwrap().len()).collect();
    let json = serde_json::json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": roots}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3",
             "min": [-0.5, -0.125, -0.25], "max": [0.5, 0.125, 0.25]},
            {"bufferView": 1, "componentType": 5121, "count": 36, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 36}],
        "buffers": [{"byteLength": 132}]
    });
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((28 + json.len() as u32 + 132).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &buffer)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    file
}

fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Parts that share a mesh share a grid, and the scene poses both as the model does: rendered, it
/// shows what the whole model shows.
#[test]
fn shared_parts_are_baked_once_and_posed_by_the_scene() {
    let s = std::f64::consts::FRAC_1_SQRT_2;
    let nodes = serde_json::json!([
        {"name": "plank #1", "mesh": 0, "translation": [0.0, 0.5, 0.0]},
        {"name": "plank #2", "mesh": 0, "rotation": [0.0, 0.0, s, s], "scale": [-0.5, 0.5, 0.5],
         "translation": [0.75, 0.25, 0.0]},
    ]);
    let (folder, model) = with_file("planks.glb", &gltf(&nodes));
    let out = folder.path().join("parts");
    ok(
        "bake {} -o {} --parts --resolution 24 --epsilon 0.05 --boundary none",
        &[&model, &out],
    );
    assert_eq!(names_in(&out), ["planks.plank__1.ao.ktx2", "planks.toml"]);
    let grid = Grid::from_bytes(&fs::read(out.join("planks.plank__1.ao.ktx2")).unwrap()).unwrap();
    // In the part's own frame.
    assert_eq!(grid.spec().center(), [0.0; 3]);

    let scene = out.join("planks.toml");
    let posed = fs::read_to_string(&scene).unwrap();
    let receivers = "\n[receivers]\ncorner = [-1, 0, -1]\nu = [0, 0, 2]\nv = [2, 0, 0]\n\
        count = [5, 5]\n[truth]\nsamples = 64\n";
    fs::write(&scene, format!("{posed}{receivers}")).unwrap();
    let whole = out.join("whole.toml");
    let mesh = "[[mesh]]\nname = 'm'\nfile = '../planks.glb'\n[[instance]]\nmesh = 'm'\n";
    fs::write(&whole, format!("{mesh}{receivers}")).unwrap();
    let [a, b] = ["a.csv", "b.csv"].map(|name| out.join(name));
    ok("render {} --mode truth,cone -o {}", &[&scene, &a]);
    ok("render {} --mode truth -o {}", &[&whole, &b]);
    let column = |path: &Path, name: &str| -> Vec<f64> {
        let text = fs::read_to_string(path).unwrap();
        let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let idx = lines
            .next()
            .unwrap()
            .iter()
            .position(|c| *c == name)
            .unwrap();
        lines.map(|row| row[idx].parse().unwrap()).collect()
    };
    let rms = |a: &[f64], b: &[f64]| {
        let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
        (squares / a.len() as f64).sqrt()
    };
    let (posed, whole) = (column(&a, "truth"), column(&b, "truth"));
    assert!(posed.iter().any(|v| *v > 0.3));
    // The same rays meet the same triangles, but for rounding.
    assert!(rms(&posed, &whole) < 1e-3, "{posed:?} {whole:?}");
    // Grids of two boxes, multiplied and faded out at their boundaries: a wrong pose errs by more.
    let cone = column(&a, "cone");
    assert!(rms(&cone, &whole) < 0.15, "{cone:?} {whole:?}");
}

#[test]
fn a_scene_says_what_of_its_models_is_not_read() {
    let (folder, _) = with_file("m.obj", format!("{BOX}{FACES}surf 0 1\n").as_bytes());
    let scene = folder.path().join("a.toml");
    let text = "[[mesh]]\nname = 'm'\nfile = 'm.obj'\n[[instance]]\nmesh = 'm'\n[receivers]\n\
        corner = [-1, -1, -1]\nu = [0, 0, 2]\nv = [2, 0, 0]\ncount = [1, 1]\n[truth]\nsamples = 2\n";
    fs::write(&scene, text).unwrap();
    let output = run(
        "render {} --mode truth -o {}",
        &[&scene, &folder.path().join("a.csv")],
    );
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(
        stderr.contains("mesh `m`: 1 lines are left out"),
        "{stderr}"
    );
}

/// Report 31: a part of one point does not keep the others from being baked.
#[test]
fn a_part_that_fails_is_named_and_the_rest_is_baked() {
    let text = format!("v 3 3 3\nv 3 3 3\nv 3 3 3\no a\nf 1 2 3\no b\n{BOX}{FACES}");
    let (folder, model) = with_file("m.obj", text.as_bytes());
    let out = folder.path().join("out");
    let line = "bake {} -o {} --parts --resolution 8 --json";
    let output = run(line, &[&model, &out]);
    assert_eq!(output.status.code(), Some(1));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(stderr.contains("m.obj (a): it has no area"), "{stderr}");
    assert!(stderr.contains("1 of 2 failed"), "{stderr}");
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let states: Vec<_> = report["outputs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|o| &o["state"])
        .collect();
    assert_eq!(states, ["failed", "baked"]);
    assert_eq!(names_in(&out), ["m.b.ao.ktx2", "m.toml"]);
}

/// Report 31: several models, one of them broken, in either order.
#[test]
fn a_model_that_fails_is_named_and_the_rest_is_baked() {
    let (folder, sound) = with_file("sound.obj", format!("{BOX}{FACES}").as_bytes());
    let broken = folder.path().join("broken.obj");
    fs::write(&broken, "v 0 0 0\nf 1 2 3\n").unwrap();
    for order in [[&broken, &sound], [&sound, &broken]] {
        let out = tempfile::tempdir().unwrap();
        let paths = [order[0].as_path(), order[1], out.path()];
        let output = run("bake {} {} -o {} --resolution 8 --json", &paths);
        assert_eq!(output.status.code(), Some(1));
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        let outputs = report["outputs"].as_array().unwrap();
        let failed = outputs.iter().find(|o| o["state"] == "failed").unwrap();
        assert!(
            failed["failure"]["error"]
                .as_str()
                .unwrap()
                .contains("line 2")
        );
        assert!(outputs.iter().any(|o| o["state"] == "baked"));
        assert_eq!(names_in(out.path()), ["sound.ao.ktx2"]);
    }
    let out = tempfile::tempdir().unwrap();
    let paths = [broken.as_path(), &sound, out.path()];
    let output = run("bake {} {} -o {} --resolution 8 --fail-fast", &paths);
    assert_eq!(output.status.code(), Some(1));
    assert!(names_in(out.path()).is_empty());
}

/// The union of shards is what one run makes, byte for byte.
#[test]
fn shards_of_a_folder_make_what_one_run_makes() {
    let folder = tempfile::tempdir().unwrap();
    let models = folder.path().join("models");
    fs::create_dir(&models).unwrap();
    for (idx, name) in ["a.obj", "b.obj", "c.OBJ", "d.obj"].iter().enumerate() {
        let taller = BOX.replace("0.125", &format!("0.{}", 125 + 50 * idx));
        fs::write(models.join(name), taller + FACES).unwrap();
    }
    fs::write(models.join("notes.txt"), "not a model").unwrap();
    let list = ok("bake {} -o x --list --items 2-3", &[&models]);
    let shown: Vec<_> = list
        .lines()
        .map(|line| line.rsplit('/').next().unwrap())
        .collect();
    assert_eq!(shown, ["b.obj", "c.OBJ"]);
    assert!(list.starts_with("2 "), "{list}");
    let out = |name: &str| folder.path().join(name);
    ok("bake {} -o {} --resolution 8", &[&models, &out("whole")]);
    for shard in ["1/3", "2/3", "3/3"] {
        let line = format!("bake {{}} -o {{}} --resolution 8 --shard {shard}");
        ok(&line, &[&models, &out("shards")]);
    }
    let names = names_in(&out("whole"));
    assert_eq!(names.len(), 4);
    assert_eq!(names_in(&out("shards")), names);
    for name in names {
        let read = |folder: &str| fs::read(out(folder).join(&name)).unwrap();
        assert!(read("whole") == read("shards"), "{name}");
    }
    let pattern = models.join("e*.obj");
    assert!(super::fails("bake {} -o {}", &[&pattern, &out("x")]).contains("no file matches"));
    let pattern = models.join("?.obj");
    let list = ok("bake {} -o x --list", &[&pattern]);
    assert_eq!(list.lines().count(), 3);
    assert!(super::fails("bake {} -o x --items 5", &[&models]).contains("there are 4"));
}

/// Report 02: the model at map coordinates has the grid that it has at the origin.
#[test]
fn a_model_at_map_coordinates_has_the_grid_that_it_has_at_the_origin() {
    let at = |offset: [f64; 3]| {
        let corners = BOX.lines().map(|line| {
            let numbers = line.split_whitespace().skip(1).zip(offset);
            let moved = numbers.map(|(v, offset)| v.parse::<f64>().unwrap() + offset);
            moved.fold("v".to_owned(), |line, v| format!("{line} {v}")) + "\n"
        });
        let text = corners.collect::<String>() + FACES;
        let (folder, model) = with_file("m.obj", text.as_bytes());
        let out = folder.path().join("m.ao.ktx2");
        ok("bake {} -o {} --resolution 16", &[&model, &out]);
        let info = ok("info {}", &[&out]);
        (Grid::from_bytes(&fs::read(out).unwrap()).unwrap(), info)
    };
    let offset = [500_000.0, 4_500_000.0, 312.5];
    let ((near, _), (far, info)) = (at([0.0; 3]), at(offset));
    assert_eq!(near.spec().half_extents(), far.spec().half_extents());
    assert_eq!(far.spec().origin(), offset);
    assert!(near.texels() == far.texels());
    assert!(
        info.contains("relative to (500000, 4500000, 312.5)"),
        "{info}"
    );
}
