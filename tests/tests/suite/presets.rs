use aogrid_bake_core::models::Model;
use aogrid_bake_core::{Preset, TriangleMesh};
use aogrid_baker_cpu::RayScene;
use aogrid_grid_format::Grid;
use aogrid_scene::reference::Receiver;
use aogrid_tests::{Shaded, grid, mesh_of, truth};

/// Rays for the truth of a receiver: a standard error of 0.004 at the most, and several times less
/// by strata.
const SAMPLES: u32 = 16_384;

fn by_preset(mesh: &TriangleMesh, preset: Preset) -> Grid {
    grid(mesh, &preset.placement(), &preset.options())
}

/// BLAKE3 of the texels that aogrid 0.1.0 baked with its defaults and `--interior enclosed`, before
/// there were presets. Their models have no sines in their vertices, which differ from machine to
/// machine.
const PAPER: [(Model, &str); 3] = [
    (
        Model::Box,
        "8ea0cf8ad927e0a5c40109d19cee861f59d5550cd119a2bbf47c1f853ec09c2b",
    ),
    (
        Model::Table,
        "68dae177718c699f0fd5d9f15e4c9179316e48c14abfc27f0c2b795123c686e3",
    ),
    (
        Model::LShape,
        "3319c301ba3529d883c3a94fe8aec2feb750381c10dae9776bdd780c79f47932",
    ),
];

#[test]
fn the_preset_of_the_papers_is_frozen() {
    for (model, hash) in PAPER {
        let baked = by_preset(&model.mesh(None).unwrap(), Preset::Paper);
        let found = blake3::hash(baked.texels()).to_hex().to_string();
        assert_eq!(found, hash, "{model:?}");
    }
}

/// The floor beside a unit box is what the papers' grids lose most of.
#[test]
fn the_floor_beside_a_box_is_in_its_shadow() {
    /// The error that a grid of 32³ cells may have a fifth of the box away from it and farther.
    const TOLERANCE: f64 = 0.02;
    let mesh = Model::Box.mesh(None).unwrap();
    let bounds = mesh.bounds();
    let (floor, side) = (f64::from(bounds.min[1]), f64::from(bounds.max[0]));
    let width = f64::from(bounds.max[0] - bounds.min[0]);
    let receivers = [0.18, 0.43, 0.68, 0.93].map(|distance| Receiver {
        position: [side + distance * width, floor + 1e-4 * width, 0.0],
        normal: [0.0, 1.0, 0.0],
    });
    let truths = truth(&RayScene::new(&mesh), &receivers, 0.0, SAMPLES);
    let errors = |preset: Preset| -> Vec<f64> {
        let shaded = Shaded::in_object_space(&by_preset(&mesh, preset));
        let error = |(receiver, truth): (&Receiver, &f64)| {
            let [p, n] = [receiver.position, receiver.normal].map(|v| v.map(|x| x as f32));
            f64::from(shaded.cone(p, n)) - truth
        };
        receivers.iter().zip(&truths).map(error).collect()
    };
    for preset in [Preset::Default, Preset::Economy, Preset::Fine] {
        let errors = errors(preset);
        let worst = errors.iter().fold(0.0, |worst: f64, e| worst.max(e.abs()));
        assert!(worst <= TOLERANCE, "{preset:?}: {errors:?} of {truths:?}");
    }
    // The test can fail: the papers' grids end before the third receiver.
    let errors = errors(Preset::Paper);
    assert!(errors[2] < -0.99 * truths[2], "{errors:?} of {truths:?}");
}

/// Cells on both sides of a thin wall have opposite axes. What is left of them in between must not
/// be taken for an axis, or the wall's feet get a dark seam.
#[test]
fn thin_walls_have_no_dark_seam_along_their_feet() {
    let (half, thickness) = (0.9, 0.01);
    let mesh = mesh_of(&wall([half, 0.5, 0.5 * thickness]));
    let shaded_by = |preset: Preset| Shaded::in_object_space(&by_preset(&mesh, preset));
    let cell = 2.0 * half / 20.0;
    let receivers: Vec<Receiver> = (0..160)
        .map(|i| {
            let along = half * (f64::from(i % 20) / 10.0 - 0.95) * 0.9;
            let across = 0.5 * thickness + cell * (f64::from(i / 20) + 0.5) / 8.0;
            Receiver {
                position: [along, -0.4999, across],
                normal: [0.0, 1.0, 0.0],
            }
        })
        .collect();
    let truths = truth(&RayScene::new(&mesh), &receivers, 0.0, SAMPLES);
    let bias = |shaded: &Shaded| {
        let errors = receivers.iter().zip(&truths).map(|(r, truth)| {
            let [p, n] = [r.position, r.normal].map(|v| v.map(|x| x as f32));
            f64::from(shaded.cone(p, n)) - truth
        });
        errors.sum::<f64>() / receivers.len() as f64
    };
    let default = bias(&shaded_by(Preset::Default));
    // The same without soft cones: every axis is a unit vector.
    let mut hard = shaded_by(Preset::Default);
    hard.occluder.min_axis_length = 1.0;
    let hard = bias(&hard);
    let paper = bias(&shaded_by(Preset::Paper));
    println!("default {default:.4}, by hard cones {hard:.4}, paper {paper:.4}");
    assert!(
        hard > 0.0 && default.abs() <= 0.75 * hard,
        "{default} {hard}"
    );
}

/// Returns the corners of the triangles of a box around the origin.
fn wall([x, y, z]: [f64; 3]) -> Vec<[[f32; 3]; 3]> {
    let corner = |i: usize| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        [x * sign(0), y * sign(1), z * sign(2)].map(|v| v as f32)
    };
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let triangles = faces
        .iter()
        .flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]);
    triangles.map(|t| t.map(corner)).collect()
}
