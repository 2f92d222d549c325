//! An estimate of the time that a bake takes, before it begins.

use aogrid_bake_core::{Algorithm, BakeOptions, TriangleMesh};
use aogrid_baker_cpu::Sweeper;
use aogrid_grid_format::{GridSpec, Sampling};

use super::check;

/// Seconds of a core for a bake of nothing.
const SWEEP: f64 = 2e-3;
/// The same for a triangle, and for a triangle or a cell in each direction. Measured with 400 to 400,000
/// triangles, 16³ to 64³ cells and faces of 8² to 32² on two AVX-512 cores, and doubled: meshes with many
/// silhouettes take longer than the measured one. Five real models then took 0.8 to 4 times the estimate
/// on cores that twice as many processes used, and a building with long walls, which have long
/// silhouettes, 7 to 17 times.
const SWEEP_TRIANGLE: f64 = 1.1e-6;
const SWEEP_TRIANGLE_DIRECTION: f64 = 2.6e-10;
const SWEEP_CELL_DIRECTION: f64 = 7.2e-10;

/// Seconds of a core for a ray at each level of the BVH, and for a triangle in building it; measured
/// with 400 and 400,000 triangles, and doubled.
const RAY_LEVEL: f64 = 2.4e-8;
const BVH_TRIANGLE: f64 = 2.2e-6;

/// Seconds for a cell in post-processing, and for a cell near the surface in the fit, of which a grid
/// has about as many as its faces: 16³ to 64³ cells take 0.04 to 0.09 ms each,
/// those of many triangles more.
const POST_CELL: f64 = 5e-8;
const FIT_CELL: f64 = 1e-4;

/// Texels along a face of the fit's points.
const FIT_FACE: f64 = 8.0;

/// Returns about the seconds that a bake takes on this machine's CPU after the model is loaded.
/// `lattice` has the points of the near-surface fit. It tells seconds from hours: other processes and
/// the shape of the model change it several times.
pub(super) fn seconds(
    mesh: &TriangleMesh,
    spec: &GridSpec,
    lattice: Option<&GridSpec>,
    options: &BakeOptions,
    requested: Option<Algorithm>,
    is_checked: bool,
) -> f64 {
    let triangles = mesh.triangles().len() as f64;
    let (directions, fit_directions) = match options.sampling {
        Sampling::CubeFaces { size } => (6.0 * f64::from(size).powi(2), 6.0 * FIT_FACE.powi(2)),
        Sampling::MonteCarlo { count, .. } => (f64::from(count), f64::from(count)),
    };
    let casts = requested == Some(Algorithm::RayCasting)
        || options.max_distance.is_some()
        || matches!(options.sampling, Sampling::MonteCarlo { .. });
    let rays = |rays: f64| BVH_TRIANGLE * triangles + RAY_LEVEL * rays * (triangles + 2.0).log2();
    let visibility = |cells: f64, directions: f64| match casts {
        true => rays(cells * directions),
        false => {
            let of_direction = SWEEP_CELL_DIRECTION * cells + SWEEP_TRIANGLE_DIRECTION * triangles;
            SWEEP + SWEEP_TRIANGLE * triangles + directions * of_direction * level_factor()
        }
    };
    let cells = spec.cell_count() as f64;
    let mut of_cores = visibility(cells, directions);
    let mut alone = POST_CELL * cells;
    if let Some(points) = lattice {
        of_cores += visibility(points.cell_count() as f64, fit_directions);
        alone += FIT_CELL * cells.powf(2.0 / 3.0);
    }
    if is_checked {
        of_cores += rays(check::RAYS);
    }
    of_cores / rayon::current_num_threads() as f64 + alone
}

/// Returns the time of the sweep at this machine's SIMD level, relative to AVX-512 (docs/cpu-bake.md).
fn level_factor() -> f64 {
    match Sweeper::simd_levels()[0] {
        "avx512" => 1.0,
        "avx2" => 2.3,
        _ => 3.0,
    }
}

/// Returns a duration as a person would say it.
pub(super) fn shown(seconds: f64) -> String {
    match seconds {
        s if s < 0.1 => "less than 0.1 s".into(),
        s if s < 9.5 => format!("about {s:.1} s"),
        s if s < 90.0 => format!("about {s:.0} s"),
        s if s < 5400.0 => format!("about {:.0} min", s / 60.0),
        s => format!("about {:.0} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aogrid_bake_core::models::Model;
    use aogrid_bake_core::{Placement, Preset};

    /// More of anything takes longer, rays longer than the sweep; a usual bake takes less than a second
    /// on any machine, and one of a thousand times the work does not.
    #[test]
    fn more_work_takes_longer() {
        let mesh = Model::SpaceShip.mesh(None).unwrap();
        let estimate = |n: u32, face: u32, requested, is_checked| {
            let placement = Placement {
                resolution: [n; 3],
                ..Placement::paper()
            };
            let spec = placement.place(&mesh.bounds()).unwrap();
            let options = BakeOptions {
                sampling: Sampling::CubeFaces { size: face },
                ..Preset::Paper.options()
            };
            seconds(&mesh, &spec, None, &options, requested, is_checked)
        };
        let usual = estimate(32, 16, None, false);
        assert!((1e-3..1.0).contains(&usual), "{usual}");
        for more in [
            estimate(64, 16, None, false),
            estimate(32, 32, None, false),
            estimate(32, 16, Some(Algorithm::RayCasting), false),
            estimate(32, 16, None, true),
        ] {
            assert!(more > 1.5 * usual, "{more} {usual}");
        }
        assert!(estimate(256, 32, None, false) > 100.0 * usual);
    }

    #[test]
    fn durations_are_rounded() {
        let texts = [0.01, 0.25, 20.0, 600.0, 9e4].map(shown);
        let expected = [
            "less than 0.1 s",
            "about 0.2 s",
            "about 20 s",
            "about 10 min",
            "about 25 h",
        ];
        assert_eq!(texts, expected);
    }
}
