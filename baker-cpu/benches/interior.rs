//! Measures the cost of finding the interior of open meshes: alternating bakes with interior
//! `enclosed` and `signed`, including preparation. Prints median and minimum times in milliseconds,
//! and their ratios.
//!
//! ```sh
//! cargo bench -p aogrid-baker-cpu --bench interior -- teapot.obj bunny.obj
//! ```

use std::hint::black_box;
use std::time::Instant;

use aogrid_bake_core::mesh::{self, LoadedMesh};
use aogrid_bake_core::{Algorithm, BakeOptions, Placement, UNOBSERVED};
use aogrid_baker_cpu::Baker;
use aogrid_grid_format::Interior;

/// The number of measured pairs of bakes. One more pair before them warms up the buffers.
const PAIRS: usize = 101;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Cargo appends `--bench`.
    let models = std::env::args()
        .skip(1)
        .filter(|arg| !arg.starts_with("--"));
    println!(
        "{:26} {:>18} {:>18} {:>13}",
        "model", "enclosed", "signed", "ratio"
    );
    for path in models {
        let loaded = mesh::load(path.as_ref())?;
        let [enclosed, signed] = times(&loaded)?;
        let ratio = [0, 1].map(|i| signed[i] / enclosed[i]);
        let pair = |[median, minimum]: [f64; 2]| format!("{median:9.3} {minimum:8.3}");
        let columns = [enclosed, signed].map(pair);
        println!(
            "{:26} {} {} {:6.3} {:6.3}",
            loaded.name, columns[0], columns[1], ratio[0], ratio[1]
        );
    }
    Ok(())
}

/// Returns the median and minimum milliseconds with `enclosed`, and with `signed`.
fn times(loaded: &LoadedMesh) -> Result<[[f64; 2]; 2], Box<dyn std::error::Error>> {
    let spec = Placement::paper().place(&loaded.mesh.bounds())?;
    let options = [Interior::Enclosed, Interior::Signed].map(|interior| BakeOptions {
        interior,
        ..BakeOptions::paper()
    });
    let mut baker = Baker::new(Some(Algorithm::DirectionSweep));
    let mut times = [Vec::new(), Vec::new()];
    for pair in 0..=PAIRS {
        for (options, times) in options.iter().zip(&mut times) {
            let start = Instant::now();
            let mut prepared = baker.prepare(&loaded.mesh, spec, options)?;
            black_box(prepared.bake(UNOBSERVED)?);
            if pair > 0 {
                times.push(1e3 * start.elapsed().as_secs_f64());
            }
        }
    }
    Ok(times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        [times[PAIRS / 2], times[0]]
    }))
}
