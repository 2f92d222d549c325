//! Closed models whose parts are thin, close together or full of corners.

use std::f64::consts::TAU;

use super::builder::Builder;
use super::open::NO_OPENINGS;

/// Adds a comb: nine teeth that hang from a back, and end in it.
pub(super) fn comb(model: &mut Builder) {
    model
        .part("back")
        .cuboid([-0.7, 0.6, -0.04], [0.7, 0.8, 0.04]);
    for tooth in 0..9 {
        let x = -0.67 + 0.16 * f64::from(tooth);
        model
            .part("tooth")
            .cuboid([x, 0.0, -0.03], [x + 0.06, 0.7, 0.03]);
    }
}

/// The number of stairs.
const N_STAIRS: usize = 5;

/// Adds solid stairs that climb toward +x.
pub(super) fn stairs(model: &mut Builder) {
    const N: usize = N_STAIRS;
    const Z: [f64; 2] = [-0.4, 0.4];
    let x = |i: usize| 0.24 * i as f64 - 0.6;
    let y = |j: usize| 0.2 * j as f64;
    model.part("stairs");
    // The sides, in squares: stair i is i + 1 squares high.
    model.panel([N, N], |i, j| [x(i), y(j), Z[1]], |i, j| j > i);
    model.panel([N, N], |i, j| [x(N - i), y(j), Z[0]], |i, j| j > N - 1 - i);
    model.panel([N, 1], |i, j| [x(i), 0.0, Z[j]], NO_OPENINGS);
    model.panel([1, N], |i, j| [x(N), y(j), Z[1 - i]], NO_OPENINGS);
    for stair in 0..N {
        let tread = |i: usize, j: usize| [x(stair + i), y(stair + 1), Z[1 - j]];
        model.panel([1, 1], tread, NO_OPENINGS);
        let riser = |i: usize, j: usize| [x(stair), y(stair + j), Z[i]];
        model.panel([1, 1], riser, NO_OPENINGS);
    }
}

/// Adds two rings through each other, one level and one upright.
pub(super) fn rings(model: &mut Builder) {
    const N: [usize; 2] = [32, 12];
    /// The radii of a ring and of its tube.
    const RADII: [f64; 2] = [0.45, 0.12];
    let point = |ring: usize, side: usize| {
        let angle = |i: usize, n: usize| TAU * (i % n) as f64 / n as f64;
        let ((sin, cos), (up, out)) = (angle(ring, N[0]).sin_cos(), angle(side, N[1]).sin_cos());
        let distance = RADII[0] + RADII[1] * out;
        [distance * cos, RADII[1] * up, distance * sin]
    };
    let height = RADII[0] + RADII[1];
    // The order of the indices makes the faces wind counter-clockwise seen from outside.
    let level = |j: usize, i: usize| {
        let [x, y, z] = point(i, j);
        [x - 0.5 * RADII[0], y + height, z]
    };
    let upright = |j: usize, i: usize| {
        let [x, y, z] = point(i, j);
        [x + 0.5 * RADII[0], height - z, y]
    };
    model.part("level").panel([N[1], N[0]], level, NO_OPENINGS);
    model
        .part("upright")
        .panel([N[1], N[0]], upright, NO_OPENINGS);
}
