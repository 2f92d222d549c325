//! Tests of environments against the labels of the orientation map, and of the format's rules.

use std::path::{Path, PathBuf};

use aogrid_scene::reference::Environment;
use aogrid_scene::{LoadOptions, parse};
use aogrid_tests::{files_with_ending, shared};
use glam::DVec3;

type Vector = [f64; 3];

/// Returns an environment and its warnings, from the lines of its table in a scene.
fn environment(lines: &str) -> anyhow::Result<(Environment, Vec<String>)> {
    let text = format!("[environment]\n{lines}\n");
    let scene = parse(Path::new("test.toml"), &text, LoadOptions::default())?;
    Ok(scene.environment.unwrap().load()?)
}

fn file(path: &Path) -> String {
    format!("file = '{}'", path.display())
}

/// A map whose six sides differ, as a room.
const ROOM: &str = "room.right = [1, 0, 0]\nroom.left = [0, 1, 0]\nroom.ceiling = [0, 0, 1]\n\
                    room.floor = [1, 1, 0]\nroom.front = [0, 1, 1]\nroom.back = [1, 0, 1]";

const AXES: [(Vector, [f32; 3]); 6] = [
    ([1.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
    ([-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
    ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
    ([0.0, -1.0, 0.0], [1.0, 1.0, 0.0]),
    ([0.0, 0.0, 1.0], [0.0, 1.0, 1.0]),
    ([0.0, 0.0, -1.0], [1.0, 0.0, 1.0]),
];

#[test]
fn a_room_s_walls_lie_in_the_stated_directions() {
    let (room, _) = environment(ROOM).unwrap();
    let (turned, _) = environment(&format!("{ROOM}\nyaw = 90")).unwrap();
    let (z_up, _) = environment(&format!("{ROOM}\nup = 'z'")).unwrap();
    for ([x, y, z], color) in AXES {
        assert_eq!(room.radiance([x, y, z]), color);
        // A quarter turn about y, counterclockwise seen from above: x goes to −z, z to x.
        assert_eq!(turned.radiance([z, y, -x]), color);
        // The map's y is world z; its z is world −y.
        assert_eq!(z_up.radiance([x, -z, y]), color);
    }
    let (dim, _) = environment(&format!("{ROOM}\nscale = 0.5")).unwrap();
    assert_eq!(dim.radiance([1.0, 0.1, 0.1]), [0.5, 0.0, 0.0]);
}

fn orientation() -> Option<Environment> {
    let path = shared("data/env/OrientationLatLong.exr")?;
    let (environment, warnings) = environment(&file(&path)).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(environment.size(), [1024, 512], "the largest level");
    Some(environment)
}

/// Returns the picture around the axis `forward`, with the axis `above` upwards, for a range of
/// angles to the right and up in degrees.
fn ascii(
    environment: &Environment,
    forward: DVec3,
    above: DVec3,
    right: [i32; 2],
    up: [i32; 2],
) -> String {
    let across = forward.cross(above);
    let half_degrees = |range: [i32; 2]| (2 * range[0]..2 * range[1]).map(|v| f64::from(v) / 2.0);
    let mut picture = String::new();
    for up in half_degrees(up).rev() {
        for right in half_degrees(right) {
            let (r, u) = (right.to_radians().tan(), up.to_radians().tan());
            let direction = forward + r * across + u * above;
            let [_, _, blue] = environment.radiance(direction.into());
            // Letters are black on a light blue background.
            picture.push(if blue < 0.5 { '#' } else { '.' });
        }
        picture.push('\n');
    }
    picture
}

const X: DVec3 = DVec3::X;
const Y: DVec3 = DVec3::Y;
const Z: DVec3 = DVec3::Z;

#[test]
fn each_axis_points_at_its_printed_label() {
    let Some(map) = orientation() else { return };
    let mut pictures = String::new();
    // The labels are below their axes; on the floor the label is above the axis.
    let below = [-12, -5];
    for (name, forward, above, up) in [
        ("+X", X, Y, below),
        ("-X", -X, Y, below),
        ("+Z", Z, Y, below),
        ("-Z", -Z, Y, below),
        ("+Y", Y, Z, below),
        ("-Y", -Y, -Z, [1, 8]),
    ] {
        pictures += &format!("{name}\n{}", ascii(&map, forward, above, [-12, 12], up));
    }
    assert_eq!(pictures, LABELS, "\n{pictures}");
}

/// Lines run from the middle of every side along the positive axes.
#[test]
fn lines_lead_from_each_axis_towards_the_other_positive_ones() {
    let Some(map) = orientation() else { return };
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            for other in (0..3).filter(|&o| o != axis) {
                let dark = |side: f64| {
                    let at = |step: i32| {
                        let mut d = [0.0; 3];
                        d[axis] = sign;
                        d[other] = side * f64::from(step) / 40.0;
                        map.radiance(d)[2] < 0.5
                    };
                    (3..15).filter(|&step| at(step)).count()
                };
                assert!(dark(1.0) > 9, "{axis} {sign} {other}: {}", dark(1.0));
                assert!(dark(-1.0) < 4, "{axis} {sign} {other}: {}", dark(-1.0));
            }
        }
    }
}

#[test]
fn real_maps_of_every_kind_are_read() {
    let Some(folder) = shared("data/env") else {
        return;
    };
    let mut read = 0;
    for ending in [".exr", ".hdr"] {
        for path in files_with_ending(&folder, ending) {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            let result = environment(&file(&path));
            if name.ends_with("Cube.exr") {
                let error = format!("{:#}", result.unwrap_err());
                assert!(
                    error.contains(&name) && error.contains("cube map"),
                    "{error}"
                );
                continue;
            }
            let (map, warnings) = result.unwrap();
            // DWAB compression rings below zero.
            let is_warned = warnings.iter().any(|w| w.contains("negative"));
            assert_eq!(
                is_warned,
                name.ends_with("dwab.exr"),
                "{name}: {warnings:?}"
            );
            let [r, g, b] = mean(&map);
            println!("{name}: {r:.5} {g:.5} {b:.5}");
            if let Some(expected) = MEANS.iter().find(|(known, _)| *known == name) {
                for (ours, theirs) in [r, g, b].into_iter().zip(expected.1) {
                    // The other program prints five digits and counts negative texels.
                    assert!(
                        (ours / theirs - 1.0).abs() < 0.01,
                        "{name}: {ours} {theirs}"
                    );
                }
            }
            read += 1;
        }
    }
    assert_eq!(read, 7);
}

/// Mean radiances by other programs (OpenEXR itself, and a reader of RGBE).
const MEANS: [(&str, Vector); 5] = [
    ("venice_dwab.exr", [0.40495, 0.64997, 1.3149]),
    ("studio_dwab.exr", [1.9695, 2.2619, 2.5531]),
    ("StageEnvLatLong.exr", [2.7816, 3.5719, 5.0148]),
    ("OrientationLatLong.exr", [0.89587, 0.93263, 0.97409]),
    ("spiaggia_di_mondello_1k.hdr", [0.81221, 0.84593, 0.87723]),
];

/// Returns the mean radiance, weighted by solid angle.
fn mean(map: &Environment) -> Vector {
    let [width, height] = map.size();
    let (mut sum, mut weights) = ([0.0; 3], 0.0);
    for (row, texels) in map.texels().chunks_exact(width).enumerate() {
        let latitude = std::f64::consts::PI * (0.5 - (row as f64 + 0.5) / height as f64);
        let weight = latitude.cos();
        for texel in texels {
            for c in 0..3 {
                sum[c] += weight * f64::from(texel[c]);
            }
            weights += weight;
        }
    }
    sum.map(|v| v / weights)
}

#[test]
fn invalid_maps_are_rejected_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| -> PathBuf {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    for (path, why) in [
        (folder.path().join("missing.exr"), "No such file"),
        (folder.path().to_owned(), "regular file"),
        (write("empty.exr", b""), "neither"),
        (write("text.hdr", b"radiance"), "neither"),
        (
            write("short.exr", &[0x76, 0x2f, 0x31, 0x01, 2]),
            "short.exr",
        ),
        (write("short.hdr", b"#?RADIANCE\n"), "short.hdr"),
        (
            write(
                "huge.hdr",
                b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n",
            ),
            "scale it down",
        ),
    ] {
        let error = format!("{:#}", environment(&file(&path)).unwrap_err());
        assert!(
            error.contains(why) && error.contains(path.to_str().unwrap()),
            "{error}"
        );
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

/// The labels as seen from the center. The first four match what another program cuts out of the
/// file; those of the ceiling and the floor are shown upright, as one reads them.
const LABELS: &str = "\
+X
...............#.....##.........................
...............##...##..........................
................#...##..........................
................##..##..........................
.......#.........###............................
.......#.........###............................
.......#.........####...........................
...#########....##..#...........................
...#########....#...##..........................
.......#.......##....##.........................
.......#......##.....##.........................
.......#.....##.......##........................
................................................
................................................
-X
....................................###....###..
.....................................##....##...
.......................................#..##....
.......................................####.....
........................................###.....
........................................##......
.......................................####.....
.........................#########.....##.#.....
.............................#####....##..##....
.....................................##....##...
....................................###....###..
....................................##......##..
................................................
................................................
+Z
...........................................###..
...........................................###..
..........................................##....
.........................................##.....
.............................##..........##.....
.............................##.........##......
.............................##........##.......
..........................########.....##.......
.............................#####....##........
.............................##.....###.........
.............................##.....###.........
.............................##.....##########..
................................................
................................................
-Z
....................##..........................
....................##..........................
...................##...........................
..................##............................
.................###............................
.................##.............................
...............##...............................
..#########....##...............................
....#######...###...............................
.............##.................................
.............##.................................
.............#########..........................
................................................
................................................
+Y
..............##......##........................
..............##.....##.........................
...............#....##..........................
...............##...##..........................
......##........##.##...........................
.................###............................
......#..........###............................
......#.###.......#.............................
..#########.......#.............................
......##..........#.............................
......##..........#.............................
.......#..........#.............................
..................#.............................
................................................
-Y
................................................
.......................#........................
.............##.......##........................
.............###.....###........................
..............##.....##.........................
...............##...##..........................
...............##..##...........................
................##.##...........................
.................###............................
.................###............................
...####.###.......#.............................
..##########.....##.............................
.................##.............................
..................#.............................
";
