use std::ops::ControlFlow;

use aogrid_bake_core::models::Model;
use aogrid_bake_core::post::Classification;
use aogrid_bake_core::{
    Algorithm, BakeOptions, FaceBits, Placement, PlanError, PreparedMesh, Progress, RawGrid,
    RayFallbackReason, TriangleMesh, UNOBSERVED, mesh, post,
};
use aogrid_baker_cpu::RayScene;
use aogrid_baker_cpu::parity::Parity;
use aogrid_baker_gpu::wgpu::Limits;
use aogrid_baker_gpu::{AdapterSelector, BakeError, Baker, Caster, Context, ContextError, Sweeper};
use aogrid_grid_format::{Encoding, GridSpec, Sampling};
use aogrid_tests::{exact_options, files_with_ending, gpu, mesh_of, shared};

use crate::analytic;
use crate::parity::{
    Corners, MAX_MISMATCHES_GPU, assert_parity, compare, prepared, soup, stack_of_sheets,
};

fn compare_gpu(sweeper: &mut Sweeper, mesh: PreparedMesh, size: u32) -> Parity {
    let uploaded = sweeper.upload(mesh).unwrap();
    let bake = sweeper.bake_with_bits(&uploaded, size, UNOBSERVED);
    Parity::new(uploaded.mesh(), size, bake.unwrap())
}

/// Asserts that the GPU's sweep matches the CPU's rays, and that its moments equal those of the
/// CPU's own sweep bit for bit in cells where both see the same texels.
fn assert_matches_the_cpu(sweeper: &mut Sweeper, mesh: &TriangleMesh, n: [u32; 3], size: u32) {
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
    let mut sweeper = Sweeper::new(context);
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
    let mut sweeper = Sweeper::new(context);
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
    let parity = compare_gpu(&mut Sweeper::new(context), mesh, 16);
    assert_parity(&parity, MAX_MISMATCHES_GPU, "between the rows");
}

/// The mesh's bounds cut rows of cells in different ways: boxes lie within the mesh, beside it,
/// across its surface and far away, and their cells are no cubes.
#[test]
fn grids_that_do_not_enclose_the_mesh_match() {
    let Some(context) = gpu() else { return };
    let mut sweeper = Sweeper::new(context);
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
    let mut sweeper = Sweeper::new(context);
    for path in files_with_ending(&folder, ".obj") {
        let loaded = mesh::load(&path).unwrap().mesh;
        if loaded.triangles().len() < 100_000 {
            let parity = compare_gpu(&mut sweeper, prepared(&loaded, [8; 3]), 8);
            assert_parity(&parity, MAX_MISMATCHES_GPU, &path.display().to_string());
        }
    }
}

fn placed(mesh: &TriangleMesh, n: u32) -> GridSpec {
    let placement = Placement {
        resolution: [n; 3],
        ..Placement::default()
    };
    placement.place(&mesh.bounds()).unwrap()
}

fn bake(context: &Context, mesh: &TriangleMesh, spec: GridSpec, o: &BakeOptions) -> RawGrid {
    let mut baker = Baker::new(context, None);
    let mut ready = baker.prepare(mesh, spec, o).unwrap();
    ready.bake(UNOBSERVED).unwrap()
}

#[test]
fn a_ball_and_a_box_have_the_exact_occlusion() {
    let Some(context) = gpu() else { return };
    let ball = Model::Sphere.mesh(Some(81_920)).unwrap();
    let options = exact_options();
    analytic::assert_ball(&bake(context, &ball, placed(&ball, 32), &options));
    let cube = Model::Box.mesh(None).unwrap();
    analytic::assert_box(&cube, &bake(context, &cube, placed(&cube, 32), &options));
}

/// The largest share of texels in which rays in single precision, on a lattice, may differ from
/// double precision. They differ where a ray passes an edge within some 10⁻⁷ of its length. Per
/// cell of the grid a silhouette is a few cells long, and 2·10⁻⁷ cells wide there; this is ten
/// times that for safety.
const MAX_MISMATCH_RATE: f64 = 2e-6;

#[test]
fn rays_with_and_without_a_maximum_distance_match_the_cpu() {
    let Some(context) = gpu() else { return };
    let mesh = Model::SpaceShip.mesh(None).unwrap();
    let spec = placed(&mesh, 8);
    let mut caster = Caster::new(context);
    for (max_distance, size) in [(None, 16), (Some(0.4), 9), (Some(1.5), 24)] {
        let options = BakeOptions {
            sampling: Sampling::CubeFaces { size },
            max_distance,
            ..BakeOptions::recommended()
        };
        let uploaded = caster.upload(&mesh, spec, options.sample_offset).unwrap();
        let (raw, bits) = caster
            .bake_with_bits(&uploaded, &options, UNOBSERVED)
            .unwrap();
        let again = caster.bake(&uploaded, &options, true, UNOBSERVED).unwrap();
        assert!(again == raw, "with bits and without");
        let cpu = RayScene::new(&mesh)
            .bake(spec, &options, UNOBSERVED)
            .unwrap();
        let off: u32 = (0..raw.counts.len())
            .map(|cell| raw.counts[cell].abs_diff(cpu.counts[cell]))
            .sum();
        let texels = bits.cells() * bits.texels();
        println!("{max_distance:?}: {off} of {texels} differ");
        assert!(f64::from(off) <= 1.0 + MAX_MISMATCH_RATE * texels as f64);
        assert!(raw.counts.iter().any(|n| *n > 0));
    }
}

/// The naive kernel, the BVH and the sweep give the same result.
#[test]
fn the_naive_kernel_matches_the_others() {
    let Some(context) = gpu() else { return };
    for (sample, size) in [(Model::Box, 16), (Model::Table, 8), (Model::LShape, 16)] {
        let mesh = sample.mesh(None).unwrap();
        let spec = placed(&mesh, 9);
        let options = BakeOptions {
            sampling: Sampling::CubeFaces { size },
            ..BakeOptions::recommended()
        };
        let mut caster = Caster::new(context);
        let uploaded = caster.upload(&mesh, spec, options.sample_offset).unwrap();
        let naive = caster.bake_naively(&uploaded, &options).unwrap();
        let tree = caster.bake(&uploaded, &options, true, UNOBSERVED).unwrap();
        assert!(naive == tree, "{sample:?}");
        let sweep = bake(context, &mesh, spec, &options);
        let off: u32 = (0..naive.counts.len())
            .map(|cell| naive.counts[cell].abs_diff(sweep.counts[cell]))
            .sum();
        assert!(
            off <= MAX_MISMATCHES_GPU as u32 && naive.counts.iter().any(|n| *n > 0),
            "{off}"
        );
    }
}

#[test]
fn random_rays_match_the_cpu() {
    let Some(context) = gpu() else { return };
    let mesh = Model::Robot.mesh(None).unwrap();
    let spec = placed(&mesh, 8);
    for (count, seed) in [(1, 0), (100, 7), (700, u64::MAX)] {
        let options = BakeOptions {
            sampling: Sampling::MonteCarlo { count, seed },
            ..BakeOptions::recommended()
        };
        let raw = bake(context, &mesh, spec, &options);
        let cpu = RayScene::new(&mesh)
            .bake(spec, &options, UNOBSERVED)
            .unwrap();
        let mut off = 0;
        for cell in 0..raw.counts.len() {
            off += usize::from(raw.counts[cell] != cpu.counts[cell]);
            // A direction's components are single floats: 2⁻²⁴ each, and so is the mean.
            let (a, b) = (raw.moments[cell], cpu.moments[cell]);
            if raw.counts[cell] == cpu.counts[cell] {
                assert_eq!(a.a, b.a);
                let near = |x: usize| (a.m[x] - b.m[x]).abs() <= 2.0 * f32::EPSILON;
                assert!((0..3).all(near), "{a:?} {b:?}");
            }
        }
        assert!(off <= 1, "{count}: {off} cells");
        assert!(raw.counts.iter().any(|n| *n > 0));
    }
}

#[test]
fn the_algorithm_is_chosen_as_on_the_cpu() {
    let Some(context) = gpu() else { return };
    let mesh = Model::Table.mesh(None).unwrap();
    let spec = placed(&mesh, 8);
    let faces = BakeOptions::recommended();
    let near = BakeOptions {
        max_distance: Some(1.0),
        ..faces
    };
    let mut baker = Baker::new(context, None);
    assert_eq!(
        baker.prepare(&mesh, spec, &faces).unwrap().algorithm(),
        Algorithm::DirectionSweep
    );
    let rays = baker.prepare(&mesh, spec, &near).unwrap();
    assert_eq!(
        (rays.algorithm(), rays.fallback_reason()),
        (Algorithm::RayCasting, Some(&RayFallbackReason::MaxDistance))
    );
    let mut sweep = Baker::new(context, Some(Algorithm::DirectionSweep));
    let refused = sweep.prepare(&mesh, spec, &near).err();
    assert_eq!(
        refused,
        Some(PlanError::NoSweep(RayFallbackReason::MaxDistance).into())
    );
}

#[test]
fn baking_occlusion_alone_gives_the_same_occlusion() {
    let Some(context) = gpu() else { return };
    let mesh = Model::Robot.mesh(None).unwrap();
    let spec = placed(&mesh, 12);
    for max_distance in [None, Some(2.0)] {
        let options = BakeOptions {
            encoding: Encoding::Occlusion,
            max_distance,
            ..BakeOptions::recommended()
        };
        let raw = bake(context, &mesh, spec, &options);
        let both = BakeOptions {
            encoding: Encoding::Cone,
            ..options
        };
        let with_directions = bake(context, &mesh, spec, &both);
        assert!(raw.moments.iter().all(|m| m.m == [0.0; 3]));
        assert!(with_directions.moments.iter().any(|m| m.m != [0.0; 3]));
        assert_eq!(raw.counts, with_directions.counts);
        let texels = |raw: RawGrid| {
            let source = aogrid_grid_format::Source {
                name: "test.obj".into(),
                part: None,
                blake3: "0".repeat(64),
                triangles: 1,
            };
            let grid = post::finish(raw, &Placement::default(), &options, source);
            grid.unwrap().texels().to_vec()
        };
        assert_eq!(texels(raw), texels(with_directions));
    }
}

#[test]
fn a_warm_sweeper_gives_the_same_bits() {
    let Some(context) = gpu() else { return };
    let mut warm = Sweeper::new(context);
    for (sample, n, size) in [
        (Model::SpaceShip, [8, 9, 30], 9),
        (Model::Table, [20; 3], 16),
        (Model::SpaceShip, [8, 9, 30], 9),
    ] {
        let mesh = || prepared(&sample.mesh(None).unwrap(), n);
        let uploaded = warm.upload(mesh()).unwrap();
        let first = warm.bake(&uploaded, size, true, UNOBSERVED).unwrap();
        assert_eq!(warm.bake(&uploaded, size, true, UNOBSERVED).unwrap(), first);
        let mut cold = Sweeper::new(context);
        let uploaded = cold.upload(mesh()).unwrap();
        assert_eq!(cold.bake(&uploaded, size, true, UNOBSERVED).unwrap(), first);
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
    let mut sweeper = Sweeper::new(context);
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

#[test]
fn a_bake_reports_progress_and_can_be_cancelled() {
    let Some(context) = gpu() else { return };
    let mesh = Model::Table.mesh(None).unwrap();
    let spec = placed(&mesh, 24);
    let mut options = BakeOptions::recommended();
    for max_distance in [None, Some(3.0)] {
        options.max_distance = max_distance;
        let mut baker = Baker::new(context, None);
        let mut ready = baker.prepare(&mesh, spec, &options).unwrap();
        let stop = |_: Progress| ControlFlow::Break(());
        assert_eq!(ready.bake(&stop), Err(BakeError::Cancelled));
        // The state that a cancelled bake leaves must not affect the next.
        let max_done = std::sync::atomic::AtomicUsize::new(0);
        let watch = |progress: Progress| {
            max_done.fetch_max(progress.done, std::sync::atomic::Ordering::Relaxed);
            ControlFlow::Continue(())
        };
        let raw = ready.bake(&watch).unwrap();
        assert_eq!(max_done.into_inner(), spec.cell_count());
        assert_eq!(raw, bake(context, &mesh, spec, &options));
    }
}

/// Returns a device for one test alone.
fn own_device(limits: Limits) -> Option<Context> {
    gpu()?;
    let instance = aogrid_baker_gpu::wgpu::Instance::new(
        aogrid_baker_gpu::wgpu::InstanceDescriptor::new_without_display_handle(),
    );
    let backends = aogrid_baker_gpu::wgpu::Backends::PRIMARY;
    let adapters = pollster::block_on(instance.enumerate_adapters(backends));
    let name = &gpu()?.adapter().name;
    let adapter = adapters.iter().find(|a| a.get_info().name == *name)?;
    Some(Context::with_limits(adapter, limits).expect("it gives another device"))
}

#[test]
fn a_lost_device_is_an_error_and_no_panic() {
    let mesh = Model::Table.mesh(None).unwrap();
    let spec = placed(&mesh, 24);
    let mut options = BakeOptions::recommended();
    for max_distance in [None, Some(3.0)] {
        options.max_distance = max_distance;
        let Some(context) = own_device(Limits::defaults()) else {
            return;
        };
        let mut baker = Baker::new(&context, None);
        let mut ready = baker.prepare(&mesh, spec, &options).unwrap();
        let destroy = |_: Progress| {
            context.device().destroy();
            ControlFlow::Continue(())
        };
        let lost = ready.bake(&destroy);
        assert!(matches!(lost, Err(BakeError::Lost(_))), "{lost:?}");
        drop(ready);
        let again = baker.prepare(&mesh, spec, &options).err();
        assert!(matches!(again, Some(BakeError::Lost(_))), "{again:?}");
        // The loss of a caller's device is detected, too.
        let theirs = own_device(Limits::defaults()).unwrap();
        let ours = Context::from_device(theirs.device(), theirs.queue());
        let mut baker = Baker::new(&ours, None);
        let mut ready = baker.prepare(&mesh, spec, &options).unwrap();
        theirs.device().destroy();
        let lost = ready.bake(UNOBSERVED);
        assert!(matches!(lost, Err(BakeError::Lost(_))), "{lost:?}");
    }
}

#[test]
fn small_limits_give_the_same_grid_or_an_error_that_says_so() {
    let mut small_limits = Limits::defaults();
    // WebGPU guarantees 128 times this.
    small_limits.max_storage_buffer_binding_size = 1 << 20;
    small_limits.max_buffer_size = 1 << 26;
    let Some(context) = own_device(small_limits) else {
        return;
    };
    let Some(usual) = gpu() else { return };
    let options = BakeOptions::recommended();
    let mesh = Model::Robot.mesh(None).unwrap();
    let spec = placed(&mesh, 16);
    let expected = bake(usual, &mesh, spec, &options);
    assert_eq!(bake(&context, &mesh, spec, &options), expected);
    let large = Model::Sphere.mesh(Some(100_000)).unwrap();
    let spec = placed(&large, 8);
    let mut baker = Baker::new(&context, None);
    let error = baker.prepare(&large, spec, &options).err();
    assert!(
        matches!(error, Some(BakeError::TooLarge { .. })),
        "{error:?}"
    );
}

#[test]
fn a_missing_adapter_is_named() {
    let error = Context::new(&AdapterSelector::Named("Voodoo 2".into())).err();
    assert!(matches!(error, Some(ContextError::NotFound { .. })));
    let message = error.unwrap().to_string();
    assert!(
        message.starts_with("no adapter is named like `Voodoo 2`"),
        "{message}"
    );
}

#[test]
fn every_baker_finds_the_same_interior() {
    let Some(context) = gpu() else {
        return;
    };
    for sample in [Model::House, Model::Patchwork, Model::Bowl, Model::Robot] {
        let mesh = sample.mesh(None).unwrap();
        let placement = Placement {
            resolution: [12, 10, 9],
            ..Placement::default()
        };
        let spec = placement.place(&mesh.bounds()).unwrap();
        let faces = BakeOptions::recommended();
        let by_cpu = |kernel, options: &BakeOptions| {
            let mut baker = aogrid_baker_cpu::Baker::new(kernel);
            let mut prepared = baker.prepare(&mesh, spec, options).unwrap();
            prepared.bake(UNOBSERVED).unwrap()
        };
        let by_gpu = |kernel| {
            let mut baker = Baker::new(context, kernel);
            let mut prepared = baker.prepare(&mesh, spec, &faces).unwrap();
            prepared.bake(UNOBSERVED).unwrap()
        };
        let sweep = by_cpu(Some(Algorithm::DirectionSweep), &faces);
        let expected = Classification::of(&sweep);
        assert_eq!(sweep.layers.is_none(), sample == Model::Robot, "{sample:?}");
        for raw in [
            by_cpu(Some(Algorithm::RayCasting), &faces),
            by_gpu(Some(Algorithm::DirectionSweep)),
            by_gpu(Some(Algorithm::RayCasting)),
        ] {
            assert_eq!(raw.layers, sweep.layers, "{sample:?}");
            assert_eq!(Classification::of(&raw), expected, "{sample:?}");
        }
        // Layers classify cells even if no cell is enclosed, and ignore the maximum distance.
        let near = BakeOptions {
            max_distance: Some(0.01),
            ..faces
        };
        let random = BakeOptions {
            sampling: Sampling::MonteCarlo { count: 64, seed: 1 },
            ..faces
        };
        for options in [near, random] {
            assert_eq!(by_cpu(None, &options).layers, sweep.layers, "{sample:?}");
        }
    }
}
