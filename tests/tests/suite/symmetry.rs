use aogrid_bake_core::models::Model;
use aogrid_bake_core::{Extent, Placement, RawGrid, TriangleMesh};
use aogrid_tests::{Random, exact_options, mesh_of, raw};

fn small() -> Placement {
    Placement {
        resolution: [16, 12, 17],
        ..Placement::paper()
    }
}

/// Returns the counts of cells that mirror each other across the middle of `axis`.
fn pairs(grid: &RawGrid, axis: usize) -> impl Iterator<Item = (u32, u32)> + '_ {
    (0..grid.counts.len()).map(move |idx| {
        let mut cell = grid.spec.cell_at(idx);
        cell[axis] = grid.spec.resolution()[axis] - 1 - cell[axis];
        (grid.counts[idx], grid.counts[grid.spec.cell_idx(cell)])
    })
}

fn assert_mirrors(mesh: &TriangleMesh, axes: &[usize], what: &str) {
    let grid = raw(mesh, &small(), &exact_options());
    assert!(grid.counts.iter().any(|&n| n > 0));
    for &axis in axes {
        let odd = pairs(&grid, axis).filter(|(a, b)| a != b).count();
        assert_eq!(
            odd, 0,
            "{what}: cells that do not mirror across axis {axis}"
        );
    }
}

#[test]
fn symmetric_models_have_symmetric_counts() {
    for (sample, axes) in [
        (Model::Box, &[0, 1, 2][..]),
        (Model::Table, &[0, 2]),
        (Model::LShape, &[2]),
        (Model::Torus, &[0, 1, 2]),
        (Model::Sphere, &[0, 1, 2]),
        (Model::SpaceShip, &[0]),
    ] {
        assert_mirrors(&sample.mesh(None).unwrap(), axes, sample.name());
    }
}

/// Random triangles and their mirror images, in another order and winding.
#[test]
fn mirrored_soups_have_mirrored_counts() {
    let mut random = Random::new(12345);
    let mut next = || random.signed();
    for axis in 0..3 {
        let half: Vec<[[f32; 3]; 3]> = (0..60)
            .map(|_| {
                let center = [next(), next(), next()];
                [(); 3].map(|()| std::array::from_fn(|x| center[x] + 0.3 * next()))
            })
            .collect();
        let mirror = |t: &[[f32; 3]; 3]| {
            let [a, b, c] = t.map(|mut corner| {
                corner[axis] = -corner[axis];
                corner
            });
            [b, a, c]
        };
        let mirrored: Vec<_> = half.iter().rev().map(mirror).collect();
        assert_mirrors(&mesh_of(&[half, mirrored].concat()), &[axis], "soup");
    }
}

#[test]
fn the_check_detects_an_asymmetric_mesh() {
    let mesh = Model::LShape.mesh(None).unwrap();
    let grid = raw(&mesh, &small(), &exact_options());
    assert!(pairs(&grid, 0).any(|(a, b)| a != b));
}

#[test]
fn moving_and_scaling_by_powers_of_two_changes_nothing() {
    let mesh = Model::Robot.mesh(None).unwrap();
    let moved = |p: [f32; 3]| p.map(|v| (v - 0.5) * 4.0);
    let corners: Vec<_> = mesh.corners().collect();
    let placement = |scale: f32| Placement {
        extent: Extent::HalfExtents([1.5 * scale; 3]),
        ..small()
    };
    // Coordinates are multiples of 2⁻¹², so that adding the offset is exact; in general it rounds.
    let rounded: Vec<_> = corners
        .iter()
        .map(|t| t.map(|p| p.map(|v| (v * 4096.0).round() / 4096.0)))
        .collect();
    let one = raw(&mesh_of(&rounded), &placement(1.0), &exact_options());
    let far: Vec<_> = rounded.iter().map(|t| t.map(moved)).collect();
    let other = raw(&mesh_of(&far), &placement(4.0), &exact_options());
    assert_eq!(one.counts, other.counts);
    assert_eq!(one.moments, other.moments);
}
