use aogrid_bake_core::models::Model;
use aogrid_bake_core::{
    BakeOptions, FaceBits, PreparedMesh, RawGrid, TriangleMesh, UNOBSERVED, mesh,
};
use aogrid_baker_cpu::parity::Parity;
use aogrid_baker_gpu::{Context, Sweeper, UploadedMesh};
use aogrid_grid_format::GridSpec;
use aogrid_tests::{files_with_ending, gpu, mesh_of, shared};

use crate::parity::{
    Corners, MAX_MISMATCHES_GPU, assert_parity, compare, prepared, soup, stack_of_sheets,
};

/// A sweeper and the device that it waits for.
struct Sweep(Sweeper, &'static Context);

impl Sweep {
    fn new(context: &'static Context) -> Self {
        Self(Sweeper::new(context), context)
    }

    fn upload(&mut self, mesh: PreparedMesh) -> UploadedMesh {
        self.1.block_on(self.0.upload(mesh)).unwrap()
    }

    fn bake(&mut self, mesh: &UploadedMesh, size: u32) -> RawGrid {
        let bake = self.0.bake(mesh, size, true, UNOBSERVED);
        self.1.block_on(bake).unwrap()
    }
}

fn compare_gpu(sweep: &mut Sweep, mesh: PreparedMesh, size: u32) -> Parity {
    let uploaded = sweep.upload(mesh);
    let bake = sweep.0.bake_with_bits(&uploaded, size, UNOBSERVED);
    let bake = sweep.1.block_on(bake);
    Parity::new(uploaded.mesh(), size, bake.unwrap())
}

/// Asserts that the GPU's sweep matches the CPU's rays, and that its moments equal those of the
/// CPU's own sweep bit for bit in cells where both see the same texels.
fn assert_matches_the_cpu(sweeper: &mut Sweep, mesh: &TriangleMesh, n: [u32; 3], size: u32) {
    let parity = compare_gpu(sweeper, prepared(mesh, n), size);
    assert_parity(&parity, MAX_MISMATCHES_GPU, &format!("{n:?} {size}"));
    let cpu = compare(&prepared(mesh, n), size);
    let differing: Vec<_> = cpu.bits.differences(&parity.bits);
    for cell in 0..cpu.raw.counts.len() {
        if !differing.iter().any(|(odd, _)| *odd == cell) {
            assert_eq!(parity.raw.counts[cell], cpu.raw.counts[cell]);
            assert_eq!(parity.raw.moments[cell], cpu.raw.moments[cell]);
        }
    }
}

#[test]
fn models_match_at_any_resolution_and_face_size() {
    let Some(context) = gpu() else { return };
    let mut sweeper = Sweep::new(context);
    for (sample, resolution, size) in [
        (Model::Table, [12, 9, 10], 16),
        (Model::Robot, [16, 21, 11], 8),
        (Model::SpaceShip, [24, 10, 33], 13),
        (Model::Torus, [8, 35, 8], 17),
        (Model::LShape, [8; 3], 40),
        // More cells along an axis than a brick has.
        (Model::Robot, [8, 9, 270], 8),
    ] {
        let mesh = sample.mesh(None).unwrap();
        assert_matches_the_cpu(&mut sweeper, &mesh, resolution, size);
    }
}

#[test]
fn soups_and_hundreds_of_layers_match() {
    let Some(context) = gpu() else { return };
    let mut sweeper = Sweep::new(context);
    let robot: Vec<Corners> = Model::Robot.mesh(None).unwrap().corners().collect();
    let open: Vec<Corners> = robot.iter().step_by(2).copied().collect();
    let wound: Vec<Corners> = (0..)
        .zip(&robot)
        .map(|(i, t)| if i % 3 == 0 { [t[0], t[2], t[1]] } else { *t })
        .collect();
    let copies = stack_of_sheets(1).repeat(256);
    for (what, triangles) in [
        ("open", open),
        ("inconsistently wound", wound),
        ("soup", soup(2000, 0.3)),
        ("300 layers", stack_of_sheets(300)),
        ("256 copies", copies),
    ] {
        let mesh = prepared(&mesh_of(&triangles), [8, 12, 8]);
        assert_parity(
            &compare_gpu(&mut sweeper, mesh, 8),
            MAX_MISMATCHES_GPU,
            what,
        );
    }
}

/// Small triangles, stacked by the hundreds, lie between the lines of all rows: their layers are
/// counted at edge crossings, and nowhere else.
#[test]
fn layers_without_row_hits_are_counted() {
    let Some(context) = gpu() else { return };
    let mut triangles: Vec<Corners> = Vec::new();
    for (at, n) in [([0.0, 0.0, 0.0], 400_u16), ([2.0, 1.0, 1.5], 256)] {
        for layer in 0..n {
            let [x, z] = [at[0], at[2]];
            let y = at[1] + f32::from(layer) * 1e-5;
            triangles.push([[x, y, z], [x + 0.2, y + 0.05, z], [x, y + 0.1, z + 0.2]]);
        }
    }
    let mesh = prepared(&mesh_of(&triangles), [8, 12, 8]);
    let parity = compare_gpu(&mut Sweep::new(context), mesh, 16);
    assert_parity(&parity, MAX_MISMATCHES_GPU, "between the rows");
}

/// The mesh's bounds cut rows of cells in different ways: boxes lie within the mesh, beside it,
/// across its surface and far away, and their cells are no cubes.
#[test]
fn grids_that_do_not_enclose_the_mesh_match() {
    let Some(context) = gpu() else { return };
    let mut sweeper = Sweep::new(context);
    let mesh = Model::Robot.mesh(None).unwrap();
    let [low, high] = [mesh.bounds().min, mesh.bounds().max];
    let middle: [f32; 3] = std::array::from_fn(|x| (low[x] + high[x]) / 2.0);
    let half: [f32; 3] = std::array::from_fn(|x| (high[x] - low[x]) / 2.0);
    for (what, [along, across], scale) in [
        ("within", [0.0, 0.0], [0.4, 0.5, 0.6]),
        ("beside", [1.5, 0.0], [0.7, 0.7, 0.7]),
        ("cutting", [0.9, -0.8], [0.5, 2.0, 0.9]),
        ("far", [-6.0, 1.0], [2.0, 1.0, 1.5]),
    ] {
        let center = [
            middle[0] + along * half[0],
            middle[1] + across * half[1],
            middle[2],
        ];
        let extents = std::array::from_fn(|x| half[x] * scale[x]);
        let spec = GridSpec::new([12, 9, 14], center, extents).unwrap();
        let prepared = PreparedMesh::new(&mesh, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
        assert_parity(
            &compare_gpu(&mut sweeper, prepared, 16),
            MAX_MISMATCHES_GPU,
            what,
        );
    }
}

#[test]
fn real_meshes_match() {
    let (Some(folder), Some(context)) = (shared("data/meshes"), gpu()) else {
        return;
    };
    let mut sweeper = Sweep::new(context);
    for path in files_with_ending(&folder, ".obj") {
        let loaded = mesh::load(&path).unwrap().mesh;
        if loaded.triangles().len() < 100_000 {
            let parity = compare_gpu(&mut sweeper, prepared(&loaded, [8; 3]), 8);
            assert_parity(&parity, MAX_MISMATCHES_GPU, &path.display().to_string());
        }
    }
}

#[test]
fn a_warm_sweeper_gives_the_same_bits() {
    let Some(context) = gpu() else { return };
    let mut warm = Sweep::new(context);
    for (sample, n, size) in [
        (Model::SpaceShip, [8, 9, 30], 9),
        (Model::Table, [20; 3], 16),
        (Model::SpaceShip, [8, 9, 30], 9),
    ] {
        let mesh = || prepared(&sample.mesh(None).unwrap(), n);
        let uploaded = warm.upload(mesh());
        let first = warm.bake(&uploaded, size);
        assert_eq!(warm.bake(&uploaded, size), first);
        let mut cold = Sweep::new(context);
        let uploaded = cold.upload(mesh());
        assert_eq!(cold.bake(&uploaded, size), first);
    }
}

/// Returns permuted bits: `source` gives the cell and texel that each bit is taken from.
fn permuted(
    bits: &FaceBits,
    size: u32,
    source: impl Fn(usize, usize) -> (usize, usize),
) -> FaceBits {
    let mut all = FaceBits::new(bits.cells(), size);
    for cell in 0..bits.cells() {
        for texel in 0..bits.texels() {
            let (source_cell, source_texel) = source(cell, texel);
            if bits.get(source_cell, source_texel) {
                all.set(cell, texel);
            }
        }
    }
    all
}

/// The comparison itself must detect each of these errors.
#[test]
fn the_comparison_detects_wrong_bits() {
    let Some(context) = gpu() else { return };
    let (n, size) = (10_usize, 8_u32);
    let triangles: Vec<Corners> = Model::Table.mesh(None).unwrap().corners().collect();
    let mesh = || prepared(&mesh_of(&triangles), [n as u32; 3]);
    let mut sweeper = Sweep::new(context);
    let Parity { bits, .. } = compare_gpu(&mut sweeper, mesh(), size);
    let s = size as usize;
    let shifted = permuted(&bits, size, |cell, texel| {
        ((cell + 1) % bits.cells(), texel)
    });
    let mirrored = permuted(&bits, size, |cell, texel| {
        // Mirror the first face left to right.
        let column = texel % s;
        let is_first = texel < s * s;
        (
            cell,
            if is_first {
                texel - column + s - 1 - column
            } else {
                texel
            },
        )
    });
    let transposed = permuted(&bits, size, |cell, texel| {
        let (x, y, z) = (cell % n, cell / n % n, cell / (n * n));
        ((z * n + x) * n + y, texel)
    });
    for (what, wrong) in [
        ("a shifted cell", shifted),
        ("a mirrored face", mirrored),
        ("a transposed axis", transposed),
    ] {
        let found = wrong.differences(&bits).len();
        assert!(found > 100 * MAX_MISMATCHES_GPU, "{what}: {found}");
    }
    let spec = *mesh().spec();
    let dropped = mesh_of(&[&triangles[..7], &triangles[8..]].concat());
    let dropped = PreparedMesh::new(&dropped, spec, BakeOptions::SAMPLE_OFFSET).unwrap();
    let dropped = compare_gpu(&mut sweeper, dropped, size).bits;
    let found = dropped.differences(&bits).len();
    assert!(
        found > 10 * MAX_MISMATCHES_GPU,
        "a dropped triangle: {found}"
    );
}
