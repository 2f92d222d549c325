//! Where surfaces behind one another count twice: the table of `docs/volumes.md`, with tolerances.

use super::{FLOOR, NOISE, mean, rmse, scene_with, shaded};

/// The change of a figure of the table that is noticed: a digit of it.
const SNAPSHOT: f64 = 2e-3;

/// The rays of a receiver, whose noise is far below the errors of the table.
const SAMPLES: u32 = 1024;

const UNLIMITED: &str = "[volumes]\nextent = 100\nweight = 'none'\n";

/// Returns the mean AO by volumes and by rays, and the root mean square of their difference.
fn compared(text: &str) -> [f64; 3] {
    let shaded = shaded(&scene_with(SAMPLES, text));
    let [volumes, truth] = &shaded;
    [mean(volumes), mean(truth), rmse(&shaded)]
}

fn assert_snapshot(name: &str, found: [f64; 3], expected: [f64; 3]) {
    let [volumes, truth, error] = found;
    println!("{name}: volumes {volumes:.3}, truth {truth:.3}, rmse {error:.3}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found - expected).abs() <= SNAPSHOT,
            "{name}: {found} {expected}"
        );
    }
    assert!(volumes >= truth - NOISE, "{name}: {volumes} {truth}");
}

/// Returns slabs above one another.
fn stack(count: usize, extent: f64) -> String {
    let mut text = format!(
        "[volumes]\nextent = {extent}\nweight = 'none'\n[[mesh]]\nname = 'slab'\nsample = 'box'\n{FLOOR}"
    );
    for slab in 0..count {
        let y = 0.4 + 0.4 * slab as f64;
        text += &format!(
            "[[instance]]\nmesh = 'slab'\nscale = [1, 0.02, 1]\ntranslate = [0, {y}, 0]\n"
        );
    }
    text
}

#[test]
fn stacked_slabs_count_each() {
    let rows = [
        (1, [0.107, 0.107, 0.003]),
        (2, [0.197, 0.141, 0.103]),
        (4, [0.3175, 0.172, 0.204]),
        (8, [0.437, 0.190, 0.292]),
    ];
    for (count, expected) in rows {
        let found = compared(&stack(count, 100.0));
        assert_snapshot(&format!("{count} slabs"), found, expected);
    }
    // Only the lowest slab's lower side is within reach.
    let [near, ..] = compared(&stack(8, 0.5));
    let [near_of_one, ..] = compared(&stack(1, 0.5));
    assert!((near - near_of_one).abs() <= 1e-6, "{near} {near_of_one}");
}

#[test]
fn parallel_walls_count_each() {
    let rows = [
        (0.1, [0.090, 0.056, 0.040]),
        (0.5, [0.089, 0.078, 0.016]),
        (1.0, [0.085, 0.084, 0.005]),
    ];
    for (gap, expected) in rows {
        let x = gap / 2.0 + 0.005;
        let text = format!(
            "{UNLIMITED}{FLOOR}[[mesh]]\nname = 'wall'\nsample = 'box'\n\
             [[instance]]\nmesh = 'wall'\nscale = [0.01, 1, 1]\ntranslate = [{x}, 0.5, 0]\n\
             [[instance]]\nmesh = 'wall'\nscale = [0.01, 1, 1]\ntranslate = [-{x}, 0.5, 0]\n"
        );
        assert_snapshot(&format!("walls {gap} apart"), compared(&text), expected);
    }
}

#[test]
fn the_far_side_of_a_ring_counts_too() {
    let text = format!(
        "{UNLIMITED}{FLOOR}[[mesh]]\nname = 'ring'\nsample = 'torus'\n\
         [[instance]]\nmesh = 'ring'\ntranslate = [0, 0.25, 0]\n"
    );
    assert_snapshot("ring", compared(&text), [0.274, 0.273, 0.005]);
}
