use std::ops::ControlFlow;

use aogrid_bake_core::models::Model;
use aogrid_bake_core::{
    BakeOptions, FaceSums, Placement, PreparedMesh, Progress, TriangleMesh, UNOBSERVED,
    fixed_texels, mesh,
};
use aogrid_baker_cpu::parity::{Parity, graze};
use aogrid_baker_cpu::{BakeError, QuantizedMeshRays, Sweeper};
use aogrid_grid_format::GridSpec;
use aogrid_tests::{Random, files_with_ending, mesh_of, shared};
use proptest::prelude::*;

/// Returns the mesh on the lattice of a default bake's grid at `resolution`.
pub(crate) fn prepared(mesh: &TriangleMesh, resolution: [u32; 3]) -> PreparedMesh {
    let placement = Placement {
        resolution,
        ..Placement::paper()
    };
    let spec = placement.place(&mesh.bounds()).unwrap();
    PreparedMesh::new(mesh, spec, BakeOptions::SAMPLE_OFFSET).unwrap()
}

pub(crate) fn compare(mesh: &PreparedMesh, size: u32) -> Parity {
    let bake = Sweeper::new().bake_with_bits(mesh, size, UNOBSERVED);
    Parity::new(mesh, size, bake.unwrap())
}

pub(crate) fn assert_parity(parity: &Parity, allowed: usize, what: &str) {
    let found = parity.differences.len();
    println!(
        "{what}: {found} of {} texels differ, {} are occluded",
        parity.texels, parity.occluded
    );
    assert!(found <= allowed, "{what}: {found} differ");
    for graze in &parity.grazes {
        println!("  {graze:.1e} cells from an edge");
    }
    assert_eq!(parity.fault(), None, "{what}");
}

/// The largest number of mismatches of the CPU's sweep. Double precision decides close cases, for
/// rays and sweep alike, so a few million texels show none.
const MAX_MISMATCHES_CPU: usize = 0;

/// The largest number of mismatches of the GPU's sweep. Single floats alone show a permitted
/// mismatch once in a hundred small comparisons, and one must not fail a test: the errors to be
/// found cause hundreds.
pub(crate) const MAX_MISMATCHES_GPU: usize = 1;

#[test]
fn models_match_at_any_resolution_and_face_size() {
    for (sample, resolution, size) in [
        (Model::Table, [12, 9, 10], 16),
        (Model::Robot, [16, 21, 11], 8),
        (Model::SpaceShip, [24, 10, 33], 13),
        (Model::Torus, [8, 35, 8], 17),
        (Model::Sphere, [9, 9, 40], 24),
        (Model::LShape, [8, 8, 8], 128),
    ] {
        let mesh = prepared(&sample.mesh(None).unwrap(), resolution);
        assert_parity(&compare(&mesh, size), MAX_MISMATCHES_CPU, sample.name());
    }
}

pub(crate) type Corners = [[f32; 3]; 3];

pub(crate) fn soup(n: usize, size: f32) -> Vec<Corners> {
    let mut random = Random::new(n as u32);
    let mut next = || random.signed();
    let mut triangle = || {
        let center = [next(), next(), next()];
        [(); 3].map(|()| std::array::from_fn(|x| center[x] + size * next()))
    };
    (0..n).map(|_| triangle()).collect()
}

/// Returns a box as twelve triangles.
fn cuboid(min: [f32; 3], max: [f32; 3]) -> Vec<Corners> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        let (y, z) = ((axis + 1) % 3, (axis + 2) % 3);
        for at in [min[axis], max[axis]] {
            let corner = |s: f32, t: f32| {
                let mut p = [at; 3];
                (p[y], p[z]) = (s, t);
                p
            };
            let quad = [
                corner(min[y], min[z]),
                corner(max[y], min[z]),
                corner(max[y], max[z]),
                corner(min[y], max[z]),
            ];
            triangles.push([quad[0], quad[1], quad[2]]);
            triangles.push([quad[0], quad[2], quad[3]]);
        }
    }
    triangles
}

fn flipped(t: &Corners) -> Corners {
    [t[0], t[2], t[1]]
}

#[test]
fn broken_meshes_match() {
    let robot: Vec<Corners> = Model::Robot.mesh(None).unwrap().corners().collect();
    let open: Vec<Corners> = robot.iter().step_by(2).copied().collect();
    let wound: Vec<Corners> = (0..)
        .zip(&robot)
        .map(|(i, t)| if i % 3 == 0 { flipped(t) } else { *t })
        .collect();
    let duplicated = [&robot[..], &robot, &open].concat();
    let flat: Vec<Corners> = robot
        .iter()
        .map(|t| t.map(|[x, y, _]| [x, y, 0.25]))
        .collect();
    let needles: Vec<Corners> = soup(40, 1.0)
        .iter()
        .map(|[a, b, _]| [*a, *b, b.map(|v| v * 1.0001)])
        .collect();
    let fan: Vec<Corners> = soup(30, 1.0)
        .iter()
        .map(|[a, _, _]| [[0.0; 3], [0.0, 1.0, 0.0], *a])
        .collect();
    let cases = [
        ("open", open),
        ("inconsistently wound", wound),
        ("duplicated", duplicated),
        ("flat", flat),
        ("needles", needles),
        ("non-manifold fan", fan),
        ("one triangle", soup(1, 1.0)),
    ];
    for (what, triangles) in cases {
        let mesh = prepared(&mesh_of(&triangles), [16, 12, 17]);
        assert_parity(&compare(&mesh, 16), MAX_MISMATCHES_CPU, what);
    }
}

#[test]
fn five_thousand_random_triangles_match() {
    let mesh = prepared(&mesh_of(&soup(5000, 0.2)), [16; 3]);
    assert_parity(&compare(&mesh, 16), MAX_MISMATCHES_CPU, "soup");
}

#[test]
fn winding_and_welding_do_not_matter() {
    let mesh = Model::SpaceShip.mesh(None).unwrap();
    let split: Vec<Corners> = mesh.corners().collect();
    let turned: Vec<Corners> = split.iter().map(flipped).collect();
    let bits = |mesh: &TriangleMesh| compare(&prepared(mesh, [12; 3]), 16).bits;
    let whole = bits(&mesh);
    assert_eq!(whole, bits(&mesh_of(&split)));
    assert_eq!(whole, bits(&mesh_of(&turned)));
}

/// Boxes with their faces on cell centers, which are not rounded: no texel may differ.
#[test]
fn boxes_on_the_lattice_match_exactly() {
    let spec = GridSpec::new([16; 3], [0.0; 3], [8.0; 3]).unwrap();
    let city: Vec<Corners> = (0..12_u8)
        .flat_map(|i| {
            let [x, z] = [i % 4, i / 4].map(|v| f32::from(v) * 3.0 - 5.5);
            let height = f32::from(i * 5 % 7) + 1.0;
            cuboid([x, -5.5, z], [x + 2.0, -5.5 + height, z + 2.0])
        })
        .collect();
    for triangles in [cuboid([-3.5; 3], [2.5, 3.5, 4.5]), city] {
        let mesh = mesh_of(&triangles);
        let mesh = PreparedMesh::new(&mesh, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
        for size in [8, 16] {
            assert_parity(&compare(&mesh, size), 0, "boxes");
        }
    }
}

/// Stacks of sheets, and coincident sheets: layer counts far beyond what a byte holds, also exact
/// multiples of 256, at which it wraps.
#[test]
fn hundreds_of_layers_are_counted() {
    let copies = |n: usize| -> Vec<Corners> { stack_of_sheets(1).repeat(n) };
    let cases = [
        ("stack of 256", stack_of_sheets(256)),
        ("stack of 300", stack_of_sheets(300)),
        ("256 copies", copies(256)),
        ("128 copies", copies(128)),
        (
            "512 copies and a stack",
            [copies(512), stack_of_sheets(256)].concat(),
        ),
    ];
    let few = [cuboid([-1.0, 0.0, -1.0], [1.0, 0.3, 1.1])].concat();
    for (what, triangles) in cases {
        let mesh = mesh_of(&[&triangles[..], &few[..1]].concat());
        assert_parity(
            &compare(&prepared(&mesh, [8, 12, 8]), 8),
            MAX_MISMATCHES_CPU,
            what,
        );
    }
}

/// Returns `n` sheets, each a thousandth above the previous one.
pub(crate) fn stack_of_sheets(n: u16) -> Vec<Corners> {
    let sheet = |y: f32| {
        let [a, b, c, d] = [
            [-1.0, y, -1.0],
            [1.0, y, -1.0],
            [1.0, y, 1.1],
            [-1.0, y, 1.0],
        ];
        [[a, b, c], [a, c, d]]
    };
    (0..n).flat_map(|i| sheet(f32::from(i) / 1000.0)).collect()
}

#[test]
fn a_grid_inside_the_mesh_matches() {
    let mesh = Model::Robot.mesh(None).unwrap();
    for (resolution, extents) in [([8; 3], [0.1, 0.05, 0.1]), ([8, 40, 9], [0.02; 3])] {
        let spec = GridSpec::new(resolution, mesh.bounds().center(), extents).unwrap();
        let mesh = PreparedMesh::new(&mesh, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
        assert!(mesh.lattice().bits() < 19);
        assert_parity(&compare(&mesh, 16), MAX_MISMATCHES_CPU, "inside");
    }
}

#[test]
fn moments_match_the_bits() {
    let mesh = prepared(&Model::Robot.mesh(None).unwrap(), [9, 8, 14]);
    for size in [8, 16, 21] {
        let Parity { raw, bits, .. } = compare(&mesh, size);
        let texels = fixed_texels(size);
        for cell in 0..bits.cells() {
            let mut sums = FaceSums::default();
            for (idx, texel) in texels.iter().enumerate() {
                if bits.get(cell, idx) {
                    sums.add(texel);
                }
            }
            assert_eq!(raw.counts[cell], sums.count);
            assert_eq!(raw.moments[cell], sums.moments(raw.directions));
        }
    }
}

#[test]
fn a_warm_sweeper_and_any_number_of_threads_give_the_same_bits() {
    let meshes = [Model::Table, Model::SpaceShip].map(|s| s.mesh(None).unwrap());
    let [table, ship] = [
        prepared(&meshes[0], [30; 3]),
        prepared(&meshes[1], [8, 9, 40]),
    ];
    let mut warm = Sweeper::new();
    for (mesh, size) in [(&table, 16), (&ship, 9), (&table, 8), (&ship, 20)] {
        // The state that a cancelled bake leaves must not affect the next.
        let cancel = |progress: Progress| match 2 * progress.done > progress.total {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        let cancelled = warm.bake(mesh, size, &cancel);
        assert_eq!(cancelled, Err(BakeError::Cancelled));
        let expected = warm.bake(mesh, size, UNOBSERVED).unwrap();
        for threads in [1, 2, 5] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let bake = || Sweeper::new().bake(mesh, size, UNOBSERVED).unwrap();
            assert_eq!(pool.build().unwrap().install(bake), expected);
        }
    }
}

/// The comparison itself must detect each of these errors.
#[test]
fn the_comparison_detects_changed_meshes() {
    let whole: Vec<Corners> = Model::Table.mesh(None).unwrap().corners().collect();
    let mesh = prepared(&mesh_of(&whole), [12; 3]);
    let Parity { bits, .. } = compare(&mesh, 8);
    let mut one_less = whole.clone();
    one_less.remove(7);
    let spec = *mesh.spec();
    let moved: Vec<Corners> = whole
        .iter()
        .map(|t| t.map(|[x, y, z]| [x + 0.002, y, z]))
        .collect();
    for (what, triangles) in [("a hole", one_less), ("a push", moved)] {
        let other = mesh_of(&triangles);
        let other = PreparedMesh::new(&other, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
        let differences = bits.differences(&QuantizedMeshRays::new(&other).faces(8));
        assert!(differences.len() > 10, "{what}: {}", differences.len());
        let far = differences.iter().filter(|&&d| graze(&mesh, 8, d) > 1e-3);
        assert!(far.count() > 0, "{what}: all graze an edge");
    }
}

/// One cell sees an edge along a row of its texels, closer than single floats can tell: three of
/// the texels were wrong before double precision decided.
#[test]
fn an_edge_along_a_row_of_texels_matches() {
    let mesh = mesh_of(&[[[0.0, 1.0, -1.0], [-4.0, 0.0, -1.0], [0.0; 3]]]);
    let spec = GridSpec::new([10, 10, 11], [0.25, 0.0, -0.125], [7.0, 6.0, 8.0]).unwrap();
    let mesh = PreparedMesh::new(&mesh, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
    assert_parity(&compare(&mesh, 14), MAX_MISMATCHES_CPU, "a triangle");
}

/// Resolutions and face sizes are low, so that this takes seconds.
#[test]
fn real_meshes_match() {
    let Some(folder) = shared("data/meshes") else {
        return;
    };
    for path in files_with_ending(&folder, ".obj") {
        let loaded = mesh::load(&path).unwrap().mesh;
        if loaded.triangles().len() > 300_000 {
            continue;
        }
        let parity = compare(&prepared(&loaded, [8; 3]), 8);
        assert_parity(&parity, MAX_MISMATCHES_CPU, &path.display().to_string());
    }
}

/// Compares other face sizes: `cargo test -p aogrid-tests -- --ignored --nocapture faces_of`.
#[test]
#[ignore = "a billion rays take minutes"]
fn faces_of_other_sizes_match() {
    let Some(folder) = shared("data/meshes") else {
        return;
    };
    for name in ["fandisk.obj", "teapot.obj", "bunny_16k_nonmanifold.obj"] {
        let mesh = prepared(&mesh::load(&folder.join(name)).unwrap().mesh, [16; 3]);
        for size in [8, 11, 16, 24, 32, 64, 128] {
            let parity = compare(&mesh, size);
            assert_parity(
                &parity,
                MAX_MISMATCHES_CPU,
                &format!("{name}, faces of {size}"),
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Compares a few vertices and any triangles over them: open, non-manifold, degenerate, on
    /// whole numbers where faces and edges coincide.
    #[test]
    fn any_small_mesh_matches(
        points in prop::collection::vec([-4_i8..5, -4_i8..5, -4_i8..5], 3..10),
        corners in prop::collection::vec([0_u32..10, 0_u32..10, 0_u32..10], 1..20),
        resolution in [8_u32..14, 8_u32..14, 8_u32..14],
        size in 8_u32..19,
    ) {
        let point = |i: u32| points[i as usize % points.len()].map(f32::from);
        let triangles: Vec<Corners> = corners.iter().map(|t| t.map(point)).collect();
        // Triangles without area alone are no mesh.
        prop_assume!(triangles.iter().any(|[a, b, c]| {
            (0..3).any(|x| {
                let (y, z) = ((x + 1) % 3, (x + 2) % 3);
                (b[y] - a[y]) * (c[z] - a[z]) != (b[z] - a[z]) * (c[y] - a[y])
            })
        }));
        let mesh = mesh_of(&triangles);
        let extents = [7.0, 6.0, 8.0];
        let spec = GridSpec::new(resolution, [0.25, 0.0, -0.125], extents).unwrap();
        let mesh = PreparedMesh::new(&mesh, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
        let bake = Sweeper::new().bake_with_bits(&mesh, size, UNOBSERVED).unwrap();
        let parity = Parity::new(&mesh, size, bake);
        prop_assert_eq!(parity.fault(), None);
        prop_assert!(parity.differences.is_empty(), "{:?}", parity.differences);
    }
}
