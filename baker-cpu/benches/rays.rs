//! Measures single rays: from points just above the centers of faces, in 512 directions of the
//! hemisphere above each, the same sphere of directions for all. Prints millions of rays per second
//! at each SIMD level, of occlusion and of closest hits, as medians of alternating rounds on one
//! thread.
//!
//! ```sh
//! cargo bench -p aogrid-baker-cpu --bench rays -- bunny.obj dragon.obj
//! ```

use std::hint::black_box;
use std::time::Instant;

use aogrid_bake_core::TriangleMesh;
use aogrid_bake_core::mesh::{self, LoadError};
use aogrid_baker_cpu::RayScene;

/// The number of measured rounds. One more round before them warms up.
const ROUNDS: usize = 7;

/// The number of faces that rays start from; those of larger meshes are skipped regularly.
const FACES: usize = 600;

/// The number of directions of a whole sphere.
const DIRECTIONS: usize = 1024;

/// The distance of a start above its face, in half-diagonals of the mesh's box.
const LIFT: f64 = 2e-4;

type Vector = [f64; 3];

fn main() -> Result<(), LoadError> {
    // Cargo appends `--bench`.
    let models = std::env::args()
        .skip(1)
        .filter(|arg| !arg.starts_with("--"));
    println!(
        "{:26} {:>9} {:>9} {:>9} {:>9}",
        "model", "triangles", "SIMD", "occlusion", "closest"
    );
    for path in models {
        let loaded = mesh::load(path.as_ref())?;
        let rays = rays(&loaded.mesh);
        let scenes = RayScene::simd_levels().into_iter().filter_map(|level| {
            let scene = RayScene::with_simd_level(&loaded.mesh, level)?;
            Some((level, scene))
        });
        let scenes: Vec<_> = scenes.collect();
        for ((level, _), [occlusion, closest]) in scenes.iter().zip(rates(&scenes, &rays)) {
            println!(
                "{:26} {:9} {level:>9} {occlusion:9.2} {closest:9.2}",
                loaded.name,
                loaded.mesh.triangles().len()
            );
        }
    }
    Ok(())
}

/// Returns the rays of a mesh: starts and directions.
fn rays(mesh: &TriangleMesh) -> Vec<(Vector, Vector)> {
    let half: Vector = mesh.bounds().half_extents().map(f64::from);
    let lift = LIFT * dot(half, half).sqrt();
    let directions = fibonacci_sphere();
    let step = (mesh.triangles().len() / FACES).max(1);
    let mut rays = Vec::new();
    for triangle in mesh.triangles().iter().step_by(step) {
        let [a, b, c] = triangle.map(|v| mesh.positions()[v as usize].map(f64::from));
        let normal = cross(minus(b, a), minus(c, a));
        let length = dot(normal, normal).sqrt();
        if length == 0.0 {
            continue;
        }
        let origin = mesh.origin();
        let start = std::array::from_fn(|x| {
            origin[x] + (a[x] + b[x] + c[x]) / 3.0 + lift * normal[x] / length
        });
        let above = directions.iter().filter(|d| dot(normal, **d) > 0.0);
        rays.extend(above.map(|&direction| (start, direction)));
    }
    rays
}

/// Returns evenly spread directions.
fn fibonacci_sphere() -> Vec<Vector> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let direction = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / DIRECTIONS as f64;
        let (sin, cos) = (i as f64 * golden_angle).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        [radius * cos, radius * sin, z]
    };
    (0..DIRECTIONS).map(direction).collect()
}

/// Returns millions of rays per second, of occlusion and of closest hits, for each scene.
fn rates(scenes: &[(&str, RayScene)], rays: &[(Vector, Vector)]) -> Vec<[f64; 2]> {
    let mut times = vec![[(); 2].map(|()| Vec::new()); scenes.len()];
    for round in 0..=ROUNDS {
        for ((_, scene), [occlusion, closest]) in scenes.iter().zip(&mut times) {
            let start = Instant::now();
            for &(origin, direction) in rays {
                black_box(scene.is_occluded(origin, direction, f64::INFINITY));
            }
            let middle = Instant::now();
            for &(origin, direction) in rays {
                black_box(scene.closest_hit(origin, direction));
            }
            if round > 0 {
                occlusion.push((middle - start).as_secs_f64());
                closest.push(middle.elapsed().as_secs_f64());
            }
        }
    }
    let rate = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        rays.len() as f64 / times[ROUNDS / 2] / 1e6
    };
    times.into_iter().map(|times| times.map(rate)).collect()
}

fn minus(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|x| a[x] - b[x])
}

fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|x| {
        let (y, z) = ((x + 1) % 3, (x + 2) % 3);
        a[y] * b[z] - a[z] * b[y]
    })
}
