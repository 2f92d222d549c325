use std::fs;
use std::path::Path;
use std::time::SystemTime;

use aogrid_grid_format::{BoundaryMode, Encoding, Grid, Interior, TexelFormat};
use serde_json::Value;

use super::{ok, run, with_sample};

fn read(path: &Path) -> Grid {
    Grid::from_bytes(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn options_reach_the_grid() {
    let (folder, model) = with_sample("l-shape");
    let out = folder.path().join("l.ao.ktx2");
    ok(
        "bake {} -o {} --resolution 9x10x11 --half-extents 2,1.5,1 --face-size 8 --encoding \
         occlusion --format f16 --boundary rr --interior keep --sample-offset -0.1,0,0.25 \
         --max-distance 3",
        &[&model, &out],
    );
    let grid = read(&out);
    assert_eq!(grid.spec().resolution(), [9, 10, 11]);
    assert_eq!(grid.spec().half_extents(), [2.0, 1.5, 1.0]);
    assert_eq!(
        (grid.encoding(), grid.format()),
        (Encoding::Occlusion, TexelFormat::F16)
    );
    let record = grid.record();
    let as_json = serde_json::to_value(record).unwrap();
    assert_eq!(as_json["method"]["faces"]["size"], 8);
    assert_eq!(as_json["max_distance"], 3.0);
    assert_eq!(as_json["interior"], "keep");
    assert_eq!(as_json["epsilon"], Value::Null);
    assert_eq!(record.boundary.applied, BoundaryMode::Rr);
    assert_eq!(record.sample_offset, [-0.1, 0.0, 0.25]);
    assert_eq!(record.source.name, "l-shape.obj");
    let hash = blake3::hash(&fs::read(&model).unwrap()).to_hex();
    assert_eq!(record.source.blake3, hash.as_str());

    let rays = folder.path().join("rays.ao.ktx2");
    ok(
        "bake {} -o {} --resolution 8 --sampling monte-carlo --rays 32 --seed 9",
        &[&model, &rays],
    );
    let as_json = serde_json::to_value(read(&rays).record()).unwrap();
    assert_eq!(
        as_json["method"]["rays"],
        serde_json::json!({"count": 32, "seed": 9})
    );
}

#[test]
fn old_option_names_are_aliases() {
    let (folder, model) = with_sample("box");
    let out = folder.path().join("box.ao.ktx2");
    for (new, old) in [
        ("--algorithm rays", "--kernel rays"),
        ("--algorithm sweep", "--kernel sweep"),
        ("--sampling faces", "--method faces"),
        ("--sampling monte-carlo", "--method rays"),
    ] {
        let json = |options: &str| -> Value {
            let line = format!("bake {{}} -o {{}} --resolution 8 --force --json {options}");
            serde_json::from_str(&ok(&line, &[&model, &out])).unwrap()
        };
        let [new, old] = [new, old].map(|options| {
            let output = json(options)["outputs"][0].clone();
            (output["grid"].clone(), output["kernel"].clone())
        });
        assert_eq!(new, old);
    }
}

#[test]
fn threads_do_not_change_a_byte() {
    let (folder, model) = with_sample("space-ship");
    let bake = |threads: &str| {
        let out = folder.path().join(format!("{threads}.ao.ktx2"));
        ok(
            &format!("bake {{}} -o {{}} --resolution 12 --threads {threads}"),
            &[&model, &out],
        );
        fs::read(out).unwrap()
    };
    let one = bake("1");
    assert_eq!(one, bake("2"));
    assert_eq!(one, bake("5"));
}

/// Returns the state that `bake --json` reports.
fn state(line: &str, paths: &[&Path]) -> String {
    let report: Value = serde_json::from_str(&ok(line, paths)).unwrap();
    let outputs = report["outputs"].as_array().unwrap();
    assert_eq!(outputs.len(), 1);
    outputs[0]["state"].as_str().unwrap().to_owned()
}

#[test]
fn up_to_date_outputs_are_not_baked_again() {
    let (folder, model) = with_sample("box");
    let out = folder.path().join("box.ao.ktx2");
    let line = "bake {} -o {} --resolution 8 --json";
    let modified = || -> SystemTime { fs::metadata(&out).unwrap().modified().unwrap() };
    assert_eq!(state(line, &[&model, &out]), "baked");
    let first = modified();
    assert_eq!(state(line, &[&model, &out]), "up-to-date");
    assert_eq!(modified(), first);
    assert_eq!(state(&format!("{line} --force"), &[&model, &out]), "baked");
    // A change of any option or of the mesh, or a broken output, causes a new bake.
    for option in [
        "--epsilon 0.2",
        "--face-size 8",
        "--sampling monte-carlo",
        "--sampling monte-carlo --rays 99",
        "--sampling monte-carlo --seed 1",
        "--max-distance 1",
        "--encoding occlusion",
        "--format f32",
        "--boundary none",
        "--boundary rr",
        "--interior enclosed",
        "--interior keep",
        "--sample-offset 0,0,0",
        "--half-extents 2,2,2",
    ] {
        let changed = format!("{line} {option}");
        assert_eq!(state(&changed, &[&model, &out]), "baked", "{option}");
        assert_eq!(state(&changed, &[&model, &out]), "up-to-date", "{option}");
    }
    let line = "bake {} -o {} --resolution 9 --json";
    assert_eq!(state(line, &[&model, &out]), "baked");
    let obj = fs::read_to_string(&model).unwrap();
    fs::write(&model, format!("{obj}# touched\n")).unwrap();
    assert_eq!(state(line, &[&model, &out]), "baked");
    let bytes = fs::read(&out).unwrap();
    fs::write(&out, &bytes[..bytes.len() - 1]).unwrap();
    assert_eq!(state(line, &[&model, &out]), "baked");
    assert_eq!(fs::read(&out).unwrap(), bytes);
    let mut changed = bytes.clone();
    *changed.last_mut().unwrap() ^= 1;
    fs::write(&out, changed).unwrap();
    assert_eq!(state(line, &[&model, &out]), "baked");
    assert_eq!(fs::read(&out).unwrap(), bytes);
}

#[test]
fn each_part_gets_its_own_file() {
    let (folder, model) = with_sample("robot");
    let out = folder.path().join("parts");
    let line = "bake {} -o {} --parts --resolution 8 --face-size 8 --json";
    let report: Value = serde_json::from_str(&ok(line, &[&model, &out])).unwrap();
    let outputs = report["outputs"].as_array().unwrap();
    assert_eq!(outputs.len(), 11);
    // The scene that poses them is one more.
    assert_eq!(fs::read_dir(&out).unwrap().count(), 12);
    let head = read(&out.join("robot.head.ao.ktx2"));
    assert_eq!(head.record().source.part.as_deref(), Some("head"));
    let whole = read_whole(&folder.path().join("whole.ao.ktx2"), &model);
    assert!(head.spec().half_extents()[1] < whole.spec().half_extents()[1]);
    let again: Value = serde_json::from_str(&ok(line, &[&model, &out])).unwrap();
    let states = again["outputs"].as_array().unwrap().iter();
    assert!(states.into_iter().all(|o| o["state"] == "up-to-date"));
}

fn read_whole(out: &Path, model: &Path) -> Grid {
    ok("bake {} -o {} --resolution 8 --face-size 8", &[model, out]);
    read(out)
}

#[test]
fn part_names_that_clash_as_files_get_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("m.obj");
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let parts = "o a/b\nf 1 2 3\no a:b\nf 1 2 4\no A.B\nf 1 3 4\n";
    fs::write(&model, format!("{corners}{parts}")).unwrap();
    ok(
        "bake {} -o {} --parts --resolution 8 --face-size 8",
        &[&model, &folder.path().join("out")],
    );
    let mut names: Vec<_> = fs::read_dir(folder.path().join("out"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(
        names,
        [
            "m.A_B~3.ao.ktx2",
            "m.a_b.ao.ktx2",
            "m.a_b~2.ao.ktx2",
            "m.toml"
        ]
    );
}

#[test]
fn several_models_go_into_a_folder() {
    let (folder, a) = with_sample("box");
    let b = folder.path().join("sphere.obj");
    ok("sample sphere -o {} --triangles 80", &[&b]);
    let out = folder.path().join("grids");
    ok("bake {} {} -o {} --resolution 8", &[&a, &b, &out]);
    assert!(out.join("box.ao.ktx2").is_file() && out.join("sphere.ao.ktx2").is_file());
}

#[test]
fn a_dry_run_writes_nothing() {
    let (folder, model) = with_sample("table");
    let out = folder.path().join("none.ao.ktx2");
    let report = ok("bake {} -o {} --dry-run --json", &[&model, &out]);
    let report: Value = serde_json::from_str(&report).unwrap();
    let output = &report["outputs"][0];
    assert_eq!(output["state"], "dry-run");
    assert!(output["seconds"].as_f64().unwrap() > 0.0);
    assert_eq!(output["mesh"]["triangles"], 60);
    assert_eq!(
        output["placement"]["resolution"],
        serde_json::json!([32, 32, 32])
    );
    assert!(!out.exists());
    let parts = folder.path().join("parts");
    ok("bake {} -o {} --dry-run --parts", &[&model, &parts]);
    assert!(!parts.exists());
}

/// Report `memory`: a grid too large for the memory is refused before any work.
#[cfg(target_os = "linux")]
#[test]
fn a_bake_that_needs_too_much_memory_is_refused_before_it_begins() {
    let (folder, model) = with_sample("box");
    let out = folder.path().join("a.ao.ktx2");
    let line = format!(
        "ulimit -v 900000; exec {} bake {} -o {} --resolution 256 --face-size 8 --backend cpu",
        env!("CARGO_BIN_EXE_xtask"),
        model.display(),
        out.display()
    );
    let output = std::process::Command::new("sh")
        .args(["-c", &line])
        .output()
        .unwrap();
    let error = super::one_line_error(&output, &line);
    assert!(
        error.contains("of memory") && error.contains("--resolution"),
        "{error}"
    );
    assert!(!out.exists());
    let error = super::fails(
        "bake {} -o {} --resolution 64 --max-memory 20M",
        &[&model, &out],
    );
    assert!(error.contains("--max-memory allows 20 MiB"), "{error}");
    let dry = ok(
        "bake {} -o {} --resolution 256 --fit off --dry-run --json",
        &[&model, &out],
    );
    let dry: Value = serde_json::from_str(&dry).unwrap();
    // 256³ cells of some 70 bytes; it takes 1.0 GB.
    let bytes = dry["outputs"][0]["memory_bytes"].as_u64().unwrap();
    assert!((1_000_000_000..1_500_000_000).contains(&bytes), "{bytes}");
}

#[test]
fn json_is_alone_on_stdout_and_quiet_prints_nothing() {
    let (folder, model) = with_sample("box");
    let out = folder.path().join("a.ao.ktx2");
    let output = run(
        "bake {} -o {} --resolution 8 --json --quiet",
        &[&model, &out],
    );
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let output_json = &report["outputs"][0];
    assert_eq!(
        output_json["grid"]["resolution"],
        serde_json::json!([8, 8, 8])
    );
    assert!(output_json["times"]["visibility_s"].as_f64().unwrap() > 0.0);
    assert!(output.stderr.is_empty());
    let output = run("bake {} -o {} --resolution 9 --quiet", &[&model, &out]);
    assert!(output.stdout.is_empty() && output.stderr.is_empty());
}

#[test]
fn a_fallback_from_jgt_to_rr_is_a_warning() {
    let (folder, model) = with_sample("box");
    let out = folder.path().join("tight.ao.ktx2");
    let output = run(
        "bake {} -o {} --preset paper --resolution 8 --half-extents 0.75,0.75,0.75",
        &[&model, &out],
    );
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    assert!(
        stderr.contains("warning: ") && stderr.contains("`rr` was used"),
        "{stderr}"
    );
    let boundary = read(&out).record().boundary;
    assert_eq!(
        (boundary.requested, boundary.applied),
        (BoundaryMode::Jgt, BoundaryMode::Rr)
    );
}

/// Writes `model` again without its last triangle.
fn make_a_hole(model: &Path) {
    let obj = fs::read_to_string(model).unwrap();
    let (rest, _last) = obj.trim_end().rsplit_once('\n').unwrap();
    fs::write(model, rest).unwrap();
}

#[test]
fn holes_warn_only_with_interior_enclosed() {
    let (folder, model) = with_sample("sphere");
    let out = folder.path().join("sphere.ao.ktx2");
    let stderr = |interior: &str| {
        let line = format!(
            "bake {{}} -o {{}} --preset paper --resolution 16 --force --interior {interior}"
        );
        String::from_utf8(run(&line, &[&model, &out]).stderr).unwrap()
    };
    assert!(!stderr("signed").contains("warning"));
    let closed = read(&out);
    assert!(!stderr("enclosed").contains("warning"));
    assert_eq!(read(&out).texels(), closed.texels());
    assert_eq!(closed.record().inside, None);
    make_a_hole(&model);
    assert!(!stderr("signed").contains("warning"));
    let open = read(&out);
    let (record, inside) = (open.record(), open.record().inside.unwrap());
    assert_eq!(record.interior, Interior::Signed);
    assert_eq!(record.interior_cells, closed.record().interior_cells);
    assert!(inside.doubt < 0.1 && inside.inward_cells == 0, "{inside:?}");
    // `fill` is the old name of `enclosed`.
    for interior in ["enclosed", "fill"] {
        let enclosed = stderr(interior);
        assert!(
            enclosed.contains("warning: ") && enclosed.contains("it has holes"),
            "{enclosed}"
        );
        assert_eq!(read(&out).record().interior, Interior::Enclosed);
    }
    assert!(!stderr("keep").contains("warning"));
}

#[test]
fn doubt_about_the_interior_is_warned_of_and_reported() {
    let (folder, model) = with_sample("sheet");
    let out = folder.path().join("sheet.ao.ktx2");
    // Half a cell away, its own side is all that a sheet sees.
    let output = run("bake {} -o {} --resolution 16", &[&model, &out]);
    assert!(
        !String::from_utf8(output.stderr)
            .unwrap()
            .contains("warning")
    );
    assert!(ok("info {}", &[&out]).contains("looked up 0.5 cells along normals"));
    let output = run(
        "bake {} -o {} --resolution 16 --self-offset 0.25",
        &[&model, &out],
    );
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(
        stderr.contains("which side is inside is a guess"),
        "{stderr}"
    );
    assert!(stderr.contains("in doubt (doubt 1.00)"), "{stderr}");
    let info = ok("info {}", &[&out]);
    assert!(info.contains("in doubt (doubt 1.00)"), "{info}");
    let json: Value = serde_json::from_str(&ok("info {} --json", &[&out])).unwrap();
    assert_eq!(json["bake"]["interior"], "signed");
    assert_eq!(json["bake"]["inside"]["doubt"], 1.0);

    let (folder, model) = with_sample("room");
    let out = folder.path().join("room.ao.ktx2");
    ok("bake {} -o {}", &[&model, &out]);
    let info = ok("info {}", &[&out]);
    assert!(info.contains("see faces that point inward"), "{info}");
}
