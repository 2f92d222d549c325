//! Tests of the path-traced reference.

/// Light of skies and of an area light.
mod light;
/// Occlusion against closed forms, and the estimate of its error.
mod occlusion;
/// Seeds, threads, observers.
mod runs;

use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::models::Model;
use aogrid_scene::reference::{Environment, Receiver};
use aogrid_tests::{form_factor, mesh_of};

const UP: [f64; 3] = [0.0, 1.0, 0.0];

/// A scene whose occlusion is known.
struct KnownScene {
    name: &'static str,
    mesh: TriangleMesh,
    receivers: Vec<Receiver>,
    expected: Vec<f64>,
}

/// Returns receivers on the floor, facing up, each at another position.
fn floor(position_at: impl Fn(f64, f64) -> Option<[f64; 2]>) -> Vec<Receiver> {
    let n = 16;
    let step = |i: i32| (f64::from(i) + 0.37) / f64::from(n);
    let squares = (0..n * n).map(|idx| [step(idx % n), step(idx / n)]);
    let placed = squares.filter_map(|[u, v]| position_at(u, v));
    placed
        .map(|[x, z]| Receiver {
            position: [x, 0.0, z],
            normal: UP,
        })
        .collect()
}

/// Returns two triangles for each quad.
fn quads(quads: &[[[f64; 3]; 4]]) -> TriangleMesh {
    let triangles = quads.iter().flat_map(|q| {
        let [a, b, c, d] = q.map(|p| p.map(|v| v as f32));
        [[a, b, c], [a, c, d]]
    });
    mesh_of(&triangles.collect::<Vec<_>>())
}

fn known(
    name: &'static str,
    mesh: TriangleMesh,
    receivers: Vec<Receiver>,
    ao: impl Fn([f64; 3]) -> f64,
) -> KnownScene {
    let expected = receivers.iter().map(|r| ao(r.position)).collect();
    KnownScene {
        name,
        mesh,
        receivers,
        expected,
    }
}

/// Returns a cube on the floor: convex, so the form factors of the sides that face the receiver add
/// up.
fn cube() -> KnownScene {
    let mesh = Model::Box.mesh(None).unwrap();
    let outside = |u: f64, v: f64| {
        let at = [3.0 * u - 1.5, 3.0 * v - 1.5];
        at.iter().any(|x| x.abs() > 0.501).then_some(at)
    };
    known("cube", mesh, floor(outside), |[x, _, z]| {
        let side = |at: f64, swap: bool| {
            let corner = |along: f64, y: f64| match swap {
                false => [at, y, along],
                true => [along, y, at],
            };
            [
                corner(-0.5, 0.0),
                corner(0.5, 0.0),
                corner(0.5, 1.0),
                corner(-0.5, 1.0),
            ]
        };
        let mut sum = 0.0;
        for (v, swap) in [(x, false), (z, true)] {
            if v.abs() > 0.5 {
                sum += form_factor(&side(0.5 * v.signum(), swap), [x, 0.0, z], UP);
            }
        }
        sum
    })
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len() as f64;
    (values.map(|v| v * v).sum::<f64>() / n).sqrt()
}

/// Returns a sky of few texels, one of them a sun, rotated about the world's x axis, and its
/// irradiance over π on the floor.
fn sunny() -> (Environment, [f64; 3]) {
    let size = [16, 8];
    let mut texels: Vec<_> = (0..128)
        .map(|i| [0.1 + 0.01 * i as f32, 0.3, 0.2])
        .collect();
    texels[2 * 16 + 5] = [4000.0, 3000.0, 2000.0];
    let (sin, cos) = 0.4_f64.sin_cos();
    let rows = [[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]];
    let environment = Environment::new(size, texels, rows).unwrap();
    // The mean over the cosine-weighted hemisphere, at 1024 × 512 points of the sphere.
    let (mut sum, n) = ([0.0; 3], 512);
    for row in 0..n {
        let (up, sin_colatitude) =
            (std::f64::consts::PI * (0.5 - (f64::from(row) + 0.5) / f64::from(n))).sin_cos();
        for column in 0..2 * n {
            let (x, z) =
                (std::f64::consts::PI * (f64::from(column) + 0.5) / f64::from(n)).sin_cos();
            let direction = [sin_colatitude * x, up, sin_colatitude * z];
            let radiance = environment.radiance(direction);
            let weight =
                up.max(0.0) * sin_colatitude * (std::f64::consts::PI / f64::from(n)).powi(2);
            for c in 0..3 {
                sum[c] += f64::from(radiance[c]) * weight / std::f64::consts::PI;
            }
        }
    }
    (environment, sum)
}
