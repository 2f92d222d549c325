//! Tests that the examples run and draw the expected images.

use std::io::{BufRead, BufReader, Write, stderr};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use aogrid_bake_core::models::Model;
use aogrid_bake_core::{BakeOptions, Placement, UNOBSERVED, post};
use aogrid_grid_format::Source;
use image::RgbaImage;

/// The environment variable that makes a missing adapter or display a failure.
const VARIABLE: &str = "AOGRID_GPU";

fn skip(why: &str) {
    let demanded = std::env::var(VARIABLE).is_ok_and(|v| v == "require");
    assert!(!demanded, "{VARIABLE}=require, but: {why}");
    let _ = writeln!(stderr(), "SKIPPED examples: {why}");
}

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

fn has_adapter() -> bool {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()));
    adapter
        .inspect_err(|error| skip(&error.to_string()))
        .is_ok()
}

/// Runs a command to its end and reads the image that it writes.
fn picture(command: &mut Command, png: &Path) -> RgbaImage {
    let output = command.output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(!said.contains("alidation"), "{said}");
    image::open(png).expect("a picture").into_rgba8()
}

/// Returns the mean brightness of 8×8 pixels around a point, whose coordinates are 0..1 of the
/// image's size.
fn brightness(picture: &RgbaImage, x: f32, y: f32) -> f32 {
    color(picture, x, y).iter().sum::<f32>() / 3.0
}

/// Returns the mean of 8×8 pixels around a point, for each color channel.
fn color(picture: &RgbaImage, x: f32, y: f32) -> [f32; 3] {
    let at = |t: f32, size: u32| (t * size as f32) as u32 - 4;
    let (x, y) = (at(x, picture.width()), at(y, picture.height()));
    let pixels = (0..64).map(|i| picture.get_pixel(x + i % 8, y + i / 8).0);
    pixels.fold([0.0; 3], |sum, pixel| {
        std::array::from_fn(|c| sum[c] + f32::from(pixel[c]) / (64.0 * 255.0))
    })
}

fn robot() -> Vec<u8> {
    let mesh = Model::Robot.mesh(None).unwrap();
    let (placement, options) = (Placement::default(), BakeOptions::recommended());
    let spec = placement.place(&mesh.bounds()).unwrap();
    let raw = aogrid_baker_cpu::bake(&mesh, spec, &options, UNOBSERVED).unwrap();
    let source = Source {
        name: "robot".into(),
        part: None,
        blake3: "0".repeat(64),
        triangles: 1,
    };
    post::finish(raw, &placement, &options, source)
        .unwrap()
        .to_bytes()
}

#[test]
fn the_smallest_program_draws_a_shadow_on_a_floor() {
    let (Some(example), true) = (example("headless"), has_adapter()) else {
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
    let (Some(example), true) = (example("transparent"), has_adapter()) else {
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

/// A virtual display.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn new() -> Option<Self> {
        let server = Command::new("Xvfb")
            // Without `-noreset` the server restarts after each window and is unavailable
            // meanwhile.
            .args(["-displayfd", "1", "-noreset", "-screen", "0", "1024x768x24"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let Ok(mut server) = server else {
            skip("no Xvfb to open a window on");
            return None;
        };
        // The server prints the number of its display once it is ready.
        let mut line = String::new();
        let stdout = server.stdout.take().expect("it is piped");
        BufReader::new(stdout)
            .read_line(&mut line)
            .expect("it answers");
        Some(Self {
            server,
            name: format!(":{}", line.trim()),
        })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

#[test]
#[cfg(target_os = "linux")]
fn the_window_shows_an_object_and_its_shadow() {
    let (Some(example), true) = (example("drag"), has_adapter()) else {
        return;
    };
    let Some(display) = Display::new() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let png = folder.path().join("out.png");
    let screenshot = |keys: &str| {
        let mut command = Command::new(&example);
        command
            .arg("--screenshot")
            .arg(&png)
            .args(keys.split(' '))
            .env("DISPLAY", &display.name);
        picture(&mut command, &png)
    };
    // The robot's chest is open to the sky: only scalar occlusion knows, by ids, that the robot
    // itself hides half of the directions.
    let [open, occlusion] = ["1", "2"].map(|key| brightness(&screenshot(key), 0.5, 0.37));
    assert!((occlusion - open).abs() < 0.05, "{occlusion} {open}");
    // Cones multiplied by raster, merged by raster, and both in tiles.
    let shadows = ["3", "4", "5", "6"].map(|key| {
        let picture = screenshot(key);
        // The floor beside the robot's foot, and far in front of it, both lit alike.
        let (under, front) = (
            brightness(&picture, 0.53, 0.635),
            brightness(&picture, 0.5, 0.93),
        );
        println!("{key}: {under} {front}");
        assert!(under < front - 0.05, "{key}: {under} {front}");
        under
    });
    // Near a single object all methods agree, up to a half float and a byte.
    assert!(shadows.iter().all(|s| (s - shadows[0]).abs() < 0.005));

    // Between a red wall on the left and a blue one on the right the robot hides blue light from
    // the floor to its left, and red light from that to its right. Scalar occlusion darkens both
    // sides alike.
    let lit = ["1 e", "2 e", "3 e", "4 e", "5 e", "6 e"].map(|keys| {
        let picture = screenshot(keys);
        let [left, right] = [(0.44, 0.6), (0.53, 0.635)].map(|(x, y)| {
            let [red, _, blue] = color(&picture, x, y);
            red / blue
        });
        let under = brightness(&picture, 0.53, 0.635);
        println!("{keys}: {left} {right}, {under}");
        (left / right, under)
    });
    let [open, darkened, axes @ ..] = lit;
    assert!((open.0 - 1.0).abs() < 0.01 && (darkened.0 - 1.0).abs() < 0.01);
    assert!(darkened.1 < open.1 - 0.03);
    for (reddened, under) in axes {
        assert!(reddened > 1.05 && (reddened - axes[0].0).abs() < 0.01);
        // The same amount of light is removed, in other colors, and only once.
        assert!((under - darkened.1).abs() < 0.05);
    }
}
