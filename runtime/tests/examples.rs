//! Tests that the examples run and draw the expected images.

use std::path::PathBuf;
use std::process::Command;

use aogrid_bake_core::models::Model;
use aogrid_bake_core::{Preset, UNOBSERVED};
use aogrid_gpu_support::{brightness, gpu, picture, skip};
use aogrid_grid_format::Source;

/// Returns the path of a built example, in the folder beside the test's own.
fn example(name: &str) -> Option<PathBuf> {
    let test = std::env::current_exe().unwrap();
    let folder = test.parent().unwrap().parent().unwrap().join("examples");
    let path = folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    if !path.exists() {
        skip(&format!(
            "example `{name}` is not built; run all tests of the package"
        ));
        return None;
    }
    Some(path)
}

fn robot() -> Vec<u8> {
    let mesh = Model::Robot.mesh(None).unwrap();
    let (placement, options) = (Preset::Default.placement(), Preset::Default.options());
    let source = Source {
        name: "robot".into(),
        part: None,
        blake3: "0".repeat(64),
        triangles: 1,
    };
    aogrid_baker_cpu::bake_grid(&mesh, &placement, &options, source, UNOBSERVED)
        .unwrap()
        .to_bytes()
}

#[test]
fn the_smallest_program_draws_a_shadow_on_a_floor() {
    let (Some(example), Some(_turn)) = (example("headless"), gpu()) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (grid, png) = (
        folder.path().join("robot.ao.ktx2"),
        folder.path().join("out.png"),
    );
    std::fs::write(&grid, robot()).unwrap();
    let picture = picture(Command::new(example).arg(grid).arg(&png), &png);
    assert_eq!(picture.dimensions(), (512, 512));
    let (under, beside) = (
        brightness(&picture, 0.523, 0.531),
        brightness(&picture, 0.05, 0.05),
    );
    assert!(under < beside - 0.1 && beside > 0.8, "{under} {beside}");
}

#[test]
fn glass_is_darker_near_objects() {
    let (Some(example), Some(_turn)) = (example("transparent"), gpu()) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let png = folder.path().join("out.png");
    let picture = picture(Command::new(example).arg(&png), &png);
    assert_eq!(picture.dimensions(), (640, 400));
    // The pane behind a table's edge, and above it.
    let (near, above) = (
        brightness(&picture, 0.547, 0.545),
        brightness(&picture, 0.547, 0.46),
    );
    println!("{near} {above}");
    assert!(near < above - 0.05, "{near} {above}");
}
