//! The accuracy of grids and modes: an excerpt of the accuracy suite against the committed table,
//! and the scenes of an independent program.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use aogrid_bake_core::models::Model;
use aogrid_baker_cpu::RayScene;
use aogrid_grid_format::BoundaryMode;
use aogrid_scene::compare::errors;
use aogrid_scene::reference::Receiver;
use aogrid_scene::shade::{Mode, ShadeInput, Shaded, StageObserver, Target};
use aogrid_scene::suite::{Area, ErrorStats, ROWS, Row, Subject, SuiteOptions, Truth, judge};
use aogrid_scene::{GridSource, LoadOptions, Scene, load};
use aogrid_tables::clip;
use aogrid_tests::{files_with_ending, shared};
use glam::DVec3;
use rayon::prelude::*;

/// The occluders and rows of the committed table.
const MODELS: [Model; 7] = [
    Model::Box,
    Model::Sphere,
    Model::Table,
    Model::Wall,
    Model::Rings,
    Model::Sheet,
    Model::OpenBox,
];
const NAMES: [&str; 6] = [
    "paper",
    "paper none",
    "default",
    "default mean",
    "economy",
    "occlusion none",
];

const OPTIONS: SuiteOptions = SuiteOptions {
    receivers: 120,
    samples: 1024,
    seed: 0,
};

/// The columns of numbers in the committed table.
const COLUMNS: [&str; 5] = ["truth", "error", "bias", "rmse", "p95"];

/// The variable that asks for a new table in place of the committed one.
const UPDATE: &str = "AOGRID_UPDATE_ACCURACY";

/// Half of the last printed digit, twice.
const PRINTED: f64 = 1e-5;

/// Standard errors that a value may differ by: other machines draw the same rays, but where one
/// grazes an edge, its sines' last bit decides.
const MAX_DEVIATION: f64 = 3.0;

fn committed() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suite/accuracy.csv")
}

fn unobserved(_: &str) -> StageObserver {
    Box::new(aogrid_bake_core::UNOBSERVED)
}

/// Returns the lines of the table: the key and its numbers.
fn table() -> Vec<(String, [f64; COLUMNS.len()], usize)> {
    let rows: Vec<Row> = NAMES
        .iter()
        .map(|name| ROWS.into_iter().find(|row| row.name == *name))
        .map(|row| row.expect("a row of the suite"))
        .collect();
    let mut lines = vec![];
    for model in MODELS {
        let subject = Subject::of_model(model);
        let truth = Truth::trace(&subject, &OPTIONS, &unobserved).unwrap();
        let report = judge(&subject, &truth, &rows, &unobserved).unwrap();
        for row in report.rows {
            for (area, stats) in Area::ALL.iter().zip(row.areas) {
                let Some(s) = stats else { continue };
                let key = format!("{},{},{}", report.name, row.name, area.name());
                let values = [s.truth, s.truth_error, s.bias, s.rmse, s.p95];
                lines.push((key, values, s.receivers));
            }
        }
    }
    lines
}

fn to_csv(lines: &[(String, [f64; COLUMNS.len()], usize)]) -> String {
    let mut csv = format!("occluder,row,area,{},receivers\n", COLUMNS.join(","));
    for (key, values, receivers) in lines {
        let values = values.map(|v| format!("{v:.5}")).join(",");
        writeln!(csv, "{key},{values},{receivers}").unwrap();
    }
    csv
}

#[test]
fn accuracy_is_as_committed() {
    let lines = table();
    if std::env::var_os(UPDATE).is_some() {
        fs::write(committed(), to_csv(&lines)).unwrap();
    }
    let text = fs::read_to_string(committed()).unwrap();
    let expected: Vec<&str> = text.lines().skip(1).collect();
    assert_eq!(expected.len(), lines.len(), "set {UPDATE} for a new table");
    let mut off = vec![];
    for (line, (key, values, receivers)) in expected.iter().zip(&lines) {
        let numbers = line
            .strip_prefix(key.as_str())
            .unwrap_or_else(|| panic!("{key}: {line}"));
        let numbers: Vec<f64> = numbers[1..]
            .split(',')
            .map(|n| n.parse().unwrap())
            .collect();
        // A mean over n receivers; p95 is of a single one.
        let single = MAX_DEVIATION * numbers[1];
        let mean = single / (*receivers as f64).sqrt();
        let tolerances = [mean, mean, mean, mean, single].map(|t| t + PRINTED);
        for (idx, tolerance) in tolerances.into_iter().enumerate() {
            let (was, is) = (numbers[idx], values[idx]);
            if (is - was).abs() > tolerance {
                off.push(format!("{key}: {} {was} is now {is:.5}", COLUMNS[idx]));
            }
        }
    }
    assert!(
        off.is_empty(),
        "{} values changed; if that is meant, set {UPDATE} for a new table:\n{}",
        off.len(),
        off.join("\n")
    );
}

/// The largest differences from the independent program's RMSE and bias: absolute, and relative to
/// the RMSE.
const MAX_ABSOLUTE: f64 = 0.003;
const MAX_RELATIVE: f64 = 0.15;

/// The largest difference between the means of both truths: 0.002 a receiver, over 500 and more of
/// them, and half of the other's last digit.
const MAX_TRUTH: f64 = 5e-4;

/// Rays for a receiver of the independent program's; their error adds less than 3e-4 to an RMSE of
/// 0.01.
const SAMPLES: u32 = 1024;

const TREATMENTS: [(&str, BoundaryMode); 3] = [
    ("none", BoundaryMode::None),
    ("jgt", BoundaryMode::Jgt),
    ("rr", BoundaryMode::Rr),
];

#[test]
fn each_scene_of_the_independent_program_is_judged_alike() {
    let Some(folder) = shared("reference") else {
        return;
    };
    let summary = fs::read_to_string(folder.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/reference");
    let mut n_compared = 0;
    for path in files_with_ending(&scenes, ".toml") {
        let name = path.file_stem().unwrap().to_string_lossy();
        let all = summary["scenes"].as_array().unwrap().iter();
        let expected = all.clone().find(|s| s["scene"] == *name).unwrap();
        let mean = expected["mean_truth"].as_f64().unwrap();
        for (column, stats) in judged(&path) {
            assert!(
                (stats.truth - mean).abs() <= MAX_TRUTH,
                "{name}: {}",
                stats.truth
            );
            let number = |kind: &str| expected[kind][&column].as_f64().unwrap();
            let rmse = number("rmse");
            let tolerance = MAX_ABSOLUTE.max(MAX_RELATIVE * rmse);
            let off = [stats.rmse - rmse, stats.bias - number("bias")];
            println!("{name} {column}: RMSE {:.4} for {rmse}", stats.rmse);
            assert!(
                off.iter().all(|off| off.abs() <= tolerance),
                "{name} {column}: off by {off:?}, tolerance {tolerance}"
            );
            n_compared += 1;
        }
    }
    // Six columns of all scenes, and two more of those whose receivers are not on the occluder.
    assert_eq!(n_compared, 14 * 6 + 11 * 2);
}

/// Returns the errors of a reference scene's grids, by the independent program's columns.
fn judged(path: &Path) -> Vec<(String, ErrorStats)> {
    let mut scene = load(path, LoadOptions::default()).unwrap();
    scene.truth.samples = SAMPLES;
    scene.truth.error = None;
    let target = Target::of_list(scene.receivers.as_ref().unwrap());
    let shade = |scene: &Scene, mode: &str| {
        let mode = Mode::named(mode).unwrap();
        mode.shade(&ShadeInput::new(scene, &target)).unwrap()
    };
    let truth = shade(&scene, "truth");
    let areas = vec![None; target.receivers.len()];
    let of = |mode, shaded: &Shaded| errors(mode, shaded, &truth, &areas).all.unwrap();
    let mut columns = vec![];
    // On an occluder the other program's rays may start elsewhere than ours, which decides there.
    if scene
        .receivers
        .as_ref()
        .is_some_and(|list| list.object.is_none())
    {
        let [occlusion, cone] = at_points(&scene, &target);
        columns.push(("occlusion_at_point".to_owned(), of("occlusion", &occlusion)));
        columns.push(("cone_at_point".to_owned(), of("cone", &cone)));
    }
    for (name, boundary) in TREATMENTS {
        for mesh in &mut scene.meshes {
            if let GridSource::Bake(_, options) = &mut mesh.grid {
                options.boundary = boundary;
            }
        }
        for mode in ["occlusion", "cone"] {
            let shaded = shade(&scene, mode);
            columns.push((format!("{mode}_{name}"), of(mode, &shaded)));
        }
    }
    columns
}

/// Directions of the sphere for the moments at a receiver: their sums err by about 1e-3.
const DIRECTIONS: u32 = 2048;

/// Returns the AO of modes occlusion and cone with exact moments at each receiver, without a grid.
fn at_points(scene: &Scene, target: &Target) -> [Shaded; 2] {
    let mesh = scene.flattened(|instance| instance.casts).unwrap();
    let rays = RayScene::new(&mesh.unwrap());
    let receivers = target.receivers.par_iter();
    let both: Vec<[f64; 2]> = receivers
        .map(|receiver| at_point(&rays, receiver))
        .collect();
    [0, 1].map(|mode| Shaded {
        occlusion: both.iter().map(|ao| ao[mode] as f32).collect(),
        occlusion_error: None,
        light: None,
        light_error: None,
    })
}

fn at_point(rays: &RayScene, receiver: &Receiver) -> [f64; 2] {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let (mut n_occluded, mut sum) = (0, DVec3::ZERO);
    for idx in 0..DIRECTIONS {
        // A spiral with equal areas between its turns.
        let z = 1.0 - (2.0 * f64::from(idx) + 1.0) / f64::from(DIRECTIONS);
        let (sin, cos) = (golden * f64::from(idx)).sin_cos();
        let across = (1.0 - z * z).sqrt();
        let direction = DVec3::new(across * cos, across * sin, z);
        if rays.is_occluded(receiver.position, direction.to_array(), f64::INFINITY) {
            n_occluded += 1;
            sum += direction;
        }
    }
    let a = f64::from(n_occluded) / f64::from(DIRECTIONS);
    let cos_beta = sum.normalize_or_zero().dot(receiver.normal.into());
    let occlusion = (2.0 * a).min(1.0);
    [occlusion, clip::closed_form(a, cos_beta).occlusion]
}
