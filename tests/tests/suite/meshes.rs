use std::fs;

use aogrid_bake_core::mesh::{self, MeshReport};
use aogrid_bake_core::{BakeOptions, Placement};
use aogrid_grid_format::{Grid, Method};
use aogrid_tests::{grid, shared};

/// What the data folder's README says of a mesh; its numbers come from other programs.
struct Expected {
    file: String,
    triangles: usize,
    closed: bool,
    boundary_edges: usize,
    non_manifold_edges: usize,
}

/// Rows of the README's table: file, triangles, vertices, closed?, boundary / non-manifold …
fn expected(readme: &str) -> Vec<Expected> {
    let rows = readme
        .lines()
        .filter(|l| l.starts_with("| meshes/") && l.contains(".obj |"));
    let parse = |row: &str| {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let number = |text: &str| text.trim().replace(',', "").parse().unwrap();
        let (boundary, non_manifold) = cells[5].split_once('/').unwrap();
        Expected {
            file: cells[1].into(),
            triangles: number(cells[2]),
            closed: cells[4] == "yes",
            boundary_edges: number(boundary),
            non_manifold_edges: number(non_manifold),
        }
    };
    rows.map(parse).collect()
}

/// Sponza's polygons are cut properly here and as fans there: no more triangles than a fan
/// has, and a handful fewer where a corner lies on a straight line.
const CUT_DIFFERENTLY: &str = "meshes/sponza_dabrovic.obj";

#[test]
fn reports_agree_with_other_programs() {
    let Some(folder) = shared("data") else {
        return;
    };
    let expected = expected(&fs::read_to_string(folder.join("README.md")).unwrap());
    assert!(expected.len() >= 16, "{}", expected.len());
    for Expected {
        file,
        triangles,
        closed,
        boundary_edges,
        non_manifold_edges,
    } in expected
    {
        let loaded = mesh::load(&folder.join(&file)).unwrap();
        let report = MeshReport::new(&loaded.mesh);
        println!("{file}: {report:?}");
        if file == CUT_DIFFERENTLY {
            assert!(
                (triangles - 100..=triangles).contains(&report.triangles),
                "{file}"
            );
            continue;
        }
        assert_eq!(report.triangles, triangles, "{file}");
        assert_eq!(report.boundary_edges, boundary_edges, "{file}");
        assert_eq!(report.non_manifold_edges, non_manifold_edges, "{file}");
        assert_eq!(report.is_closed(), closed, "{file}");
    }
}

/// At a low resolution, so that it takes seconds: that every real mesh bakes into a grid that
/// reads back. How it looks is for eyes: `cargo xtask slices`.
#[test]
fn every_real_mesh_bakes() {
    let Some(folder) = shared("data/meshes") else {
        return;
    };
    let placement = Placement {
        resolution: [8; 3],
        ..Placement::default()
    };
    let options = BakeOptions {
        method: Method::Faces { size: 8 },
        ..BakeOptions::recommended()
    };
    for path in aogrid_tests::files_with_ending(&folder, ".obj") {
        let loaded = mesh::load(&path).unwrap();
        let grid = grid(&loaded.mesh, &placement, &options);
        let read = Grid::from_bytes(&grid.to_bytes()).unwrap();
        assert_eq!(read, grid, "{}", path.display());
        assert!(grid.statistics().largest > 0.1, "{}", path.display());
    }
}
