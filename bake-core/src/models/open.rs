//! Open models: with holes or without thickness, as in users' files.

use std::f64::consts::{PI, TAU};

use super::builder::Builder;

/// The opening predicate of a panel without openings.
pub(super) const NO_OPENINGS: fn(usize, usize) -> bool = |_, _| false;

/// Adds a box without its bottom. If `inward`, the faces are flipped.
fn box_without_bottom(model: &mut Builder, min: [f64; 3], max: [f64; 3], inward: bool) {
    let ([x0, y0, z0], [x1, y1, z1]) = (min, max);
    let faces = [
        [[x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]],
        [[x1, y0, z0], [x0, y0, z0], [x0, y1, z0], [x1, y1, z0]],
        [[x1, y0, z1], [x1, y0, z0], [x1, y1, z0], [x1, y1, z1]],
        [[x0, y0, z0], [x0, y0, z1], [x0, y1, z1], [x0, y1, z0]],
        [[x0, y1, z1], [x1, y1, z1], [x1, y1, z0], [x0, y1, z0]],
    ];
    let order = if inward { [0, 3, 2, 1] } else { [0, 1, 2, 3] };
    for face in faces {
        let corners = order.map(|corner| face[corner]);
        let at = |i: usize, j: usize| corners[[[0, 3], [1, 2]][i][j]];
        model.panel([1, 1], at, NO_OPENINGS);
    }
}

/// Adds a unit cube without its bottom.
pub(super) fn open_box(model: &mut Builder) {
    model.part("box");
    box_without_bottom(model, [-0.5, 0.0, -0.5], [0.5, 1.0, 0.5], false);
}

/// Adds two boxes without bottoms, one with a corner inside the other.
pub(super) fn open_boxes(model: &mut Builder) {
    model.part("low");
    box_without_bottom(model, [-0.7, 0.0, -0.5], [0.1, 0.6, 0.3], false);
    model.part("high");
    box_without_bottom(model, [-0.1, 0.0, -0.1], [0.6, 1.0, 0.5], false);
}

/// Adds a box without a roof, whose walls and floor face inward.
pub(super) fn room(model: &mut Builder) {
    model.part("room");
    let from = model.positions.len();
    box_without_bottom(model, [-0.7, 0.0, -0.5], [0.7, 0.8, 0.5], true);
    // A rotation by half a turn keeps the winding and makes the open bottom the open top.
    for p in &mut model.positions[from..] {
        *p = [p[0], 0.8 - p[1], -p[2]];
    }
}

/// Adds walls, floor and gable roof without thickness, with a door, and a window in each wall.
pub(super) fn house(model: &mut Builder) {
    const XS: [f64; 6] = [-0.6, -0.12, 0.12, 0.3, 0.48, 0.6];
    const YS: [f64; 4] = [0.0, 0.3, 0.5, 0.7];
    const ZS: [f64; 4] = [-0.5, -0.15, 0.15, 0.5];
    const RIDGE: f64 = 1.1;
    let window = |column: usize| move |i: usize, j: usize| i == column && j == 1;
    model.part("walls");
    let door_or_window = |i: usize, j: usize| i == 1 && j < 2 || window(3)(i, j);
    model.panel([5, 3], |i, j| [XS[i], YS[j], 0.5], door_or_window);
    model.panel([5, 3], |i, j| [XS[5 - i], YS[j], -0.5], window(3));
    model.panel([3, 3], |i, j| [0.6, YS[j], ZS[3 - i]], window(1));
    model.panel([3, 3], |i, j| [-0.6, YS[j], ZS[i]], window(1));
    // The two gables.
    for x in [0.6, -0.6] {
        let apex = model.shared_vertex([x, RIDGE, 0.0]);
        for pair in ZS.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|z| model.shared_vertex([x, 0.7, z]));
            model.triangle(if x > 0.0 { [b, a, apex] } else { [a, b, apex] });
        }
    }
    model.part("roof");
    let slope = [0.7, RIDGE];
    model.panel([5, 1], |i, j| [XS[i], slope[j], [0.5, 0.0][j]], NO_OPENINGS);
    model.panel(
        [5, 1],
        |i, j| [XS[5 - i], slope[j], [-0.5, 0.0][j]],
        NO_OPENINGS,
    );
    model.part("floor");
    model.panel([5, 3], |i, j| [XS[i], 0.0, ZS[j]], NO_OPENINGS);
}

/// Adds a wavy cloth without thickness, facing up.
pub(super) fn sheet(model: &mut Builder) {
    const N: usize = 16;
    let at = |i: usize, j: usize| {
        let [x, z] = [i, N - j].map(|v| 2.0 * v as f64 / N as f64 - 1.0);
        [
            x,
            0.3 + 0.1 * (1.3 * PI * x).sin() * (0.9 * PI * z).cos(),
            z,
        ]
    };
    model.part("sheet").panel([N, N], at, NO_OPENINGS);
}

/// Adds the lower half of a hollow sphere without thickness, facing outward, standing on its pole.
pub(super) fn bowl(model: &mut Builder) {
    const AROUND: usize = 32;
    const RINGS: usize = 8;
    const RADIUS: f64 = 0.6;
    let at = |i: usize, ring: usize| {
        let (down, around) = (
            0.5 * PI * ring as f64 / RINGS as f64,
            // The azimuth decreases with i, so that faces wind counter-clockwise seen from outside.
            -TAU * (i % AROUND) as f64 / AROUND as f64,
        );
        let radius = RADIUS * down.sin();
        [
            radius * around.cos(),
            RADIUS * (1.0 - down.cos()),
            radius * around.sin(),
        ]
    };
    model.part("bowl");
    model.panel([AROUND, RINGS - 1], |i, j| at(i, j + 1), NO_OPENINGS);
    let pole = model.shared_vertex(at(0, 0));
    for i in 0..AROUND {
        let [a, b] = [i, i + 1].map(|i| model.shared_vertex(at(i, 1)));
        model.triangle([pole, b, a]);
    }
}

/// Adds a tree of cards: two crossed ones for the trunk, six for the crown.
pub(super) fn card_tree(model: &mut Builder) {
    /// Half the width and half the height of a card of the crown.
    const CARD: [f64; 2] = [0.38, 0.3];
    model.part("cards");
    let mut card = |center: [f64; 3], half: [f64; 2], yaw: f64, lean: f64| {
        let ((sin, cos), (back, up)) = (yaw.sin_cos(), lean.sin_cos());
        let at = |i: usize, j: usize| {
            let [s, t] =
                [(i, half[0]), (j, half[1])].map(|(i, half)| (2.0 * i as f64 - 1.0) * half);
            [
                center[0] + s * cos + t * back * sin,
                center[1] + t * up,
                center[2] - s * sin + t * back * cos,
            ]
        };
        model.panel([1, 1], at, NO_OPENINGS);
    };
    for yaw in [0.3, 0.3 + 0.25 * TAU] {
        card([0.0, 0.35, 0.0], [0.06, 0.35], yaw, 0.0);
    }
    for idx in 0..6 {
        let yaw = 0.6 + TAU * f64::from(idx) / 6.0;
        let (sin, cos) = yaw.sin_cos();
        let height = 0.85 + 0.12 * f64::from(idx % 3);
        card([0.18 * sin, height, 0.18 * cos], CARD, yaw, 0.5);
    }
}

/// Adds a pipe along x without thickness or ends, facing outward.
pub(super) fn pipe(model: &mut Builder) {
    const AROUND: usize = 24;
    const ALONG: usize = 6;
    const RADIUS: f64 = 0.35;
    let at = |i: usize, j: usize| {
        let (sin, cos) = (TAU * (i % AROUND) as f64 / AROUND as f64).sin_cos();
        let x = 1.6 * j as f64 / ALONG as f64 - 0.8;
        [x, RADIUS - RADIUS * cos, -RADIUS * sin]
    };
    model.part("pipe").panel([AROUND, ALONG], at, NO_OPENINGS);
}

/// Removes some triangles, and flips about every fifth of the others.
pub(super) fn break_up(model: &mut Builder) {
    // Knuth's multiplicative hash, reduced to 0..256.
    let hash = |idx: usize| (idx as u32).wrapping_mul(2_654_435_769) >> 16 & 0xff;
    let triangles = std::mem::take(&mut model.triangles);
    let part_of = std::mem::take(&mut model.part_of);
    for (idx, (mut corners, part)) in triangles.into_iter().zip(part_of).enumerate() {
        match hash(idx) {
            0..6 => continue,
            6..56 => corners.swap(0, 1),
            _ => {}
        }
        model.triangles.push(corners);
        model.part_of.push(part);
    }
}
