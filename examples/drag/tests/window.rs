//! Tests that the window shows an object and its shadow, on a virtual display.
#![cfg(target_os = "linux")]

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use aogrid_gpu_support::{brightness, color, gpu, picture, skip};

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
fn the_window_shows_an_object_and_its_shadow() {
    let (Some(_turn), Some(display)) = (gpu(), Display::new()) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let png = folder.path().join("out.png");
    let screenshot = |keys: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_aogrid-drag"));
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
    // Raster and tiles agree, up to a half float and a byte. The table, whose far field reaches the
    // foot, hides other directions than the robot: merging finds that, and multiplying does not.
    let [multiplied, merged, tiled, tiled_merged] = shadows;
    assert!((multiplied - tiled).abs() < 0.005 && (merged - tiled_merged).abs() < 0.005);
    assert!(merged < multiplied && multiplied - merged < 0.02);

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
    for (idx, (reddened, under)) in axes.into_iter().enumerate() {
        // Tiles as by raster, multiplied or merged.
        assert!(reddened > 1.05 && (reddened - axes[idx % 2].0).abs() < 0.01);
        // The same amount of light is removed, in other colors, and only once.
        assert!((under - darkened.1).abs() < 0.05);
    }
}
