use std::fs;

use aogrid_bake_core::mesh::{self, MeshReport};
use aogrid_bake_core::{BakeOptions, Placement};
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

/// A mesh that is listed as its joints pose it, and that we read in bind pose.
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
        let report = MeshReport::new(&loaded.mesh);
        println!("{file}: {report:?}");
        let size = report.bounds.half_extents().into_iter().fold(0.0, f64::max);
        for (found, expected) in [report.bounds.min, report.bounds.max].iter().zip(bounds) {
            for x in 0..3 {
                let found = f64::from(found[x]) + report.bounds.origin[x];
                let is_close = (found - expected[x]).abs()
                    <= BOUNDS_TOLERANCE * expected[x].abs() + ZERO * size;
                assert!(
                    is_close || file == SKINNED,
                    "{file}: {:?} {bounds:?}",
                    report.bounds
                );
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
