//! Measures the cost of the presets: alternating bakes of the papers' plain grid, of the default's grid
//! without the near-surface fit, and of the other presets. Prints median times in milliseconds, from the
//! loaded mesh to the grid, and their ratios to the plain grid.
//!
//! ```sh
//! cargo bench -p aogrid-baker-cpu --bench presets -- teapot.obj bunny.obj
//! ```

use std::hint::black_box;
use std::time::Instant;

use aogrid_bake_core::mesh::{self, LoadedMesh};
use aogrid_bake_core::{BakeOptions, Placement, Preset, UNOBSERVED, bake_grid};
use aogrid_baker_cpu::{BakeError, Baker};
use aogrid_grid_format::Source;

/// The number of measured rounds of bakes. One more round before them warms up the buffers.
const ROUNDS: usize = 41;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Cargo appends `--bench`.
    let models = std::env::args()
        .skip(1)
        .filter(|arg| !arg.starts_with("--"));
    print!("{:26}", "model");
    NAMES.iter().for_each(|name| print!(" {name:>17}"));
    println!();
    for path in models {
        let loaded = mesh::load(path.as_ref())?;
        let medians = medians(&loaded)?;
        print!("{:26}", loaded.name);
        for median in medians {
            print!(" {median:9.2} {:6.3}x", median / medians[0]);
        }
        println!();
    }
    Ok(())
}

/// The bakes in the order of the columns; all others are relative to the first.
const NAMES: [&str; 5] = ["paper", "without fit", "economy", "default", "fine"];

/// Returns the median milliseconds of each bake.
fn medians(loaded: &LoadedMesh) -> Result<[f64; 5], BakeError> {
    let without_fit = BakeOptions {
        fit: false,
        ..Preset::Default.options()
    };
    let of = |preset: Preset| (preset.placement(), preset.options());
    let bakes: [(Placement, BakeOptions); 5] = [
        of(Preset::Paper),
        (Preset::Default.placement(), without_fit),
        of(Preset::Economy),
        of(Preset::Default),
        of(Preset::Fine),
    ];
    let mut baker = Baker::new(None);
    let mut times = [(); 5].map(|()| Vec::new());
    for round in 0..=ROUNDS {
        for ((placement, options), times) in bakes.iter().zip(&mut times) {
            let start = Instant::now();
            let source = Source::from(loaded);
            let grid = bake_grid(&loaded.mesh, placement, options, source, |spec, options| {
                baker.prepare(&loaded.mesh, spec, options)?.bake(UNOBSERVED)
            });
            let grid: Result<_, BakeError> = grid;
            black_box(grid?);
            if round > 0 {
                times.push(1e3 * start.elapsed().as_secs_f64());
            }
        }
    }
    Ok(times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[ROUNDS / 2]
    }))
}
