//! Compares with an independent program's values: placement, faces, interior fill, boundary
//! treatment, look-up and T_clip in one chain. See the README beside the data.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use aogrid_bake_core::{Placement, RawGrid, mesh};
use aogrid_grid_format::{BoundaryMode, Grid, TexelFormat};
use aogrid_runtime::shading::{aogrid_axis, aogrid_cos_beta};
use aogrid_tables::clip;
use aogrid_tests::{Shaded, cells_around, exact_options, files_with_ending, finish, raw, shared};

/// The suffixes of the columns, and the boundary treatment each was made with.
const TREATMENTS: [(&str, BoundaryMode); 3] = [
    ("none", BoundaryMode::None),
    ("jgt", BoundaryMode::Jgt),
    ("rr", BoundaryMode::Rr),
];

/// The tolerance of printed values. The other program prints five decimals: half a step, and as
/// much again for single floats. AO = 2a doubles both, and treatments amplify them by up to
/// 0.3/(0.3 − V_M) < 1.8.
const PRINT_TOLERANCE: f64 = 1e-5;

struct Receiver {
    position: [f64; 3],
    normal: [f64; 3],
    columns: HashMap<String, f64>,
}

impl Receiver {
    fn position(&self) -> [f32; 3] {
        self.position.map(|x| x as f32)
    }

    fn normal(&self) -> [f32; 3] {
        self.normal.map(|x| x as f32)
    }
}

fn receivers(csv: &Path) -> Vec<Receiver> {
    let text = fs::read_to_string(csv).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let parse = |line: &str| {
        let values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        let columns = names
            .iter()
            .zip(&values)
            .map(|(n, v)| ((*n).to_owned(), *v));
        Receiver {
            position: [values[0], values[1], values[2]],
            normal: [values[3], values[4], values[5]],
            columns: columns.collect(),
        }
    };
    lines.map(parse).collect()
}

fn reference_raw(folder: &Path, name: &str) -> RawGrid {
    let loaded = mesh::load(&folder.join(format!("{name}.obj"))).unwrap();
    raw(&loaded.mesh, &Placement::paper(), &exact_options())
}

fn treated(raw: &RawGrid, boundary: BoundaryMode) -> Grid {
    let mut options = exact_options();
    options.boundary = boundary;
    finish(raw.clone(), &Placement::paper(), &options)
}

#[test]
fn the_largest_boundary_value_of_the_box_matches() {
    let Some(folder) = shared("reference") else {
        return;
    };
    let raw = reference_raw(&folder, "box");
    let boundary = treated(&raw, BoundaryMode::Jgt).record().boundary;
    assert_eq!(format!("{:.3}", boundary.v_m), "0.083");
}

/// Returns AO with the closed form in place of T_clip's texture: only the look-up is the runtime's.
fn without_table(shaded: &Shaded, receiver: &Receiver) -> f64 {
    let Some([x, y, z, a]) = shaded.texel(receiver.position()) else {
        return 0.0;
    };
    let axis = aogrid_axis(&shaded.occluder, [x, y, z]);
    let cos_beta = aogrid_cos_beta(axis, receiver.normal());
    clip::closed_form(f64::from(a), f64::from(cos_beta)).occlusion
}

#[test]
fn receivers_match_the_independent_program() {
    let Some(folder) = shared("reference") else {
        return;
    };
    let scenes = files_with_ending(&folder.join("scenes"), ".csv");
    let mut compared = 0;
    for name in ["box", "lshape", "table", "torus"] {
        let raw = reference_raw(&folder, name);
        for (treatment, boundary) in TREATMENTS {
            let grid = treated(&raw, boundary);
            for csv in &scenes {
                let scene = csv.file_name().unwrap().to_string_lossy();
                if scene.starts_with(name) {
                    compared += compare(&receivers(csv), &scene, &raw, &grid, treatment);
                }
            }
        }
    }
    assert!(compared > 23_000, "{compared}");
}

/// Compares the receivers of a scene that lie away from interior cells: the papers leave their fill
/// open, and the other program has its own. Returns the number of receivers.
fn compare(
    receivers: &[Receiver],
    scene: &str,
    raw: &RawGrid,
    grid: &Grid,
    treatment: &str,
) -> usize {
    let away = receivers.iter().filter(|receiver| {
        let cells = cells_around(grid.spec(), receiver.position);
        cells.is_none_or(|cells| cells.iter().all(|&idx| !raw.is_enclosed(idx)))
    });
    let on_itself = scene.contains("_self");
    let shaded = Shaded::in_object_space(grid);
    let (mut n, mut worst) = (0, [0.0_f64; 2]);
    for receiver in away {
        let occlusion = shaded.occlusion(receiver.position(), on_itself);
        let found = [
            ("occlusion", f64::from(occlusion)),
            ("cone", without_table(&shaded, receiver)),
        ];
        for ((column, ao), worst) in found.into_iter().zip(&mut worst) {
            let expected = receiver.columns[&format!("{column}_{treatment}")];
            *worst = worst.max((ao - expected).abs());
        }
        n += 1;
    }
    println!("{scene} {treatment}: {n} receivers, off by at most {worst:?}");
    assert!(
        worst.iter().all(|&worst| worst <= PRINT_TOLERANCE),
        "{scene} {treatment}: {worst:?}"
    );
    n
}

/// The largest RMSE that the runtime may add to the model: an 8-bit grid, T_clip's texture, single
/// floats.
const MAX_RUNTIME_RMSE: f64 = 0.003;

/// The largest relative difference between our error against the truth, RMS over scenes, and the
/// independent program's.
const MAX_RMS_DEVIATION: f64 = 0.05;

/// Returns the 8-bit grid of a default bake, except for the sample positions.
fn default_grid(raw: &RawGrid, boundary: BoundaryMode) -> Grid {
    let mut options = exact_options();
    options.boundary = boundary;
    options.format = TexelFormat::Unorm8;
    finish(raw.clone(), &Placement::paper(), &options)
}

/// Sums over receivers, of squared differences from the same column and from the truth.
#[derive(Clone, Copy, Default)]
struct Errors {
    n: f64,
    away: f64,
    from_column: f64,
    from_truth: f64,
}

#[test]
fn default_grids_are_as_accurate_as_the_independent_program_s() {
    let Some(folder) = shared("reference") else {
        return;
    };
    let summary = fs::read_to_string(folder.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let scenes = files_with_ending(&folder.join("scenes"), ".csv");
    // Mean squared error against truth by kind of scene and column.
    let mut squares: HashMap<(&str, String), Vec<f64>> = HashMap::new();
    for name in ["box", "lshape", "table", "torus"] {
        let raw = reference_raw(&folder, name);
        for (treatment, boundary) in TREATMENTS {
            let grid = default_grid(&raw, boundary);
            for csv in &scenes {
                let scene = csv.file_name().unwrap().to_string_lossy();
                if !scene.starts_with(name) {
                    continue;
                }
                let on_itself = scene.contains("_self");
                let kind = if on_itself { "self" } else { "other surface" };
                for column in ["occlusion", "cone"] {
                    let column = format!("{column}_{treatment}");
                    let errors = errors(&receivers(csv), &raw, &grid, &column, on_itself);
                    let rmse = (errors.from_column / errors.away).sqrt();
                    println!("{scene} {column}: {rmse:.5} over {} receivers", errors.away);
                    // On a mesh's own surface every look-up may touch an interior cell.
                    let compared = errors.away > 0.0 || on_itself;
                    assert!(
                        compared && (rmse.is_nan() || rmse <= MAX_RUNTIME_RMSE),
                        "{scene} {column}: {rmse}"
                    );
                    let squares = squares.entry((kind, column)).or_default();
                    squares.push(errors.from_truth / errors.n);
                }
            }
        }
    }
    assert_eq!(squares.len(), 12);
    for ((kind, column), squares) in squares {
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        let expected = summary["rms_over_scenes"][kind][&column].as_f64().unwrap();
        println!("{kind} {column}: {rms:.4}, {expected}");
        assert!(
            (rms / expected - 1.0).abs() <= MAX_RMS_DEVIATION,
            "{kind} {column}: {rms} for {expected}"
        );
    }
}

fn errors(
    receivers: &[Receiver],
    raw: &RawGrid,
    grid: &Grid,
    column: &str,
    on_itself: bool,
) -> Errors {
    let shaded = Shaded::in_object_space(grid);
    let mut errors = Errors::default();
    for receiver in receivers {
        let ao = match column.starts_with("cone") {
            true => shaded.cone(receiver.position(), receiver.normal()),
            false => shaded.occlusion(receiver.position(), on_itself),
        };
        let from = |column: &str| (f64::from(ao) - receiver.columns[column]).powi(2);
        errors.n += 1.0;
        errors.from_truth += from("truth");
        let cells = cells_around(grid.spec(), receiver.position);
        if cells.is_none_or(|cells| cells.iter().all(|&idx| !raw.is_enclosed(idx))) {
            errors.away += 1.0;
            errors.from_column += from(column);
        }
    }
    errors
}
