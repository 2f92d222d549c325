use aogrid_bake_core::models::Model;
use aogrid_bake_core::surface::{SurfaceOptions, default_offset, face_centers};
use aogrid_bake_core::{BakeOptions, UNOBSERVED};
use aogrid_baker_cpu::{RayScene, bake_surface};
use aogrid_baker_gpu::Caster;
use aogrid_grid_format::Sampling;
use aogrid_tests::gpu;

use super::{bake, placed};
use crate::parity::MAX_MISMATCHES_GPU;

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
            ..BakeOptions::paper()
        };
        let uploaded = context
            .block_on(caster.upload(&mesh, spec, options.sample_offset))
            .unwrap();
        let (raw, bits) = context
            .block_on(caster.bake_with_bits(&uploaded, &options, UNOBSERVED))
            .unwrap();
        let again = context
            .block_on(caster.bake(&uploaded, &options, true, UNOBSERVED))
            .unwrap();
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
            ..BakeOptions::paper()
        };
        let mut caster = Caster::new(context);
        let uploaded = context
            .block_on(caster.upload(&mesh, spec, options.sample_offset))
            .unwrap();
        let naive = context
            .block_on(caster.bake_naively(&uploaded, &options))
            .unwrap();
        let tree = context
            .block_on(caster.bake(&uploaded, &options, true, UNOBSERVED))
            .unwrap();
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
            ..BakeOptions::paper()
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

/// Points on a surface: the records of the CPU but for single bits, with and without a ground.
#[test]
fn rays_from_points_match_the_cpu() {
    let Some(context) = gpu() else { return };
    let mesh = Model::Robot.mesh(None).unwrap();
    let points = face_centers(&mesh, default_offset(&mesh)).points;
    for (rays, max_distance, ground) in [
        (40, None, None),
        (96, Some(0.3), Some(-0.2)),
        (1, None, None),
    ] {
        let options = SurfaceOptions {
            rays,
            max_distance,
            ground,
            ..SurfaceOptions::recommended()
        };
        let mut caster = Caster::new(context);
        let found = context.block_on(caster.bake_points(&mesh, &points, &options, UNOBSERVED));
        let found = found.unwrap();
        let cpu = bake_surface(&mesh, &points, &options, None, UNOBSERVED).unwrap();
        assert_eq!((found.records.len(), found.rays), (points.len(), cpu.rays));
        let pairs = found.records.iter().zip(&cpu.records);
        let different = pairs.filter(|(a, b)| a != b).count();
        println!("{rays} rays: {different} of {} points differ", points.len());
        // A bit is wrong where a ray passes an edge within some 10⁻⁷ of its length.
        assert!(different <= 1, "{different}");
        assert!(cpu.records.iter().any(|r| r.accessibility < 0.9) || rays == 1);
    }
}
