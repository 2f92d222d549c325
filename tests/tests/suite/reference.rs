//! Against an independent program's values: placement, faces, interior fill, boundary
//! treatment, look-up and T_clip in one chain. See the README beside the data.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use aogrid_bake_core::{Placement, RawGrid, mesh};
use aogrid_grid_format::{BoundaryMode, Grid};
use aogrid_tables::clip;
use aogrid_tests::{cells_around, cone_at, exact_options, files_with_ending, finish, raw, shared};

/// The endings of the columns, and the boundary treatment each was made with.
const TREATMENTS: [(&str, BoundaryMode); 3] = [
    ("none", BoundaryMode::None),
    ("jgt", BoundaryMode::Jgt),
    ("rr", BoundaryMode::Rr),
];

/// The other program prints five decimals: half a step, and as much again for single floats,
/// which AO = 2a doubles and treatments steepen by up to 0.3/(0.3 − V_M) < 1.8.
const PRINTED: f64 = 1e-5;

struct Receiver {
    position: [f64; 3],
    normal: [f64; 3],
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
            normal: [values[3], values[4], values[5]],
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

/// AO as the paper's shading without directions has it (RR-5779, section 4).
fn occlusion_alone(a: f64, on_itself: bool) -> f64 {
    match on_itself {
        true => (2.0 * a - 1.0).max(0.0),
        false => (2.0 * a).min(1.0),
    }
}

/// AO of the cone, clipped by the tangent plane (RR-5779, section 5.1).
fn clipped([x, y, z, a]: [f64; 4], n: [f64; 3]) -> f64 {
    let length = (x * x + y * y + z * z).sqrt();
    if length == 0.0 {
        return 0.0;
    }
    let cos_beta = (x * n[0] + y * n[1] + z * n[2]) / length;
    clip::closed_form(a, cos_beta).occlusion
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

/// Compares the receivers of a scene that lie away from interior cells: the papers do not say
/// how those are filled, and the other program does it in its own way.
fn compare(
    receivers: &[Receiver],
    scene: &str,
    raw: &RawGrid,
    grid: &Grid,
    treatment: &str,
) -> usize {
    let away = receivers.iter().filter(|receiver| {
        let cells = cells_around(grid.spec(), receiver.position);
        cells.is_none_or(|cells| cells.iter().all(|&idx| !raw.is_interior(idx)))
    });
    let on_itself = scene.contains("_self");
    let (mut n, mut worst) = (0, [0.0_f64; 2]);
    for receiver in away {
        let cone = cone_at(grid, receiver.position);
        let found = [
            ("occlusion", occlusion_alone(cone[3], on_itself)),
            ("cone", clipped(cone, receiver.normal)),
        ];
        for ((column, ao), worst) in found.into_iter().zip(&mut worst) {
            let expected = receiver.columns[&format!("{column}_{treatment}")];
            *worst = worst.max((ao - expected).abs());
        }
        n += 1;
    }
    println!("{scene} {treatment}: {n} receivers, off by at most {worst:?}");
    assert!(
        worst.iter().all(|&worst| worst <= PRINTED),
        "{scene} {treatment}: {worst:?}"
    );
    n
}
