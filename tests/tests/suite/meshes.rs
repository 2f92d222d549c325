use std::fs;
use std::path::Path;

use aogrid_bake_core::mesh::{self, AnimationTime, MeshFile, MeshReport};
use aogrid_bake_core::{BakeOptions, Placement, TriangleMesh};
use aogrid_grid_format::{Grid, Sampling};
use aogrid_tests::{grid, shared};

/// A mesh's properties as listed in the data folder's README; the numbers come from other programs.
struct Expected {
    file: String,
    triangles: usize,
    closed: bool,
    boundary_edges: usize,
    non_manifold_edges: usize,
    /// The smallest and the largest coordinates, with four digits.
    bounds: [[f64; 3]; 2],
}

/// Parses the rows of the README's table: file, triangles, vertices, closed?, boundary /
/// non-manifold …
fn expected(readme: &str) -> Vec<Expected> {
    let rows = readme.lines().filter(|l| l.starts_with("| meshes/"));
    let parse = |row: &str| {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let number = |text: &str| text.trim().replace(',', "").parse().unwrap();
        let (boundary, non_manifold) = cells[5].split_once('/').unwrap();
        let corner = |text: &str| {
            let numbers = text.split_whitespace().map(|n| n.parse().unwrap());
            <[f64; 3]>::try_from(numbers.collect::<Vec<_>>()).unwrap()
        };
        Expected {
            file: cells[1].into(),
            triangles: number(cells[2]),
            closed: cells[4] == "yes",
            boundary_edges: number(boundary),
            non_manifold_edges: number(non_manifold),
            bounds: [corner(cells[7]), corner(cells[8])],
        }
    };
    rows.map(parse).collect()
}

/// A mesh that is triangulated in two ways. Sponza's polygons are triangulated properly here and as
/// fans there: our mesh has no more triangles than fans have, and a few fewer if a corner lies on a
/// straight line.
const TRIANGULATED_DIFFERENTLY: &str = "meshes/sponza_dabrovic.obj";

/// The relative error of numbers that are listed with four digits: half a unit of the last digit of
/// 1.000.
const BOUNDS_TOLERANCE: f64 = 5e-4;

/// The size of what counts as zero, relative to half the mesh's size: some roundings of a pose.
const ZERO: f64 = 1e-6;

/// A mesh that is listed as its joints pose it, and that is read in bind pose unless it is asked for a
/// pose.
const SKINNED: &str = "meshes/Fox_skinned.glb";

#[test]
fn reports_agree_with_other_programs() {
    let Some(folder) = shared("data") else {
        return;
    };
    let expected = expected(&fs::read_to_string(folder.join("README.md")).unwrap());
    assert!(expected.len() >= 26, "{}", expected.len());
    for Expected {
        file,
        triangles,
        closed,
        boundary_edges,
        non_manifold_edges,
        bounds,
    } in expected
    {
        let loaded = mesh::load(&folder.join(&file)).unwrap();
        let report = match file == SKINNED {
            true => MeshReport::new(&posed_fox(&folder, None, 0.0)),
            false => MeshReport::new(&loaded.mesh),
        };
        println!("{file}: {report:?}");
        let size = report.bounds.half_extents().into_iter().fold(0.0, f64::max);
        for (found, expected) in [report.bounds.min, report.bounds.max].iter().zip(bounds) {
            for x in 0..3 {
                let found = f64::from(found[x]) + report.bounds.origin[x];
                let is_close = (found - expected[x]).abs()
                    <= BOUNDS_TOLERANCE * expected[x].abs() + ZERO * size;
                assert!(is_close, "{file}: {:?} {bounds:?}", report.bounds);
            }
        }
        if file == TRIANGULATED_DIFFERENTLY {
            assert!(
                (triangles - 100..=triangles).contains(&report.triangles),
                "{file}"
            );
            continue;
        }
        assert_eq!(report.triangles, triangles, "{file}");
        // The rounding of transformed vertices decides which of them coincide.
        if file.ends_with(".glb") {
            continue;
        }
        assert_eq!(report.boundary_edges, boundary_edges, "{file}");
        assert_eq!(report.non_manifold_edges, non_manifold_edges, "{file}");
        assert_eq!(report.is_closed(), closed, "{file}");
    }
}

fn posed_fox(folder: &Path, animation: Option<&str>, time: f64) -> TriangleMesh {
    let file = MeshFile::read(&folder.join(SKINNED)).unwrap();
    let pose = AnimationTime { animation, time };
    file.parse_posed(&pose).unwrap().mesh
}

/// Vertices 0, 700 and 1500 of the fox as a program of its own poses them: rotation by quaternions, the
/// formula of spherical interpolation with the arc cosine, and the sum of weighted points.
#[test]
fn animations_pose_the_fox_as_another_program_does() {
    /// The four digits of the list, and the single floats of positions up to 100.
    const TOLERANCE: f64 = 1e-4;
    let Some(folder) = shared("data") else {
        return;
    };
    let cases = [
        (
            ("Walk", 0.1),
            [
                [3.2502, 32.4498, -23.1373],
                [-3.3626, 41.2024, -39.1402],
                [-5.7327, 8.0487, 3.9352],
            ],
        ),
        (
            ("Walk", 0.4),
            [
                [1.1951, 36.7566, -17.8693],
                [-5.0569, 42.81, -39.1787],
                [-5.6602, 7.3244, 34.9465],
            ],
        ),
        (
            ("Run", 0.33),
            [
                [2.8955, 28.6873, -20.3344],
                [-4.4129, 39.955, -35.6428],
                [-7.42, 21.4645, 59.6988],
            ],
        ),
    ];
    for ((animation, time), expected) in cases {
        let mesh = posed_fox(&folder, Some(animation), time);
        for (vertex, expected) in [0, 700, 1500].into_iter().zip(expected) {
            let found = mesh.positions()[vertex].map(f64::from);
            let off = (0..3).map(|x| (found[x] - expected[x]).abs());
            let off = off.fold(0.0, f64::max);
            assert!(
                off <= TOLERANCE,
                "{animation} {time}: {found:?} {expected:?}"
            );
        }
    }
}

/// Every real mesh bakes into a grid that reads back. The resolution is low, so that it takes
/// seconds. To look at a grid, use `cargo xtask slices`.
#[test]
fn every_real_mesh_bakes() {
    let Some(folder) = shared("data/meshes") else {
        return;
    };
    let placement = Placement {
        resolution: [8; 3],
        ..Placement::paper()
    };
    let options = BakeOptions {
        sampling: Sampling::CubeFaces { size: 8 },
        ..BakeOptions::paper()
    };
    for path in aogrid_tests::files_with_ending(&folder, "") {
        let loaded = mesh::load(&path).unwrap();
        let grid = grid(&loaded.mesh, &placement, &options);
        let read = Grid::from_bytes(&grid.to_bytes()).unwrap();
        assert_eq!(read, grid, "{}", path.display());
        assert!(grid.statistics().largest > 0.1, "{}", path.display());
    }
}
