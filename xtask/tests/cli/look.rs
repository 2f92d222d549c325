use std::fs;
use std::path::{Path, PathBuf};

use aogrid_grid_format::{BoundaryMode, Encoding, Grid};
use serde_json::Value;
use tempfile::TempDir;

use super::{fails, ok, run, with_sample};

fn baked(options: &str) -> (TempDir, PathBuf) {
    let (folder, model) = with_sample("table");
    let out = folder.path().join("table.ao.ktx2");
    ok(
        &format!("bake {{}} -o {{}} --resolution 9x10x11 {options}"),
        &[&model, &out],
    );
    (folder, out)
}

#[test]
fn info_reports_what_the_file_records() {
    let (_folder, grid) = baked("--epsilon 0.2");
    let json: Value = serde_json::from_str(&ok("info {} --json", &[&grid])).unwrap();
    assert_eq!(json["resolution"], serde_json::json!([9, 10, 11]));
    assert_eq!(json["encoding"], "moment");
    assert_eq!(json["bake"]["source"]["triangles"], 60);
    let text = ok("info {}", &[&grid]);
    for fact in [
        "9×10×11 cells",
        "epsilon 0.2",
        "table.obj",
        "60 triangles",
        "V_M",
    ] {
        assert!(text.contains(fact), "{fact} is not in {text}");
    }
    let model = grid.with_file_name("table.obj");
    let json: Value = serde_json::from_str(&ok("info {} --json", &[&model])).unwrap();
    assert_eq!((&json["parts"], &json["closed"]), (&5.into(), &true.into()));
    assert!(ok("info {}", &[&model]).contains("closed"));
}

#[test]
fn verify_finds_errors_that_readers_do_not() {
    let (folder, grid) = baked("");
    assert!(ok("verify {}", &[&grid]).contains("ok"));
    assert_eq!(ok("verify {}", &[folder.path()]).lines().count(), 1);
    let empty = tempfile::tempdir().unwrap();
    assert!(fails("verify {}", &[empty.path()]).contains("no grids"));
    let bytes = fs::read(&grid).unwrap();
    let damaged = |name: &str, at: usize, value: u8| {
        let path = folder.path().join(name);
        let mut bytes = bytes.clone();
        bytes[at] = value;
        fs::write(&path, bytes).unwrap();
        let output = run("verify {} {}", &[&grid, &path]);
        assert_eq!(output.status.code(), Some(1));
        let stdout = String::from_utf8(output.stdout).unwrap();
        assert_eq!(stdout.lines().count(), 1, "{stdout}");
        String::from_utf8(output.stderr).unwrap()
    };
    let last = bytes.len() - 1;
    assert!(damaged("changed.ao.ktx2", last, 200).contains("changed after the bake"));
    // Two cells that change places, which no sum tells.
    let mut swapped = bytes.clone();
    let texels = bytes.len() - 9 * 10 * 11 * 4;
    let middle = texels + ((5 * 10 + 6) * 9 + 4) * 4;
    assert_ne!(bytes[middle..middle + 4], bytes[texels..texels + 4]);
    (0..4).for_each(|byte| swapped.swap(texels + byte, middle + byte));
    let path = folder.path().join("swapped.ao.ktx2");
    fs::write(&path, swapped).unwrap();
    assert!(fails("verify {}", &[&path]).contains("changed after the bake"));
    // A baker's own fault: axes that are far too short.
    let read = Grid::from_bytes(&bytes).unwrap();
    let cells = vec![[0.1, 0.0, 0.0, 0.5]; read.spec().cell_count()];
    let mut record = read.record().clone();
    record.boundary.applied = BoundaryMode::None;
    let short = Grid::encode(*read.spec(), Encoding::Cone, read.format(), &cells, record).unwrap();
    let path = folder.path().join("short.ao.ktx2");
    fs::write(&path, short.to_bytes()).unwrap();
    assert!(
        String::from_utf8(run("verify {}", &[&path]).stderr)
            .unwrap()
            .contains("axis of cell")
    );
    let gone = fails("verify {}", &[Path::new("gone.ao.ktx2")]);
    assert!(gone.contains("gone.ao.ktx2"), "{gone}");
}

#[test]
fn diff_measures_differences() {
    let (folder, grid) = baked("");
    let json = |a: &Path, b: &Path, options: &str, status: i32| -> Value {
        let output = run(&format!("diff {{}} {{}} --json {options}"), &[a, b]);
        assert_eq!(output.status.code(), Some(status), "{options}");
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let same = json(&grid, &grid, "", 0);
    assert_eq!(
        (&same["equal"], &same["differing_cells"]),
        (&true.into(), &0.into())
    );
    let other = folder.path().join("other.ao.ktx2");
    let model = folder.path().join("table.obj");
    ok(
        "bake {} -o {} --resolution 9x10x11 --sampling monte-carlo",
        &[&model, &other],
    );
    let different = json(&grid, &other, "", 1);
    json(&grid, &other, "--tolerance 0.001", 1);
    json(&grid, &other, "--tolerance 1", 0);
    assert_eq!(different["equal"], false);
    assert_eq!(different["same_box"], true);
    assert!(different["occlusion_max"].as_f64().unwrap() > 0.005);
    assert!(different["axis_rms_degrees"].as_f64().unwrap() > 0.5);
    let output = run("diff {} {}", &[&grid, &other]);
    assert!(String::from_utf8(output.stdout).unwrap().contains("rms"));
    assert!(String::from_utf8(output.stderr).unwrap().contains("differ"));
    // The same texels in another box.
    let moved = folder.path().join("moved.ao.ktx2");
    let read = Grid::from_bytes(&fs::read(&grid).unwrap()).unwrap();
    let spec = read.spec().with_origin([0.0, 1.0, 0.0]).unwrap();
    let cells: Vec<_> = (0..spec.cell_count()).map(|idx| read.cell(idx)).collect();
    let format = read.format();
    let far = Grid::encode(spec, read.encoding(), format, &cells, read.record().clone()).unwrap();
    fs::write(&moved, far.to_bytes()).unwrap();
    let apart = json(&grid, &moved, "--tolerance 0.3", 1);
    let expected = 1.0 / spec.cell_size()[1];
    assert!((apart["box_max_cells"].as_f64().unwrap() - expected).abs() < 1e-9);
    ok("bake {} -o {} --resolution 8", &[&model, &other]);
    assert!(fails("diff {} {}", &[&grid, &other]).contains("[9, 10, 11]"));
}

#[test]
fn slices_outline_the_model() {
    let (folder, grid) = baked("--boundary none");
    let png = folder.path().join("table.png");
    ok("slices {} -o {}", &[&grid, &png]);
    let picture = image::open(&png).unwrap().into_rgb8();
    let orange = picture.pixels().filter(|p| p.0 == OUTLINE).count();
    assert!(orange > 300, "no outline: {orange}");
    // Without the model the outline is missing and the rest of the picture is the same.
    fs::rename(
        folder.path().join("table.obj"),
        folder.path().join("moved.obj"),
    )
    .unwrap();
    let bare = folder.path().join("bare.png");
    ok("slices {} -o {}", &[&grid, &bare]);
    let bare = image::open(&bare).unwrap().into_rgb8();
    assert_eq!(bare.dimensions(), picture.dimensions());
    assert!(bare.pixels().all(|p| p.0 != OUTLINE));
    let dark = |p: &image::Rgb<u8>| p.0[0] == p.0[1] && p.0[1] == p.0[2] && p.0[0] < 140;
    assert!(bare.pixels().filter(|p| dark(p)).count() > 100);
    let named = folder.path().join("named.png");
    let moved = folder.path().join("moved.obj");
    ok("slices {} -o {} --mesh {}", &[&grid, &named, &moved]);
    assert_eq!(image::open(&named).unwrap().into_rgb8(), picture);
}

/// Colors of the outline and the marks, which nothing else in a picture has.
const OUTLINE: [u8; 3] = [255, 96, 0];
const INTERIOR: [u8; 3] = [0, 140, 255];
const DOUBTFUL: [u8; 3] = [225, 40, 190];

#[test]
fn slices_mark_interior_and_doubtful_cells() {
    let marks = |sample: &str| {
        let (folder, model) = with_sample(sample);
        let [grid, png] = ["a.ao.ktx2", "a.png"].map(|name| folder.path().join(name));
        ok("bake {} -o {} --resolution 16", &[&model, &grid]);
        ok("slices {} -o {}", &[&grid, &png]);
        let picture = image::open(&png).unwrap().into_rgb8();
        let count = |color| picture.pixels().filter(|p| p.0 == color).count();
        let of_read = Grid::from_bytes(&fs::read(&grid).unwrap()).unwrap();
        let cells = of_read.record().interior_cells as usize;
        (cells, count(INTERIOR), count(DOUBTFUL))
    };
    // A model without marked cells shows the count in the legend alone.
    let (_, _, legend) = marks("box");
    let (cells, interior, doubtful) = marks("house");
    assert!(cells > 100 && interior > 3 * cells, "{cells}: {interior}");
    assert!(doubtful > legend);
    let (cells, _, doubtful) = marks("bowl");
    assert!(
        doubtful > 3 * cells + legend,
        "{cells}: {doubtful}, {legend}"
    );
}

#[test]
fn npy_holds_the_decoded_values_in_numpy_order() {
    let (folder, grid) = baked("--format f32 --encoding occlusion");
    let npy = folder.path().join("a.npy");
    ok("export {} --to npy -o {}", &[&grid, &npy]);
    let bytes = fs::read(&npy).unwrap();
    let file = npyz::NpyFile::new(&bytes[..]).unwrap();
    assert_eq!(file.shape(), [11, 10, 9, 1]);
    let values: Vec<f32> = file.into_vec().unwrap();
    let read = Grid::from_bytes(&fs::read(&grid).unwrap()).unwrap();
    assert_eq!(values, read.decode());
}

#[test]
fn bench_reports_every_stage() {
    let (_folder, model) = with_sample("box");
    let line = "bench {} --resolution 8 --face-size 8 --repeat 2 --threads 2 --json";
    let json: Value = serde_json::from_str(&ok(line, &[&model])).unwrap();
    let model = &json["models"][0];
    assert_eq!(model["triangles"], 12);
    let row = &model["rows"][0];
    assert_eq!(
        (&row["sampling"], &row["backend"]),
        (&"faces".into(), &"cpu".into())
    );
    assert!(["sweep", "rays"].contains(&row["algorithm"].as_str().unwrap()));
    assert_eq!(row["threads"], 2);
    for stage in ["prepare_s", "visibility_s", "post_s"] {
        assert!(row[stage].as_f64().unwrap() > 0.0, "{stage}");
    }
}

#[test]
fn samples_are_refined_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let obj = folder.path().join("t.obj");
    ok("sample torus -o {} --triangles 3001", &[&obj]);
    let text = fs::read_to_string(&obj).unwrap();
    assert_eq!(text.lines().filter(|l| l.starts_with("f ")).count(), 3002);
    assert!(fails("sample torus -o {} --triangles 3 --force", &[&obj]).contains("at least"));
    assert_eq!(run("sample pyramid -o {}", &[&obj]).status.code(), Some(2));
}

#[test]
fn preview_draws_a_model_and_reports_its_error() {
    let (folder, model) = with_sample("table");
    let picture = folder.path().join("table.png");
    let command = "preview {} -o {} --preset economy --error 0.1 --json";
    let json: Value = serde_json::from_str(&ok(command, &[&model, &picture])).unwrap();
    assert_eq!(json["resolution"], serde_json::json!([16, 16, 16]));
    assert_eq!(json["bytes"], 16 << 10);
    // The truth has errors of 0.1 here; a grid that shades nothing is off by more.
    let all = &json["errors"]["all"];
    assert!(all["rmse"].as_f64().unwrap() < 0.15, "{all}");
    let picture = image::open(&picture).unwrap().to_rgb8();
    assert!(picture.width() > 3 * 420 && picture.height() > 2 * 315);
    // The second picture: six slices with the model's outline, the longer side 400 pixels.
    let slices = folder.path().join("table-grid.png");
    let slices = image::open(&slices).unwrap().to_rgb8();
    assert!(slices.width() > 3 * 400 && slices.height() > 2 * 300);
    assert!(slices.pixels().filter(|p| p.0 == OUTLINE).count() > 500);
    let again = fails(command, &[&model, &folder.path().join("table.png")]);
    assert!(again.contains("--force"), "{again}");
    let ending = run("preview {} -o x.gif", &[&model]);
    assert_eq!(ending.status.code(), Some(2));
    let missing = fails("preview {} -o x.png", &[&folder.path().join("none.obj")]);
    assert!(missing.contains("none.obj"), "{missing}");
    let part = fails("preview {} -o x.png --without Lid", &[&model]);
    assert!(part.contains("no such part"), "{part}");
}

#[test]
fn slices_across_each_axis_show_every_layer_or_say_which() {
    let (folder, grid) = baked("--boundary none");
    // 9 cells along x, 10 along y, 11 along z: the slices across z need a second row.
    let heights = ["x", "y", "z"].map(|axis| {
        let png = folder.path().join(format!("{axis}.png"));
        ok(
            &format!("slices {{}} -o {{}} --axis {axis}"),
            &[&grid, &png],
        );
        let picture = image::open(&png).unwrap().into_rgb8();
        let outline = picture.pixels().filter(|p| p.0 == OUTLINE).count();
        (outline, picture)
    });
    let [(x, across_x), (y, _), (z, across_z)] = heights;
    assert!(x > 300 && y > 300 && z > 300, "{x}, {y}, {z}");
    assert_ne!(across_x, across_z);
}
