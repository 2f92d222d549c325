//! Against an independent program's values: placement, faces, interior fill, boundary
//! treatment and look-up in one chain. See the README beside the data.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use aogrid_bake_core::{Placement, RawGrid, mesh};
use aogrid_grid_format::{BoundaryMode, Grid};
use aogrid_tests::{
    cells_around, exact_options, files_with_ending, finish, occlusion_at, raw, shared,
};

/// The columns, and the boundary treatment each was made with.
const COLUMNS: [(&str, BoundaryMode); 3] = [
    ("occlusion_none", BoundaryMode::None),
    ("occlusion_jgt", BoundaryMode::Jgt),
    ("occlusion_rr", BoundaryMode::Rr),
];

/// The other program prints five decimals: half a step, and as much again for single floats,
/// which AO = 2a doubles and treatments steepen by up to 0.3/(0.3 − V_M) < 1.8.
const PRINTED: f64 = 1e-5;

struct Receiver {
    position: [f64; 3],
    columns: HashMap<String, f64>,
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
            columns: columns.collect(),
        }
    };
    lines.map(parse).collect()
}

fn reference_raw(folder: &Path, name: &str) -> RawGrid {
    let loaded = mesh::load(&folder.join(format!("{name}.obj"))).unwrap();
    raw(&loaded.mesh, &Placement::default(), &exact_options())
}

fn treated(raw: &RawGrid, boundary: BoundaryMode) -> Grid {
    let mut options = exact_options();
    options.boundary = boundary;
    finish(raw.clone(), &Placement::default(), &options)
}

#[test]
fn the_largest_value_at_the_boundary_of_the_box_is_known() {
    let Some(folder) = shared("reference") else {
        return;
    };
    let raw = reference_raw(&folder, "box");
    let boundary = treated(&raw, BoundaryMode::Jgt).record().boundary;
    assert_eq!(format!("{:.3}", boundary.v_m), "0.083");
}

#[test]
fn receivers_see_what_the_independent_program_says() {
    let Some(folder) = shared("reference") else {
        return;
    };
    let scenes = files_with_ending(&folder.join("scenes"), ".csv");
    let mut compared = 0;
    for name in ["box", "lshape", "table", "torus"] {
        let raw = reference_raw(&folder, name);
        for (column, boundary) in COLUMNS {
            let grid = treated(&raw, boundary);
            let of_mesh = scenes.iter().filter(|csv| {
                let scene = csv.file_name().unwrap().to_string_lossy();
                scene.starts_with(name)
            });
            for csv in of_mesh {
                let on_itself = csv.to_string_lossy().contains("_self");
                let receivers = receivers(csv);
                // The papers do not say how cells inside are filled: the other program does
                // it in its own way.
                let away = receivers.iter().filter(|receiver| {
                    let cells = cells_around(grid.spec(), receiver.position);
                    cells.is_none_or(|cells| cells.iter().all(|&idx| !raw.is_interior(idx)))
                });
                let off: Vec<f64> = away
                    .map(|receiver| {
                        let a = occlusion_at(&grid, receiver.position);
                        let ao = match on_itself {
                            true => (2.0 * a - 1.0).max(0.0),
                            false => (2.0 * a).min(1.0),
                        };
                        (ao - receiver.columns[column]).abs()
                    })
                    .collect();
                let worst = off.iter().copied().fold(0.0, f64::max);
                println!(
                    "{} {column}: {} receivers, off by {worst:.6} at most",
                    csv.file_name().unwrap().to_string_lossy(),
                    off.len()
                );
                assert!(worst <= PRINTED, "{} {column}", csv.display());
                compared += off.len();
            }
        }
    }
    assert!(compared > 18_000, "{compared}");
}
