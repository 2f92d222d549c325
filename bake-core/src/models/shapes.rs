//! The shapes of the closed models.

use std::f64::consts::TAU;

use super::builder::{Builder, Ring};
use super::{Model, closed, open};

/// The projection of a point to a model's surface, on which refinement puts new vertices.
pub(super) type Surface = fn([f64; 3]) -> [f64; 3];

/// Builds a model. The sphere and the torus have coarser forms, of at most `requested` triangles.
pub(super) fn build(sample: Model, requested: Option<usize>) -> Builder {
    let mut model = Builder::default();
    match sample {
        Model::Box => {
            let part = model.part("box");
            part.cuboid([-0.5, 0.0, -0.5], [0.5, 1.0, 0.5]);
        }
        Model::Table => table(&mut model),
        Model::Torus => torus(&mut model, requested),
        Model::LShape => {
            let part = model.part("slab");
            part.cuboid([-0.6, 0.0, -0.6], [0.6, 0.2, 0.6]);
            let part = model.part("wall");
            part.cuboid([-0.6, 0.2, -0.6], [-0.4, 1.2, 0.6]);
        }
        Model::Sphere => sphere(&mut model, requested),
        Model::Robot => robot(&mut model),
        Model::SpaceShip => space_ship(&mut model),
        Model::Wall => {
            let part = model.part("wall");
            part.cuboid([-0.75, 0.0, -0.01], [0.75, 1.0, 0.01]);
        }
        Model::Comb => closed::comb(&mut model),
        Model::Stairs => closed::stairs(&mut model),
        Model::Rings => closed::rings(&mut model),
        Model::Rod => {
            let part = model.part("rod");
            part.limb([-1.0, 0.03, 0.0], [1.0, 0.03, 0.0], [0.03, 0.03]);
        }
        Model::OpenBox => open::open_box(&mut model),
        Model::OpenBoxes => open::open_boxes(&mut model),
        Model::House => open::house(&mut model),
        Model::Room => open::room(&mut model),
        Model::Sheet => open::sheet(&mut model),
        Model::Bowl => open::bowl(&mut model),
        Model::CardTree => open::card_tree(&mut model),
        Model::Pipe => open::pipe(&mut model),
        Model::Patchwork => {
            torus(&mut model, None);
            open::break_up(&mut model);
        }
    }
    model
}

/// Returns the projection to the surface of a round model; the identity for the other models.
pub(super) fn surface(sample: Model) -> Surface {
    match sample {
        Model::Sphere => |p| on_sphere([p[0], p[1] - RADIUS, p[2]]),
        Model::Torus => on_torus,
        _ => |p| p,
    }
}

fn table(model: &mut Builder) {
    let top = model.part("top");
    top.cuboid([-0.8, 0.9, -0.5], [0.8, 1.0, 0.5]);
    for (name, x, z) in [
        ("leg back left", -0.7, -0.4),
        ("leg back right", 0.7, -0.4),
        ("leg front left", -0.7, 0.4),
        ("leg front right", 0.7, 0.4),
    ] {
        let leg = model.part(name);
        leg.cuboid([x - 0.06, 0.0, z - 0.06], [x + 0.06, 0.9, z + 0.06]);
    }
}

/// The radius of the sphere.
const RADIUS: f64 = 0.5;

fn on_sphere(p: [f64; 3]) -> [f64; 3] {
    let scale = RADIUS / p.iter().map(|v| v * v).sum::<f64>().sqrt();
    [scale * p[0], scale * p[1] + RADIUS, scale * p[2]]
}

/// Adds an icosphere of three subdivisions (1280 triangles), or of as many as give at most
/// `requested` triangles.
fn sphere(model: &mut Builder, requested: Option<usize>) {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    model.part("sphere");
    for axis in 0..3 {
        for (one, g) in [
            (1.0, golden),
            (-1.0, golden),
            (1.0, -golden),
            (-1.0, -golden),
        ] {
            let mut p = [0.0; 3];
            p[(axis + 1) % 3] = one;
            p[(axis + 2) % 3] = g;
            model.vertex(on_sphere(p));
        }
    }
    // The faces are found by distance: neighbors on the icosahedron are the closest pairs.
    let corners = model.positions.clone();
    let distance = |a: u32, b: u32| -> f64 {
        let (a, b) = (corners[a as usize], corners[b as usize]);
        (0..3).map(|x| (a[x] - b[x]).powi(2)).sum::<f64>().sqrt()
    };
    let edge = (1..12)
        .map(|v| distance(0, v))
        .fold(f64::INFINITY, f64::min);
    let is_edge = |a, b| distance(a, b) < 1.01 * edge;
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if is_edge(a, b) && is_edge(b, c) && is_edge(c, a) {
                    model.triangle(outward(&corners, [a, b, c]));
                }
            }
        }
    }
    let levels = match requested {
        None => 3,
        Some(requested) => (0..12)
            .rev()
            .find(|l| 20 << (2 * l) <= requested)
            .unwrap_or(0),
    };
    for _ in 0..levels {
        super::refine::subdivide(model, surface(Model::Sphere));
    }
}

/// Returns the corners in the order that winds counter-clockwise seen from outside the sphere.
fn outward(positions: &[[f64; 3]], [a, b, c]: [u32; 3]) -> [u32; 3] {
    let [p, q, r] = [a, b, c].map(|v| {
        let [x, y, z] = positions[v as usize];
        [x, y - RADIUS, z]
    });
    let volume = p[0] * (q[1] * r[2] - q[2] * r[1])
        + p[1] * (q[2] * r[0] - q[0] * r[2])
        + p[2] * (q[0] * r[1] - q[1] * r[0]);
    if volume > 0.0 { [a, b, c] } else { [a, c, b] }
}

/// The radii of the torus: of the ring, and of its tube.
const TORUS: [f64; 2] = [0.7, 0.25];

fn torus_point(ring: f64, tube: f64) -> [f64; 3] {
    let ((sin_r, cos_r), (sin_t, cos_t)) = (ring.sin_cos(), tube.sin_cos());
    let distance = TORUS[0] + TORUS[1] * cos_t;
    [
        distance * cos_r,
        TORUS[1] + TORUS[1] * sin_t,
        distance * sin_r,
    ]
}

fn on_torus(p: [f64; 3]) -> [f64; 3] {
    let outward = p[0].hypot(p[2]) - TORUS[0];
    torus_point(p[2].atan2(p[0]), (p[1] - TORUS[1]).atan2(outward))
}

/// Adds a torus of 40 × 20 quads; of 20 × 10 or 10 × 5 if it would have more than `requested`
/// triangles.
fn torus(model: &mut Builder, requested: Option<usize>) {
    let fits = |&n: &u32| requested.is_none_or(|requested| (4 * n * n) as usize <= requested);
    let n = [20, 10, 5].into_iter().find(fits).unwrap_or(5);
    let (rings, sides) = (2 * n, n);
    model.part("torus");
    for ring in 0..rings {
        for side in 0..sides {
            let angle = |i: u32, n: u32| TAU * f64::from(i) / f64::from(n);
            model.vertex(torus_point(angle(ring, rings), angle(side, sides)));
        }
    }
    let vertex = |ring: u32, side: u32| ring % rings * sides + side % sides;
    for ring in 0..rings {
        for side in 0..sides {
            let [a, b] = [vertex(ring, side), vertex(ring, side + 1)];
            let [c, d] = [vertex(ring + 1, side + 1), vertex(ring + 1, side)];
            model.triangle([a, b, c]);
            model.triangle([a, c, d]);
        }
    }
}

/// Adds a robot of eleven parts, walking toward +z. Left is +x.
fn robot(model: &mut Builder) {
    model
        .part("pelvis")
        .cuboid([-0.17, 0.86, -0.1], [0.17, 1.02, 0.1]);
    let torso = |x: f64, y: f64, z: f64| {
        let wide = if y > 0.0 { 0.26 } else { 0.16 };
        let deep = if y > 0.0 { 0.14 } else { 0.1 };
        [wide * x, 1.26 + 0.22 * y, deep * z]
    };
    let corner = |bits: usize| {
        let sign = |axis: usize| if bits >> axis & 1 == 1 { 1.0 } else { -1.0 };
        torso(sign(0), sign(1), sign(2))
    };
    model.part("torso").hexahedron(std::array::from_fn(corner));
    model
        .part("head")
        .limb([0.0, 1.5, 0.02], [0.0, 1.78, 0.04], [0.13, 0.11]);
    for (side, x, swing) in [("left", 1.0, 1.0), ("right", -1.0, -1.0)] {
        let shoulder = [0.32 * x, 1.42, 0.0];
        let elbow = [0.38 * x, 1.14, -0.12 * swing];
        let hand = [0.36 * x, 0.9, 0.1 - 0.12 * swing];
        let hip = [0.1 * x, 0.86, 0.0];
        let knee = [0.11 * x, 0.48, 0.16 * swing];
        let foot = [0.11 * x, 0.05, 0.24 * swing - 0.08];
        let mut limb = |name: &str, from, to, radii| {
            model.part(&format!("{name} {side}")).limb(from, to, radii);
        };
        limb("upper arm", shoulder, elbow, [0.075, 0.06]);
        limb("forearm", elbow, hand, [0.065, 0.045]);
        limb("thigh", hip, knee, [0.1, 0.075]);
        limb("shin", knee, foot, [0.08, 0.05]);
    }
}

/// Adds a space ship, with its nose toward +z.
fn space_ship(model: &mut Builder) {
    let ring = |z: f64, radius: f64| Ring {
        center: [0.0, 0.35, z],
        radius,
    };
    let hull = [
        ring(-1.1, 0.2),
        ring(-0.9, 0.26),
        ring(-0.2, 0.28),
        ring(0.4, 0.22),
        ring(0.9, 0.12),
        ring(1.3, 0.03),
    ];
    model.part("hull").tube(&hull, 16);
    let canopy = |z: f64, y: f64, radius: f64| Ring {
        center: [0.0, y, z],
        radius,
    };
    let canopy = [
        canopy(-0.1, 0.56, 0.06),
        canopy(0.1, 0.56, 0.12),
        canopy(0.35, 0.52, 0.1),
        canopy(0.55, 0.46, 0.04),
    ];
    model.part("canopy").tube(&canopy, 8);
    for (side, x) in [("left", 1.0), ("right", -1.0)] {
        wing_and_engine(model, side, x);
    }
    let fin = std::array::from_fn(|bits| {
        let (right, up, front) = (bits & 1 == 1, bits >> 1 & 1 == 1, bits >> 2 & 1 == 1);
        let px = if right { 0.02 } else { -0.02 };
        let pz = match (up, front) {
            (false, false) => -1.05,
            (false, true) => -0.55,
            (true, false) => -1.2,
            (true, true) => -0.95,
        };
        [px, if up { 0.95 } else { 0.58 }, pz]
    });
    model.part("fin").hexahedron(fin);
}

/// Adds a wing and an engine of the space ship on the side where `x` is positive or negative.
fn wing_and_engine(model: &mut Builder, side: &str, x: f64) {
    let mirrored = |[px, py, pz]: [f64; 3]| [x * px, py, pz];
    // Mirroring turns a shape inside out: its corners swap along x too.
    let swap = usize::from(x < 0.0);
    let wing: [[f64; 3]; 8] = std::array::from_fn(|bits| {
        let bits = bits ^ swap;
        let (tip, up, front) = (bits & 1 == 1, bits >> 1 & 1 == 1, bits >> 2 & 1 == 1);
        let px = if tip { 1.2 } else { 0.2 };
        let thickness = if tip { 0.015 } else { 0.05 };
        let py = if tip { 0.22 } else { 0.33 } + if up { thickness } else { -thickness };
        let pz = match (tip, front) {
            (false, false) => -0.85,
            (false, true) => 0.25,
            (true, false) => -0.95,
            (true, true) => -0.6,
        };
        mirrored([px, py, pz])
    });
    model.part(&format!("wing {side}")).hexahedron(wing);
    let engine = |z: f64, radius: f64| Ring {
        center: mirrored([0.42, 0.3, z]),
        radius,
    };
    let engine = [engine(-1.25, 0.08), engine(-1.1, 0.11), engine(-0.5, 0.07)];
    model.part(&format!("engine {side}")).tube(&engine, 10);
}
