//! The npm package (`integrations/web`): what its twin of [`AogridOccluder`] must give, and its own tests
//! in Node.js.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use aogrid_bake_core::models::Model;
use aogrid_bake_core::{Placement, Preset, UNOBSERVED};
use aogrid_grid_format::{Grid, Source};
use aogrid_runtime::{AogridOccluder, Instance};
use aogrid_tests::{Random, skip};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{Mat4, Quat, Vec3};
use serde_json::json;

/// The environment variable that makes the test write the file anew.
const UPDATE: &str = "AOGRID_UPDATE_WEB";

/// The number of random transforms.
const TRANSFORMS: usize = 100;

fn package() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../integrations/web")
}

/// Returns a grid of the frozen files of the format.
fn frozen(encoding: &str, format: &str) -> Grid {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../grid-format/tests/golden");
    let file = folder.join(format!("v1-{encoding}-{format}.ao.ktx2"));
    Grid::from_bytes(&fs::read(file).unwrap()).unwrap()
}

/// Returns a small grid of a table: with a flatness, a self offset and an origin, which frozen ones lack.
fn table() -> Grid {
    let mesh = Model::Table.mesh(None).unwrap();
    let placement = Placement {
        resolution: [8, 10, 12],
        ..Preset::Economy.placement()
    };
    let source = Source {
        name: "table.obj".into(),
        part: None,
        blake3: "0".repeat(64),
        triangles: mesh.triangles().len() as u64,
    };
    let options = Preset::Economy.options();
    let grid =
        aogrid_baker_cpu::bake_grid(&mesh, &placement, &options, source, UNOBSERVED).unwrap();
    assert_ne!(grid.record().flatness, [0.0; 4]);
    assert_ne!(grid.record().self_offset, 0.0);
    let spec = grid.spec().with_origin([7.25, -3.5, 1024.0]).unwrap();
    let cells: Vec<_> = (0..spec.cell_count()).map(|idx| grid.cell(idx)).collect();
    let record = grid.record().clone();
    Grid::encode(spec, grid.encoding(), grid.format(), &cells, record).unwrap()
}

/// Returns a random transform: a rotation, any scale, every third a mirror image.
fn transform(idx: usize, random: &mut Random) -> Mat4 {
    let mut next = || random.signed();
    let axis = Vec3::new(next(), next(), next()).normalize();
    let size = (3.0 * next()).exp();
    let stretch = Vec3::new(next(), next(), next()) * 0.5 + 1.0;
    let mirror = if idx.is_multiple_of(3) {
        Vec3::new(-1.0, 1.0, 1.0)
    } else {
        Vec3::ONE
    };
    let scale = if idx.is_multiple_of(2) {
        mirror * size
    } else {
        mirror * size * stretch
    };
    let rotation = Quat::from_axis_angle(axis, 3.0 * next());
    let position = Vec3::new(next(), next(), next()) * 20.0;
    Mat4::from_scale_rotation_translation(scale, rotation, position)
}

/// Returns the text of `test/fixtures/occluders.json`.
fn fixture() -> String {
    let mut random = Random::new(24);
    let table = table();
    let names = ["moment", "cone", "occlusion"];
    let mut cases = Vec::new();
    for idx in 0..TRANSFORMS {
        let m = transform(idx, &mut random);
        let encoding = names[idx % 3];
        let format = ["unorm8", "f16", "f32"][idx / 3 % 3];
        let of_table = idx % 2 == 1;
        let grid = if of_table {
            table.clone()
        } else {
            frozen(encoding, format)
        };
        let instance = Instance {
            strength: 0.5 + 0.5 * random.signed(),
            soft_cones: idx % 5 == 0,
            far_field: [None, Some(0.0), Some(0.02), Some(0.3)][idx % 4],
            object_id: idx as u32,
            layers: 1 << (idx % 32),
            excluded: [idx as u32, u32::MAX, 5, u32::MAX],
            ..Instance::at(m.to_cols_array_2d())
        };
        let occluder = AogridOccluder::new(&grid, &instance).unwrap();
        let file = format!("v1-{encoding}-{format}");
        cases.push(json!({
            "grid": if of_table { "table" } else { &file },
            "matrix": STANDARD.encode(bytemuck::bytes_of(&m.to_cols_array())),
            "strength": instance.strength,
            "softCones": instance.soft_cones,
            "farField": instance.far_field,
            "occluder": STANDARD.encode(bytemuck::bytes_of(&occluder)),
        }));
    }
    let lines: Vec<String> = cases.iter().map(|case| format!("    {case}")).collect();
    let table = STANDARD.encode(table.to_bytes());
    let made = format!("{UPDATE}=1 cargo test -p aogrid-tests --test suite web");
    format!(
        "{{\n  \"madeBy\": \"{made}\",\n  \"table\": \"{table}\",\n  \"cases\": [\n{}\n  ]\n}}\n",
        lines.join(",\n")
    )
}

/// The package's test compares its twin with this file; here it is compared with Rust.
#[test]
fn occluders_of_the_package_are_those_of_rust() {
    let file = package().join("test/fixtures/occluders.json");
    let expected = fixture();
    if std::env::var_os(UPDATE).is_some() {
        fs::write(&file, &expected).unwrap();
    }
    let committed = fs::read_to_string(&file).unwrap();
    let message = format!("{} is out of date: set {UPDATE}=1", file.display());
    assert!(committed == expected, "{message}");
}

/// The tests of the package that need neither a browser nor the compiled baker.
#[test]
fn the_package_passes_its_tests_in_node() {
    let required = std::env::var("AOGRID_NODE").as_deref() == Ok("require");
    let run = Command::new("node")
        .args(["ci.mjs", "--quick"])
        .current_dir(package())
        .output();
    let why = match run {
        Ok(output) if output.status.success() => return,
        // The script's status for packages that cannot be installed.
        Ok(output) if output.status.code() == Some(3) => {
            String::from_utf8_lossy(&output.stderr).into_owned()
        }
        Ok(output) => panic!(
            "{}{}",
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        ),
        Err(error) => format!("node cannot be started: {error}"),
    };
    assert!(!required, "{why}");
    skip(&format!("{why} (AOGRID_NODE)"));
}
