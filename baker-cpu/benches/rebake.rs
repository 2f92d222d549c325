//! Measures a deforming mesh: alternating bakes of its poses, each prepared anew and by a `Rebaker`,
//! at 16³ cells with faces of 8². Prints median milliseconds, and their ratio.
//!
//! ```sh
//! cargo bench -p aogrid-baker-cpu --bench rebake -- teapot.obj fox.glb
//! RAYON_NUM_THREADS=1 cargo bench -p aogrid-baker-cpu --bench rebake -- teapot.obj fox.glb
//! ```

use std::hint::black_box;
use std::time::Instant;

use aogrid_bake_core::mesh::{self, LoadedMesh};
use aogrid_bake_core::{BakeOptions, Placement, TriangleMesh, UNOBSERVED};
use aogrid_baker_cpu::{Baker, Rebaker};
use aogrid_grid_format::Sampling;

/// The number of measured rounds. One more round before them warms up the buffers.
const ROUNDS: usize = 41;

/// The number of poses that take turns.
const POSES: usize = 4;

type AnyError = Box<dyn std::error::Error>;

fn main() -> Result<(), AnyError> {
    // Cargo appends `--bench`.
    let models = std::env::args()
        .skip(1)
        .filter(|arg| !arg.starts_with("--"));
    println!(
        "{:26} {:>9} {:>9} {:>9}",
        "model", "triangles", "anew", "rebaked"
    );
    for path in models {
        let loaded = mesh::load(path.as_ref())?;
        let [anew, rebaked] = medians(&loaded)?;
        println!(
            "{:26} {:9} {anew:9.2} {rebaked:9.2} {:6.3}x",
            loaded.name,
            loaded.mesh.triangles().len(),
            rebaked / anew
        );
    }
    Ok(())
}

/// Returns a pose of a mesh: sheared along y.
fn pose(mesh: &TriangleMesh, n: usize) -> Result<TriangleMesh, AnyError> {
    let shear = 0.1 * n as f32;
    let positions = mesh.positions().iter();
    let positions = positions.map(|[x, y, z]| [x + shear * y, *y, *z]).collect();
    let (triangles, parts) = (mesh.triangles().to_vec(), mesh.parts().to_vec());
    Ok(TriangleMesh::new(positions, triangles, parts)?)
}

/// Returns the median milliseconds of bakes prepared anew, and of rebakes.
fn medians(loaded: &LoadedMesh) -> Result<[f64; 2], AnyError> {
    let placement = Placement {
        resolution: [16; 3],
        ..Placement::paper()
    };
    let options = BakeOptions {
        sampling: Sampling::CubeFaces { size: 8 },
        ..BakeOptions::paper()
    };
    let poses = (0..POSES).map(|n| pose(&loaded.mesh, n));
    let poses: Vec<_> = poses.collect::<Result<_, _>>()?;
    let (mut baker, mut rebaker) = (Baker::new(None), Rebaker::new());
    let mut times = [(); 2].map(|()| Vec::new());
    for round in 0..=ROUNDS {
        let mesh = &poses[round % POSES];
        let spec = placement.place(&mesh.bounds())?;
        let start = Instant::now();
        let mut prepared = baker.prepare(mesh, spec, &options)?;
        let anew = prepared.bake(UNOBSERVED)?;
        let middle = Instant::now();
        let rebaked = rebaker.bake(mesh, spec, &options, UNOBSERVED)?;
        let end = Instant::now();
        black_box((anew, rebaked));
        if round > 0 {
            times[0].push(1e3 * (middle - start).as_secs_f64());
            times[1].push(1e3 * (end - middle).as_secs_f64());
        }
    }
    Ok(times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[ROUNDS / 2]
    }))
}
