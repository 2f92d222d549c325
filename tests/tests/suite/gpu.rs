use aogrid_bake_core::UNOBSERVED;
use aogrid_bake_core::samples::Sample;
use aogrid_baker_gpu::Sweeper;
use aogrid_tests::{compare_gpu, gpu, prepared};

#[test]
fn samples_are_alike_at_any_resolution_and_face_size() {
    let Some(context) = gpu() else { return };
    let mut sweeper = Sweeper::new(context);
    for (sample, resolution, size) in [
        (Sample::Box, [8, 8, 8], 16),
        (Sample::Table, [12, 9, 10], 16),
        (Sample::Robot, [16, 21, 11], 8),
        (Sample::SpaceShip, [24, 10, 33], 13),
        (Sample::Torus, [8, 35, 8], 17),
        (Sample::Sphere, [9, 9, 40], 24),
        (Sample::LShape, [8, 8, 8], 128),
    ] {
        let mesh = prepared(&sample.mesh(None).unwrap(), resolution);
        let parity = compare_gpu(&mut sweeper, &mesh, size);
        println!(
            "{}: {} of {} differ, occluded {}",
            sample.name(),
            parity.differences.len(),
            parity.texels,
            parity.occluded
        );
        let cpu = aogrid_baker_cpu::Sweeper::new()
            .bake(&mesh, size, UNOBSERVED)
            .unwrap();
        let n = cpu
            .moments
            .iter()
            .zip(&parity.raw.moments)
            .filter(|(a, b)| a != b)
            .count();
        println!("  moments differ in {n}");
    }
}
