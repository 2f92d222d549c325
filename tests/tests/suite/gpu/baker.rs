use std::ops::ControlFlow;

use aogrid_bake_core::Classification;
use aogrid_bake_core::models::Model;
use aogrid_bake_core::{
    Algorithm, BakeOptions, PipelineError, Placement, PlanError, Preset, Progress, RawGrid,
    RayFallbackReason, UNOBSERVED, bake_grid, post, post::Refinements,
};
use aogrid_baker_gpu::{BakeError, Baker};
use aogrid_grid_format::{BakeRecord, Encoding, Sampling, TexelFormat};
use aogrid_tests::{exact_options, gpu, grid};

use super::{bake, bake_by, placed};
use crate::analytic;

#[test]
fn a_ball_and_a_box_have_the_exact_occlusion() {
    let Some(context) = gpu() else { return };
    let ball = Model::Sphere.mesh(Some(81_920)).unwrap();
    let options = exact_options();
    analytic::assert_ball(&bake(context, &ball, placed(&ball, 32), &options));
    let cube = Model::Box.mesh(None).unwrap();
    analytic::assert_box(&cube, &bake(context, &cube, placed(&cube, 32), &options));
}

#[test]
fn the_algorithm_is_chosen_as_on_the_cpu() {
    let Some(context) = gpu() else { return };
    let mesh = Model::Table.mesh(None).unwrap();
    let spec = placed(&mesh, 8);
    let faces = BakeOptions::paper();
    let near = BakeOptions {
        max_distance: Some(1.0),
        ..faces
    };
    let mut baker = Baker::new(context, None);
    assert_eq!(
        context
            .block_on(baker.prepare(&mesh, spec, &faces))
            .unwrap()
            .algorithm(),
        Algorithm::DirectionSweep
    );
    let rays = context.block_on(baker.prepare(&mesh, spec, &near)).unwrap();
    assert_eq!(
        (rays.algorithm(), rays.fallback_reason()),
        (Algorithm::RayCasting, Some(&RayFallbackReason::MaxDistance))
    );
    let mut sweep = Baker::new(context, Some(Algorithm::DirectionSweep));
    let refused = context.block_on(sweep.prepare(&mesh, spec, &near)).err();
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
            ..BakeOptions::paper()
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
            let grid = post::finish(
                raw,
                &Refinements::default(),
                &Placement::paper(),
                &options,
                source,
            );
            grid.unwrap().texels().to_vec()
        };
        assert_eq!(texels(raw), texels(with_directions));
    }
}

/// The near-surface fit takes the moments of two bakes; on the GPU these differ from the CPU's by
/// texels whose rays graze an edge.
#[test]
fn the_default_preset_is_the_same_as_on_the_cpu() {
    /// The largest RMS difference of a channel: one of a lattice point's 384 directions changes a
    /// by 1/384, which the fit spreads over eight cells, at a few points in a thousand.
    const TOLERANCE: f64 = 5e-4;
    let Some(context) = gpu() else { return };
    let mesh = Model::Robot.mesh(None).unwrap();
    let placement = Placement {
        resolution: [16; 3],
        ..Preset::Default.placement()
    };
    let options = BakeOptions {
        format: TexelFormat::F32,
        ..Preset::Default.options()
    };
    let on_cpu = grid(&mesh, &placement, &options);
    let source = on_cpu.record().source.clone();
    let visibility = |spec, options: &BakeOptions| -> Result<RawGrid, PipelineError> {
        Ok(bake(context, &mesh, spec, options))
    };
    let on_gpu = bake_grid(&mesh, &placement, &options, source, visibility).unwrap();
    let [a, b] = [&on_gpu, &on_cpu].map(|grid| grid.record().clone());
    // The far field is fitted to points whose fractions differ as little.
    let far = (0..4).map(|x| (a.flatness[x] - b.flatness[x]).abs());
    assert!(far.fold(0.0, f32::max) <= 0.02, "{:?}", a.flatness);
    let flatness = a.flatness;
    assert_eq!(a, BakeRecord { flatness, ..b });
    let pairs = on_gpu.decode().into_iter().zip(on_cpu.decode());
    let squares: Vec<f64> = pairs.map(|(a, b)| f64::from(a - b).powi(2)).collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!(rms <= TOLERANCE, "{rms}");
    // The fit did something: without it, the same cells differ far more.
    let unfitted = BakeOptions {
        fit: false,
        ..options
    };
    let unfitted = grid(&mesh, &placement, &unfitted).decode();
    let pairs = unfitted.into_iter().zip(on_cpu.decode());
    let squares = pairs.map(|(a, b)| f64::from(a - b).powi(2));
    assert!((squares.sum::<f64>() / on_cpu.decode().len() as f64).sqrt() > 20.0 * TOLERANCE);
}

#[test]
fn a_bake_reports_progress_and_can_be_cancelled() {
    let Some(context) = gpu() else { return };
    let mesh = Model::Table.mesh(None).unwrap();
    let spec = placed(&mesh, 24);
    let mut options = BakeOptions::paper();
    for max_distance in [None, Some(3.0)] {
        options.max_distance = max_distance;
        let mut baker = Baker::new(context, None);
        let mut ready = context
            .block_on(baker.prepare(&mesh, spec, &options))
            .unwrap();
        let stop = |_: Progress| ControlFlow::Break(());
        assert_eq!(
            context.block_on(ready.bake(&stop)),
            Err(BakeError::Cancelled)
        );
        // The state that a cancelled bake leaves must not affect the next.
        let max_done = std::sync::atomic::AtomicUsize::new(0);
        let watch = |progress: Progress| {
            max_done.fetch_max(progress.done, std::sync::atomic::Ordering::Relaxed);
            ControlFlow::Continue(())
        };
        let raw = context.block_on(ready.bake(&watch)).unwrap();
        assert_eq!(max_done.into_inner(), spec.cell_count());
        assert_eq!(raw, bake(context, &mesh, spec, &options));
    }
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
            ..Placement::paper()
        };
        let spec = placement.place(&mesh.bounds()).unwrap();
        let faces = BakeOptions::paper();
        let by_cpu = |kernel, options: &BakeOptions| {
            let mut baker = aogrid_baker_cpu::Baker::new(kernel);
            let mut prepared = baker.prepare(&mesh, spec, options).unwrap();
            prepared.bake(UNOBSERVED).unwrap()
        };
        let by_gpu = |kernel| {
            bake_by(
                &mut Baker::new(context, kernel),
                context,
                &mesh,
                spec,
                &faces,
            )
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
